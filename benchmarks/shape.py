"""What shape buys: heaps and plane shear of clumps without rolling friction, beside spheres with it.

    python benchmarks/shape.py [--processes 2] [--seeds 2] [--tiny]

Writes docs/shape.md and docs/images/shape_*.png. 7 static frictions times 5 aspect ratios of dimers, times tetrahedra, and times 5
rolling frictions of spheres; 3000 grains, the fidelity of a campaign. Finished tests are kept in benchmarks/shape/ and
not run again, unless the engine has changed. --tiny: a few small tests, which show that all works, in place of the study; page and
pictures are then written to benchmarks/shape_tiny/.
"""

import argparse
import itertools
import math
import multiprocessing
import os
import time
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import NamedTuple

import matplotlib as mpl

mpl.use("Agg")

import numpy as np
import pandas as pd
import yaml
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse, Polygon

from dem import SimulationError, compiled
from dem.experiments.angle_of_repose import FLAT_HEIGHT_RATIO
from dem.jit import source_hash
from virtual_soil.campaign.experiments.common import engine_of, soil_of
from virtual_soil.campaign.experiments.plane_shear import declared as plane_shear
from virtual_soil.campaign.experiments.plane_shear import measure as plane_shear_measure
from virtual_soil.campaign.experiments.plane_shear import simulate as plane_shear_job
from virtual_soil.campaign.experiments.repose import declared as repose
from virtual_soil.campaign.experiments.repose import measure as repose_measure
from virtual_soil.campaign.experiments.repose import simulate as repose_job
from virtual_soil.campaign.experiments.shapes import numbers, resolved
from virtual_soil.campaign.grains import grain_table
from virtual_soil.campaign.sections import GRID, Study
from virtual_soil.campaign.settings import defaults
from virtual_soil.report.plots import COLOURS, draw_grains

ROOT = Path(__file__).resolve().parents[1]
#: Soil whose angles are the aim, and its file.
SAND = "silica_barco_sand"
STATIC_FRICTIONS = GRID["static_friction"]
#: Without gravity and cohesion the friction angle does not depend on the stress, if E*/p does not.
STRESS_PA = 500.0
N_SEEDS = 2
#: Seeds of the tests of what comes nearest to the sand, if it is nearer than so many standard uncertainties.
CHECK_SEEDS, NEAR = (101, 102, 103), 2.0
#: Samples of every cell of a grid between its points, along each side.
N_BETWEEN = 20


class Family(NamedTuple):
    """Grains of one shape: keys of `material`, the one that varies beside static friction, its values, and its symbol."""

    name: str
    material: dict
    parameter: str
    values: list[float]
    symbol: str
    colour: str


FAMILIES = {
    family.name: family
    for family in (
        Family("spheres", {}, "rolling_friction", GRID["rolling_friction"], "µr", COLOURS[0]),
        Family("dimers", {"shape": "dimer"}, "aspect_ratio", [1.1, 1.25, 1.5, 1.75, 2.0], "a", COLOURS[1]),
        Family("tetrahedra", {"shape": "tetra"}, "rolling_friction", [0.0], "µr", COLOURS[2]),
    )
}
#: Families of the two heaps that are shown, at this static friction, without rolling friction: spheres and dimers.
PICTURED = {"spheres": 0.0, "dimers": 1.5}
PICTURED_FRICTION = 0.5
TINY = {
    "repose": {"n_particles": 400, "tube_diameter_ratio": 8.0, "plate_half_width_ratio": 40.0},
    "plane_shear": {"length_ratio": 12.0, "height_ratio": 12.0, "width_ratio": 8.0, "shear_strain": 1.0, "max_shear_strain": 4.0},
}


class Test(NamedTuple):
    """One simulation: experiment, family, static friction, the family's parameter, seed."""

    experiment: str
    family: str
    static_friction: float
    parameter: float
    seed: int


def tests(tiny: bool, n_seeds: int) -> list[Test]:
    """All tests, heaps first: they take longest."""
    frictions, seeds = ((0.3, 0.5, 1.3), (1,)) if tiny else (STATIC_FRICTIONS, range(1, n_seeds + 1))
    return [
        Test(experiment, family.name, friction, value, seed)
        for experiment in ("repose", "plane_shear")
        for family in FAMILIES.values()
        for friction, value, seed in itertools.product(frictions, family.values[::2] if tiny else family.values, seeds)
    ]


def config_of(test: Test, tiny: bool) -> dict:
    """Study of a test, as a campaign completes it."""
    config = defaults(Study)
    family = FAMILIES[test.family]
    config["material"] |= {"rolling_friction": 0.0, **family.material, "static_friction": test.static_friction}
    config["material"][family.parameter] = test.parameter
    for section, values in TINY.items() if tiny else ():
        config[section] |= values
    config["shape"] = resolved(config)
    config["material"] = numbers(config["material"])
    return config


def measured(test: Test, tiny: bool, folder: Path) -> dict:
    """Run a test; returns its row."""
    config, began = config_of(test, tiny), time.perf_counter()
    row = {**config["material"], "experiment": test.experiment, "fidelity": "campaign", plane_shear.LOAD: STRESS_PA}
    found: dict = {}
    try:
        if test.experiment == "repose":
            found = heap(test, row, repose.setup(config, row), config["repose"], folder)
        else:
            found = shear(test, row, plane_shear.setup(config, row))
    except (SimulationError, ValueError) as error:
        found = {"status": "failed", "reason": str(error)}
    return {**test._asdict(), **found, "wall_time_s": time.perf_counter() - began, "engine": source_hash()}


def heap(test: Test, row: dict, settings: dict, section: dict, folder: Path) -> dict:
    """Make a heap; its grains are kept if it is shown."""
    soil = soil_of(row, settings)
    made = repose_job.run(soil, settings["setup"], engine_of(settings), test.seed)
    table = pd.DataFrame(grain_table(made.grains, "", soil))
    if PICTURED.get(test.family) == test.parameter and (test.static_friction, test.seed) == (PICTURED_FRICTION, 1):
        table.to_parquet(folder / f"{test.family}.parquet")
    found = repose_measure.measured(repose_job.row_of(made, settings), table, section)
    names = ("status", "n_particles", "angle_of_repose_deg", "angle_bound_deg", "angle_profile_deg", "max_overlap_ratio")
    return {name: found[name] for name in names}


def shear(test: Test, row: dict, settings: dict) -> dict:
    """Shear a bed."""
    made = plane_shear_job.run(soil_of(row, settings), settings["setup"], engine_of(settings), test.seed)
    found = plane_shear_measure.measured(plane_shear_job.row_of(made, settings), pd.DataFrame(made.history), {})
    ratio = found["steady_shear_stress_pa"] / found["steady_normal_stress_pa"]
    angle = {"friction_angle_deg": math.degrees(math.atan(ratio)), "friction_angle_se_deg": found["steady_stress_ratio_se"]}
    angle["friction_angle_se_deg"] *= math.degrees(1.0) / (1.0 + ratio**2)
    names = ("status", "n_particles", "steady_solid_fraction", "max_overlap_ratio")
    return {name: found[name] for name in names} | angle


def run_all(wanted: list[Test], tiny: bool, folder: Path, processes: int) -> pd.DataFrame:
    """Rows of all tests; those of the file of this engine are not run again."""
    file = folder / "rows.parquet"
    rows = pd.read_parquet(file).to_dict("records") if file.is_file() else []
    kept = [row for row in rows if row["engine"] == source_hash()]
    if len(kept) < len(rows):
        print(f"{len(rows) - len(kept)} tests of {file} are of another engine and run again")
    done = {Test(*(row[name] for name in Test._fields)) for row in kept}
    missing = [test for test in wanted if test not in done]
    print(f"{len(wanted) - len(missing)} tests are there, {len(missing)} to be run", flush=True)
    for clumps in (False, True) if missing else ():
        compiled.ensure(clumps=clumps)
    began = time.perf_counter()
    with ProcessPoolExecutor(processes, mp_context=multiprocessing.get_context("spawn")) as pool:
        jobs = {pool.submit(measured, test, tiny, folder): test for test in missing}
        for number, job in enumerate(as_completed(jobs), 1):
            kept.append(job.result())
            part = file.with_suffix(".part")
            pd.DataFrame(kept).to_parquet(part)
            os.replace(part, file)
            print(f"{number} of {len(missing)}, {time.perf_counter() - began:.0f} s: {jobs[job]}", flush=True)
    table = pd.DataFrame(kept)
    return table[[Test(*values) in set(wanted) for values in table[[*Test._fields]].itertuples(index=False)]]


def points_of(rows: pd.DataFrame) -> pd.DataFrame:
    """Row of every point: means over the seeds that count, their standard errors, and number of heaps without an angle."""
    found = []
    for (family, friction, parameter), here in rows.groupby(["family", "static_friction", "parameter"]):
        heaps, sheared = (here[here["experiment"] == name] for name in ("repose", "plane_shear"))
        heaps, sheared = heaps[heaps["status"].isin(repose.SOUND)], sheared[sheared["status"].isin(plane_shear.SOUND)]
        point = {
            "family": family,
            "static_friction": friction,
            "parameter": parameter,
            "n_heaps": len(heaps),
            "n_beds": len(sheared),
        }
        for name, values in (("A", heaps["angle_of_repose_deg"]), ("phi", sheared["friction_angle_deg"])):
            point |= {name: values.mean(), f"{name}_se": values.std(ddof=1) / max(len(values), 1) ** 0.5}
        point["solid_fraction"] = sheared["steady_solid_fraction"].mean()
        found.append({**point, "flat": bool((heaps["status"] == "flat").any())})
    return pd.DataFrame(found)


class Sand(NamedTuple):
    """Angles of the sand in degrees, and their standard uncertainties."""

    A: float
    phi: float
    A_se: float
    phi_se: float


def sand() -> Sand:
    """The aim, with the uncertainties of a study's targets."""
    soil = yaml.safe_load((ROOT / "config" / "soils" / f"{SAND}.yaml").read_text(encoding="utf-8"))
    A, phi = soil["angle_of_repose_deg"]["value"], soil["steady_friction_angle_deg"]["value"]
    share = defaults(Study)["uncertainty"]["target_uncertainty_ratio"]
    return Sand(A, phi, share * A, share * phi)


def grid_of(points: pd.DataFrame, family: Family) -> tuple[np.ndarray, ...]:
    """Static frictions (n,), parameters (m,), and A and phi (n, m) in degrees, of a family; NaN where there is none."""
    here = points[points["family"] == family.name]
    tables = [here.pivot(index="static_friction", columns="parameter", values=name) for name in ("A", "phi")]
    return tables[0].index.to_numpy(), tables[0].columns.to_numpy(), *(table.to_numpy() for table in tables)


def between(values: np.ndarray) -> np.ndarray:
    """Values (n,) or (n, m) with N_BETWEEN - 1 linear ones between neighbours along every axis of more than one."""
    for axis in range(values.ndim):
        n = values.shape[axis]
        fine = np.linspace(0, n - 1, (n - 1) * N_BETWEEN + 1)
        values = np.apply_along_axis(lambda line, n=n, fine=fine: np.interp(fine, np.arange(n), line), axis, values)
    return values


def nearest(points: pd.DataFrame, family: Family, aim: Sand) -> dict | None:
    """Values of a family that come nearest to the sand, interpolated between its points; distance in standard uncertainties.

    None if no point has both angles.
    """
    frictions, parameters, A, phi = (between(values) for values in grid_of(points, family))
    distance = np.hypot((A - aim.A) / aim.A_se, (phi - aim.phi) / aim.phi_se)
    if np.isnan(distance).all():
        return None
    i, j = np.unravel_index(np.nanargmin(distance), distance.shape)
    return {"static_friction": frictions[i], "parameter": parameters[j], "A": A[i, j], "phi": phi[i, j], "distance": distance[i, j]}


def checks(points: pd.DataFrame, aim: Sand) -> list[Test]:
    """Tests, with seeds of their own, of the families' values that come near the sand."""
    found = {name: nearest(points, family, aim) for name, family in FAMILIES.items()}
    return [
        Test(experiment, name, round(float(best["static_friction"]), 2), round(float(best["parameter"]), 2), seed)
        for name, best in found.items()
        if best is not None and best["distance"] < NEAR
        for experiment in ("repose", "plane_shear")
        for seed in CHECK_SEEDS
    ]


def plane_figure(points: pd.DataFrame, aim: Sand) -> Figure:
    """Angle of repose over friction angle: regions of the families, and the sand with one and two standard uncertainties."""
    figure = Figure(figsize=(8.0, 6.0), layout="constrained")
    axes = figure.subplots()
    for family in FAMILIES.values():
        _, parameters, A, phi = grid_of(points, family)
        for i, j in itertools.product(range(A.shape[0] - 1), range(A.shape[1] - 1)):
            corners = [(phi[p, q], A[p, q]) for p, q in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1))]
            if np.isfinite(corners).all():
                axes.add_patch(Polygon(corners, facecolor=family.colour, alpha=0.18, linewidth=0))
        for j, parameter in enumerate(parameters):
            axes.plot(phi[:, j], A[:, j], color=family.colour, linewidth=0.8)
            there = np.flatnonzero(np.isfinite(phi[:, j] + A[:, j]))
            if len(there) and len(parameters) > 1:
                at = (phi[there[-1], j], A[there[-1], j])
                text = f"{family.symbol} {parameter:g}"
                axes.annotate(text, at, (4, -3), textcoords="offset points", fontsize=7, color=family.colour)
        here = points[points["family"] == family.name]
        for flat, fill in ((False, family.colour), (True, "white")):
            some = here[here["flat"] == flat]
            axes.errorbar(
                some["phi"], some["A"], some["A_se"], some["phi_se"], fmt="o", markersize=4, color=family.colour,
                markerfacecolor=fill, elinewidth=0.7, label=None if flat else label_of(family),
            )  # fmt: skip
    axes.plot(aim.phi, aim.A, "k*", markersize=12, label="silica sand, with 1 and 2 standard uncertainties")
    for factor in (2.0, 4.0):
        axes.add_patch(Ellipse((aim.phi, aim.A), factor * aim.phi_se, factor * aim.A_se, fill=False, linewidth=1.0))
    axes.set(xlabel="steady friction angle φ (°), plane shear", ylabel="angle of repose A (°), lifted tube; hollow: no slope")
    axes.set(xlim=(0.0, None), ylim=(0.0, None))
    axes.legend(loc="upper left", fontsize=8)
    return figure


def label_of(family: Family) -> str:
    """Label of a family in the figure's legend."""
    if family.parameter == "aspect_ratio":
        return f"{family.name} of aspect ratio a, without rolling friction"
    return f"{family.name} with rolling friction µr" if any(family.values) else f"{family.name} without rolling friction"


def heap_figure(folder: Path, rows: pd.DataFrame) -> Figure:
    """The two heaps of PICTURED at one scale; a clump's spheres share a colour."""
    figure = Figure(figsize=(8.0, 5.0), layout="constrained")
    panels = figure.subplots(2, 1, sharex=True, sharey=True)
    for axes, (name, parameter) in zip(panels, PICTURED.items(), strict=True):
        grains = pd.read_parquet(folder / f"{name}.parquet")
        number = grains["clump"] if "clump" in grains else pd.Series(np.arange(len(grains)))
        draw_grains(axes, grains, np.random.default_rng(1).permutation(number.max() + 1)[number])
        same = (rows["experiment"] == "repose") & (rows["family"] == name) & (rows["parameter"] == parameter)
        same &= (rows["static_friction"] == PICTURED_FRICTION) & (rows["seed"] == 1)
        (run,) = rows[same].to_dict("records")
        slope = f"{run['angle_of_repose_deg']:.1f}°" if run["status"] == "static" else f"{run['status'].replace('_', ' ')}"
        shape = f", aspect ratio {parameter:g}" if name == "dimers" else ""
        axes.set_title(f"{number.nunique()} {name}{shape}, µs {PICTURED_FRICTION:g}, µr 0: {slope}", fontsize=9)
        axes.axhline(0.0, color="black", linewidth=0.8)
    reach = 1e3 * 40.0 * defaults(Study)["material"]["radius_m"]
    panels[0].set(xlim=(-reach, reach), ylim=(-0.02 * reach, 0.5 * reach))
    return figure


HEAD = """# What shape buys

{answer}

Written by `python benchmarks/shape.py`: {n} tests, {minutes:.0f} core-minutes. Heaps of {n_grains} grains in the lifted tube of the
default study, and plane shear under {stress:g} Pa, at the fidelity of a campaign; number of seeds of each: {seeds}. Clumps have no
rolling friction. Sizes are those of spheres of equal volume. A: angle of repose; φ: steady friction angle, the arc tangent of the
stress ratio. Errors are those of the mean over seeds. No slope: a heap lower than {flat:g} grain diameters; A is then the middle of
what is possible.

![Angle of repose over friction angle](images/shape_plane.png)

Shaded: what a family reaches between its points. The sand of the paper (A {sand.A:g}°, φ {sand.phi:g}°) has the standard
uncertainties of the studies' targets, {sand.A_se:.2g}° and {sand.phi_se:.2g}°.

![A heap of spheres and one of dimers](images/shape_heaps.png)

## Nearest to the sand

Interpolated between the points; distance in standard uncertainties of the sand's two angles. What is nearer than {near:g} was
simulated there with {n_checks} other seeds.

| | µs | µr or aspect ratio | A (°) | φ (°) | distance | A simulated (°) | φ simulated (°) |
|---|---|---|---|---|---|---|---|
"""


def answer(checked: pd.DataFrame, aim: Sand) -> str:
    """Which families meet both angles of the sand within their standard uncertainties, by what was simulated; checked : points."""
    texts = []
    for point in checked.to_dict("records"):
        off = (abs(point["A"] - aim.A) / aim.A_se, abs(point["phi"] - aim.phi) / aim.phi_se)
        verb = "meet" if max(off) <= 1.0 else "miss"
        family = FAMILIES[point["family"]]
        texts.append(
            f"{family.name.capitalize()} (µs {point['static_friction']:g}, {family.symbol} {point['parameter']:g}) {verb} both "
            f"angles of the sand: {off[0]:.1f} and {off[1]:.1f} standard uncertainties off."
        )
    return " ".join(texts).replace("miss both", "do not meet both") or "No family comes near the sand."


def row_of(*cells: str) -> str:
    """Line of a table."""
    return f"| {' | '.join(cells)} |\n"


def nearest_row(points: pd.DataFrame, checked: pd.DataFrame, family: Family, aim: Sand) -> str:
    """Line of the table of what comes nearest to the sand; checked : what was simulated there."""
    best = nearest(points, family, aim)
    if best is None:
        return row_of(family.name, *["–"] * 7)
    simulated = ["–"] * 2
    for point in checked[checked["family"] == family.name].to_dict("records") if len(checked) else ():
        simulated = [f"{point[name]:.1f} ± {point[f'{name}_se']:.1f}" for name in ("A", "phi")]
    digits = {"static_friction": ".2f", "parameter": ".3g", "A": ".1f", "phi": ".1f", "distance": ".1f"}
    friction, parameter, *others = (format(best[name], digit) for name, digit in digits.items())
    return row_of(family.name, friction, f"{family.symbol} {parameter}", *others, *simulated)


def point_row(point: pd.Series) -> str:
    """Line of a point."""
    A, phi = (
        f"{point[name]:.1f} ± {point[f'{name}_se']:.1f}" if point[n] else "–" for name, n in (("A", "n_heaps"), ("phi", "n_beds"))
    )
    A = f"no slope ({A})" if point["flat"] else A
    return row_of(f"{point['static_friction']:g}", f"{point['parameter']:g}", A, phi, f"{point['solid_fraction']:.3f}")


def page(rows: pd.DataFrame, points: pd.DataFrame, checked: pd.DataFrame, aim: Sand) -> str:
    """Text of the page; checked : as `nearest_row`."""
    n_grains = int(rows.loc[rows["experiment"] == "repose", "n_particles"].max())
    text = HEAD.format(
        n=len(rows), minutes=rows["wall_time_s"].sum() / 60.0, n_grains=n_grains, stress=STRESS_PA, seeds=rows["seed"].nunique(),
        flat=FLAT_HEIGHT_RATIO, sand=aim, answer=answer(checked, aim), near=NEAR, n_checks=len(CHECK_SEEDS),
    )  # fmt: skip
    text += "".join(nearest_row(points, checked, family, aim) for family in FAMILIES.values())
    for family in FAMILIES.values():
        text += f"\n## {family.name.capitalize()}\n\n" + row_of(
            "µs", family.symbol, "A (°)", "φ (°)", "solid fraction when sheared"
        )
        text += row_of(*["---"] * 5)
        text += "".join(point_row(point) for _, point in points[points["family"] == family.name].iterrows())
    bad = rows[~rows["status"].isin({*repose.SOUND, *plane_shear.SOUND})]
    if len(bad):
        text += f"\n{len(bad)} tests count nowhere: {', '.join(f'{n} {s}' for s, n in bad['status'].value_counts().items())}.\n"
    return text.replace(" ± nan", "").replace("| nan |", "| – |")


def main() -> None:
    """Run what is missing, then write the page and its pictures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--processes", type=int, default=2, help="tests at a time")
    parser.add_argument("--seeds", type=int, default=N_SEEDS, help="seeds of each point")
    parser.add_argument("--tiny", action="store_true", help="a few small tests, to see that all works")
    options = parser.parse_args()
    folder = ROOT / "benchmarks" / ("shape_tiny" if options.tiny else "shape")
    docs = folder if options.tiny else ROOT / "docs"
    (docs / "images").mkdir(parents=True, exist_ok=True)
    folder.mkdir(exist_ok=True)
    rows = run_all(tests(options.tiny, options.seeds), options.tiny, folder, options.processes)
    points, aim = points_of(rows), sand()
    checked = points_of(run_all(checks(points, aim), options.tiny, folder, options.processes))
    plane_figure(points, aim).savefig(docs / "images" / "shape_plane.png", dpi=130)
    heap_figure(folder, rows).savefig(docs / "images" / "shape_heaps.png", dpi=130)
    (docs / "shape.md").write_text(page(rows, points, checked, aim), encoding="utf-8")


if __name__ == "__main__":
    main()
