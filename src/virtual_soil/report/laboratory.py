"""Laboratory curves as they were read: every reading, and those that count."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from virtual_soil.campaign.experiments.shear.laboratory import ENTRY, ShearTests, understood
from virtual_soil.campaign.soils import soil_content
from virtual_soil.report.plots import COLOURS, canvas


def laboratory_of(soils: list[str]) -> dict[str, ShearTests]:
    """Soil -> its laboratory's shear tests, of the soil files that name curves."""
    entries = {Path(path): soil_content(Path(path)).get(ENTRY) for path in soils}
    found = {path.stem: understood(path, entry) for path, entry in entries.items() if entry is not None}
    return {soil: tests for soil, tests in found.items() if tests.curves}


def draw_tests(soils: Mapping[str, ShearTests]) -> Figure:
    """Strength line of every soil, a panel each beside one of its shear curves if it has any; grey: readings that do not count."""
    n = sum(1 + bool(tests.curves) for tests in soils.values())
    figure, panels = canvas(n, width=max(4.0 * n, 8.0), height=3.8)
    left = iter(panels)
    for soil, tests in soils.items():
        if tests.curves:
            draw_curves(next(left), soil, tests)
        draw_line(next(left), soil, tests)
    return figure


def draw_curves(axes, soil: str, tests: ShearTests) -> None:
    """Shear stress over displacement of all readings, and of those that count, with the strength of each test."""
    axes.plot(1e3 * tests.readings["displacement_m"], 1e-3 * tests.readings["shear_stress_pa"], ".", color="0.75", markersize=4)
    for colour, curve in zip(np.resize(COLOURS, len(tests.curves)), tests.curves, strict=True):
        x = curve.displacement_m + tests.readings.loc[tests.readings["test"] == curve.label, "displacement_m"].iloc[0]
        axes.plot(1e3 * x, 1e-3 * curve.shear, ".-", color=colour, markersize=3, linewidth=0.8, label=curve.label)
        axes.axhline(1e-3 * tests.points[curve.label][1], color=colour, linewidth=0.6, linestyle=":")
    axes.set(title=soil, xlabel="displacement (mm)", ylabel="shear stress (kPa)")
    axes.legend(fontsize="x-small", title="test")


def draw_line(axes, soil: str, tests: ShearTests) -> None:
    """Strength over normal stress of every test, and the line through them."""
    p, tau = np.array(list(tests.points.values())).T
    axes.plot(1e-3 * p, 1e-3 * tau, "o", color="black", markersize=4)
    ends = np.array([0.0, 1.05 * p.max()])
    slope = np.tan(np.radians(tests.line.friction_angle_deg))
    axes.plot(1e-3 * ends, 1e-3 * (tests.line.cohesion_pa + slope * ends), color=COLOURS[0])
    title = tests.kind if tests.curves else f"{soil}: {tests.kind}"
    axes.set(title=title, xlabel="normal stress (kPa)", ylabel="strength (kPa)", xlim=(0, None), ylim=(0, None))
