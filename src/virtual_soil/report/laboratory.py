"""Laboratory curves as they were read: every reading, and those that count."""

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from virtual_soil.campaign.experiments.shear.laboratory import ShearTests
from virtual_soil.report.plots import COLOURS, canvas


def draw_tests(soils: Mapping[str, ShearTests]) -> Figure:
    """Shear curves of every soil, a panel each beside its strength line; grey: readings that do not count."""
    figure, panels = canvas(2 * len(soils), width=max(8.0 * len(soils), 8.0), height=3.8)
    for k, (soil, tests) in enumerate(soils.items()):
        curves, line = panels[2 * k], panels[2 * k + 1]
        curves.plot(
            1e3 * tests.readings["displacement_m"], 1e-3 * tests.readings["shear_stress_pa"], ".", color="0.75", markersize=4
        )
        for colour, curve in zip(np.resize(COLOURS, len(tests.curves)), tests.curves, strict=True):
            x = curve.displacement_m + tests.readings.loc[tests.readings["test"] == curve.label, "displacement_m"].iloc[0]
            curves.plot(1e3 * x, 1e-3 * curve.shear, ".-", color=colour, markersize=3, linewidth=0.8, label=curve.label)
            curves.axhline(1e-3 * tests.points[curve.label][1], color=colour, linewidth=0.6, linestyle=":")
        curves.set(title=soil, xlabel="displacement (mm)", ylabel="shear stress (kPa)")
        curves.legend(fontsize="x-small", title="test")
        p, tau = np.array(list(tests.points.values())).T
        line.plot(1e-3 * p, 1e-3 * tau, "o", color="black", markersize=4)
        ends = np.array([0.0, 1.05 * p.max()])
        slope = np.tan(np.radians(tests.line.friction_angle_deg))
        line.plot(1e-3 * ends, 1e-3 * (tests.line.cohesion_pa + slope * ends), color=COLOURS[0])
        line.set(title=tests.kind, xlabel="normal stress (kPa)", ylabel="strength (kPa)", xlim=(0, None), ylim=(0, None))
    return figure
