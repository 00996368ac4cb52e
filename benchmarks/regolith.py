"""The regolith that the paper could not calibrate: what its answer does on the Moon, at other heights and with other grains.

    snakemake -c2 all --configfile config/regolith.yaml && python benchmarks/regolith.py [--beds 5]

Takes the optimum of results/regolith and writes docs/regolith.md with its figures, on two cores. Nothing is
fitted here.
"""

import argparse
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import NamedTuple

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

from dem import Grains
from dem.experiments import angle_of_repose, cut_slope
from dem.experiments.soil import Engine
from virtual_soil.campaign.experiments.apparatus import GRAVITIES_M_S2
from virtual_soil.campaign.experiments.common import soil_of
from virtual_soil.campaign.experiments.repose import declared as repose
from virtual_soil.campaign.experiments.slope import declared as slope
from virtual_soil.campaign.sections import Study
from virtual_soil.campaign.settings import defaults
from virtual_soil.report.experiments.slope import culmann_kappa
from virtual_soil.report.plots import draw_grains

ROOT = Path(__file__).resolve().parents[1]
RESULTS, PAGE, IMAGES = ROOT / "results" / "regolith", ROOT / "docs" / "regolith.md", ROOT / "docs" / "images"
#: Height of the calibrated slope in m and its grains' radius, on Earth.
HEIGHT_M, RADIUS_M = 0.4, 0.013
#: Heights in m over which the angle is shown.
HEIGHTS_M = (0.15, 0.25, 0.4, 0.7, 1.2, 2.4)
#: Radii over that of the calibration.
COARSENESS = (0.4, 1.0, 2.0)
#: Grains of the paper's tube: its base set.
PAPER = {"radius_m": 50e-6, "shear_modulus_pa": 5e7}

TEXT = """# The regolith that the paper could not calibrate

Written by `python benchmarks/regolith.py` from the answer of `snakemake -c2 all --configfile config/regolith.yaml`. The paper's
three numbers for lunar regolith (c 300 Pa, φ 40°, A 65°; Briend et al. 2011, Table 1) are those of a cut slope of {height} m on
Earth here: no source states the height, and without one an angle of soil that coheres means nothing.

Answer: {optimum}.

{answer}

## On the Moon

The same soil in lunar gravity, a slope of {moon} (the same ρb g H), beside the Earth's {height} m,
{beds} new beds each: {on_moon}° and {on_earth}°. Cohesion and friction angle come from plane shear tests, which have
no gravity.

## The angle belongs to a height

| height (m) | c / (ρb g H) | slope angle (°) |
|---|---|---|
{heights}

![Slope angle against cohesion over weight](images/regolith_kappa.png)

## Grain size

The same slope with other grains, adhesive stress and frictions kept:

| radius (mm) | height over radius | slope angle (°) |
|---|---|---|
{radii}

## Why the paper could not do it

In the paper's own heap (tube of 1.5 mm, 3000 grains of 50 µm) c / (ρb g H) of this soil is some {kappa}: status `{status}`,
with {within} of the grains where the tube was. No angle of 65° exists at that size, with any friction; and grains
without adhesion, as the paper's, have no cohesion at all.

![What stands after the tube is lifted](images/regolith_column.png)
"""


class Slope(NamedTuple):
    """A slope to be cut: height, gravity, radius in SI, and the seed of its bed."""

    height_m: float
    gravity: str
    radius_m: float
    seed: int


class Cut(NamedTuple):
    """What came of it: angle in degrees (90 for a wall), solid fraction of the bed, weight rho_b g H in Pa."""

    angle_deg: float
    solid_fraction: float
    weight_pa: float


def study(height_m: float, gravity: str, material: dict) -> tuple[dict, dict]:
    """Configuration and design row of a material."""
    config = defaults(Study)
    config["material"] |= material
    config["slope_test"] |= {"height_m": height_m, "gravity_m_s2": gravity}
    return config, {**config["material"], "fidelity": "campaign"}


def cut(wanted: Slope, material: dict) -> Cut:
    """Find the slope angle of one bed."""
    config, row = study(wanted.height_m, wanted.gravity, material | {"radius_m": wanted.radius_m})
    settings, soil = slope.setup(config, row), soil_of(row, config)
    found = cut_slope.run(soil, cut_slope.Setup(**settings["setup"]), Engine(**settings["engine"]), wanted.seed)
    weight = soil.density_kg_m3 * found.solid_fraction * GRAVITIES_M_S2[wanted.gravity] * found.height_m
    return Cut(90.0 if found.status == "column" else found.slope_angle_deg, found.solid_fraction, weight)


def heap(material: dict) -> tuple[Grains, str, float]:
    """Grains in the paper's tube after its lift, status, and their share within the tube's radius."""
    config, row = study(HEIGHT_M, "earth", material | PAPER)
    settings, soil = repose.setup(config, row), soil_of(row, config)
    setup = angle_of_repose.Setup(**settings["setup"])
    found = angle_of_repose.run(soil, setup, Engine(**settings["engine"]), 1)
    within = np.hypot(*found.grains.positions_m[:, :2].T) < setup.tube_diameter_ratio * setup.scale_radius_m
    return found.grains, found.status, float(within.mean())


def mean_of(values) -> str:
    """Mean with its standard error."""
    values = np.asarray(values, float)
    return f"{values.mean():.1f} ± {values.std(ddof=1) / np.sqrt(len(values)):.1f}"


def answer_table(verification: pd.DataFrame) -> list[str]:
    """Lines of the answer: target, prediction, simulation, and both verdicts."""
    lines = ["| property | target | predicted | simulated with new seeds | prediction | target |", "|---|---|---|---|---|---|"]
    for _, row in verification[verification["match"] != "not asked"].iterrows():
        unit = {"deg": "°"}.get(row["unit"], row["unit"])
        lines.append(
            f"| {row['response'].replace('_', ' ')} ({unit}) | {row['target']:g} ± {row['target_se']:g} | "
            f"{row['predicted']:.1f} ± {row['predicted_se']:.1f} | {row['simulated']:.1f} ± {row['simulated_se']:.1f} "
            f"({row['n_seeds']} seeds) | {row['prediction']} | {row['match']} |"
        )
    return lines


def draw_kappa(cuts: dict[Slope, Cut], cohesion_pa: float, friction_deg: float) -> None:
    """Angle against c over rho_b g H, with Culmann's wedge of the simulated strength."""
    figure, axes = plt.subplots(figsize=(6.0, 4.0), layout="constrained")
    angles = np.linspace(friction_deg, 90.0, 200)
    axes.plot(culmann_kappa(angles, friction_deg), angles, color="0.5", label=f"Culmann's wedge, φ {friction_deg:.1f}°")
    for gravity, marker in (("earth", "o"), ("moon", "^")):
        found = [each for wanted, each in cuts.items() if wanted.gravity == gravity]
        x, y = [cohesion_pa / each.weight_pa for each in found], [each.angle_deg for each in found]
        axes.plot(x, y, marker, fillstyle="none", label=f"one bed, {gravity.capitalize()}")
    axes.axhline(65.0, color="0.8", zorder=0)
    axes.set(xlabel="c / (ρb g H)", ylabel="slope angle (°); 90: stands as a wall", xscale="log", xlim=(1e-3, None))
    axes.legend()
    figure.savefig(IMAGES / "regolith_kappa.png", dpi=120)


def draw_heap(grains: Grains) -> None:
    """Side view of what stands where the tube was."""
    figure, axes = plt.subplots(figsize=(4.0, 4.0), layout="constrained")
    x, y, z = grains.positions_m.T
    table = pd.DataFrame({"x_m": x, "y_m": y, "z_m": z, "radius_m": grains.radii_m})
    draw_grains(axes, table, table["z_m"].to_numpy())
    figure.savefig(IMAGES / "regolith_column.png", dpi=120)


def main() -> None:
    """Simulate, draw, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--beds", type=int, default=5, help="beds of each slope")
    beds = range(201, 201 + parser.parse_args().beds)
    optimum = pd.read_parquet(RESULTS / "calibration.parquet").iloc[0]
    verification = pd.read_parquet(RESULTS / "verification.parquet").set_index("response", drop=False)
    cohesion, friction = (float(verification.loc[name, "simulated"]) for name in ("peak_cohesion", "peak_friction_angle"))
    material = {name: float(optimum[name]) for name in ("adhesive_stress_pa", "static_friction", "rolling_friction")}
    material["shear_modulus_pa"] = 1e9
    scale = GRAVITIES_M_S2["earth"] / GRAVITIES_M_S2["moon"]
    gravities = {"earth": Slope(HEIGHT_M, "earth", RADIUS_M, 0), "moon": Slope(scale * HEIGHT_M, "moon", scale * RADIUS_M, 0)}
    wanted = [each._replace(seed=seed) for each in gravities.values() for seed in beds]
    heights = [Slope(h, "earth", RADIUS_M * h / HEIGHT_M, seed) for h in HEIGHTS_M if h != HEIGHT_M for seed in beds]
    coarse = [Slope(HEIGHT_M, "earth", k * RADIUS_M, seed) for k in COARSENESS if k != 1.0 for seed in beds]
    every = [*wanted, *heights, *coarse]
    with ProcessPoolExecutor(2) as pool:
        column = pool.submit(heap, material)
        cuts = dict(zip(every, pool.map(cut, every, [material] * len(every)), strict=True))
        grains, status, within = column.result()
    draw_kappa({each: cuts[each] for each in (*wanted, *heights)}, cohesion, friction)
    draw_heap(grains)

    def angles(**named) -> str:
        return mean_of([c.angle_deg for s, c in cuts.items() if all(getattr(s, key) == value for key, value in named.items())])

    moon = gravities["moon"]
    rows = [f"| {h:g} | {cohesion / cuts[Slope(h, 'earth', RADIUS_M * h / HEIGHT_M, beds[0])].weight_pa:.3f} | "
            f"{angles(height_m=h, gravity='earth', radius_m=RADIUS_M * h / HEIGHT_M)} |" for h in HEIGHTS_M]  # fmt: skip
    grain_rows = [f"| {1e3 * k * RADIUS_M:.3g} | {HEIGHT_M / (k * RADIUS_M):.0f} | "
                  f"{angles(height_m=HEIGHT_M, gravity='earth', radius_m=k * RADIUS_M)} |" for k in COARSENESS]  # fmt: skip
    kappa = cohesion / (PAPER["radius_m"] * 30.0 * 0.6 * 3000.0 * 9.81)
    sigma, static, rolling = (optimum[name] for name in ("adhesive_stress_pa", "static_friction", "rolling_friction"))
    intervals = [f"{optimum[f'{name}_low_95']:.4g} to {optimum[f'{name}_high_95']:.4g}" for name in list(material)[:3]]
    text = TEXT.format(
        height=f"{HEIGHT_M:g}",
        optimum=f"adhesive stress {sigma:.0f} Pa ({intervals[0]}), static friction {static:.3f} ({intervals[1]}),\n"
        f"rolling friction {rolling:.4f} ({intervals[2]}); 95 % intervals in brackets",
        answer="\n".join(answer_table(verification)),
        moon=f"{moon.height_m:.2f} m with grains of {1e3 * moon.radius_m:.0f} mm",
        on_moon=angles(gravity="moon"),
        on_earth=angles(gravity="earth", height_m=HEIGHT_M, radius_m=RADIUS_M),
        beds=len(beds),
        heights="\n".join(rows),
        radii="\n".join(grain_rows),
        kappa=f"{kappa:.0f}",
        status=status,
        within=f"{100 * within:.0f} %",
    )
    PAGE.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
