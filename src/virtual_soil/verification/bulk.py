"""Heaps, shear tests and packings over several seeds: influence of settings, changed one at a time.

Bulk runs are chaotic, so only means over seeds are compared. A difference expected to be zero may be at most SCATTER standard
errors of the difference, estimated with the scatter pooled over all variants of the heap. The page states both, so that a reader
sees the smallest detectable difference.
"""

from collections import deque
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
from scipy.spatial import cKDTree

from dem import Box, Factory, Interaction, Simulation, Sizes, Tube, TubeRegion
from dem.experiments import angle_of_repose, direct_shear, specimen
from dem.experiments.soil import Engine, Soil
from dem.measure.heap import measure_heap
from dem.measure.shear import strength
from virtual_soil.verification.check import Check

GROUP = "Bulk"
#: The paper's base set (Briend et al. 2011, Table 2), its heap and a slice of its shear box.
SOIL = Soil(
    radius_m=50e-6, density_kg_m3=3000.0, poisson_ratio=0.2, shear_modulus_pa=5e7, static_friction=0.3, rolling_friction=0.1,
    restitution=0.5,
)  # fmt: skip
HEAP = angle_of_repose.Setup(
    n_particles=3000, tube_diameter_ratio=15.0, plate_half_width_ratio=80.0, lift_speed_m_s=5e-3, max_time_s=0.7,
    scale_radius_m=SOIL.radius_m,
)  # fmt: skip
BOX = direct_shear.Setup(
    length_ratio=60.0, height_ratio=32.0, width_ratio=5.0, displacement_ratio=9.0, normal_stress_pa=500.0, inertial_number=5e-3,
    frame_static_friction=0.0, preparation_friction_ratio=0.3, scale_radius_m=SOIL.radius_m,
)  # fmt: skip
#: G = 5e5 Pa and the largest step, as in the default campaign.
ENGINE = Engine(stiffness_reduction=100.0, time_step_rayleigh_ratio=0.4)
SHEAR_ENGINE = Engine(time_step_rayleigh_ratio=0.3)
SHEAR_STIFFNESS_NUMBER = 5000.0

#: Variant -> (number of seeds, changes of the soil, of the heap's protocol, of the engine).
HEAPS: dict[str, tuple[int, dict[str, Any], dict[str, Any], dict[str, Any]]] = {
    "base": (8, {}, {}, {}),
    "mu_s 0.1": (4, {"static_friction": 0.1}, {}, {}),
    "mu_s 0.9": (4, {"static_friction": 0.9}, {}, {}),
    "mu_r 0.05": (4, {"rolling_friction": 0.05}, {}, {}),
    "mu_r 0.2": (4, {"rolling_friction": 0.2}, {}, {}),
    "step 0.1 T_R": (6, {}, {}, {"time_step_rayleigh_ratio": 0.1}),
    "step 0.2 T_R": (6, {}, {}, {"time_step_rayleigh_ratio": 0.2}),
    "G 5e6 Pa": (6, {}, {}, {"stiffness_reduction": 10.0}),
    "G 5e7 Pa": (4, {}, {}, {"stiffness_reduction": 1.0}),
    "float64": (6, {}, {}, {"precision": "float64"}),
    "no_pull": (6, {}, {}, {"damping_model": "no_pull"}),
    "type C": (6, {}, {}, {"rolling_model": "type_c"}),
    "lift 1 mm/s": (3, {}, {"lift_speed_m_s": 1e-3, "max_time_s": 3.5}, {}),
    "lift 20 mm/s": (4, {}, {"lift_speed_m_s": 20e-3}, {}),
    "tamped packing": (4, {}, {"preparation_friction_ratio": 0.0}, {}),
    "smooth tube": (4, {}, {"tube_static_friction": 0.0}, {}),
    "rough tube": (4, {}, {"tube_static_friction": 1.0}, {}),
}
#: Variants that must not change the angle relative to the base.
INSENSITIVE = ("step 0.1 T_R", "step 0.2 T_R", "G 5e6 Pa", "G 5e7 Pa", "float64", "no_pull")
#: Variants that show the influence of the protocol.
PROTOCOL = ("base", "lift 1 mm/s", "lift 20 mm/s", "tamped packing", "smooth tube", "rough tube")
STRESSES_PA = (125.0, 250.0, 500.0, 1000.0)
SHEAR_SEEDS = 4
PACKINGS = {"smooth": 0.0, "rough": 0.5}
PACKING_SEEDS = 4
#: Margins in radii of a packing: at its tube, and at its floor and surface. The tube orders the grains next to it. In seven
#: frictionless packings the ring 6 to 8 radii from it had solid fractions of 0.641 to 0.649, on average 0.646; further in 0.639.
TUBE_MARGIN_RATIO, END_MARGIN_RATIO = 8.0, 6.0
#: Last fraction of the displacement, over which the plateau is averaged, as in the campaign.
PLATEAU = 0.3
#: Columns of the table of runs.
COLUMNS = [
    *("run", "kind", "variant", "seed", "status"),
    *("angle_of_repose_deg", "silhouette_deg", "drift_mean_radii", "drift_largest_radii", "drift_deg"),
    *("plateau_shear_stress_pa", "plane_normal_stress_pa", "friction", "friction_change", "solid_fraction"),
]
#: Observation time of a heap at rest (s).
WATCH_S = 0.1
#: Tolerance, in standard errors, of differences expected to be zero: with a dozen of them, 1 in 30 pages has one outside.
SCATTER = 3.0


def runs() -> list[str]:
    """Names of all runs, variant and seed: "heap/base/1"."""
    heaps = [f"heap/{variant}/{seed}" for variant, (n, *_) in HEAPS.items() for seed in range(1, n + 1)]
    shear = [f"shear/{stress:g} Pa/{seed}" for stress in STRESSES_PA for seed in range(1, SHEAR_SEEDS + 1)]
    return heaps + shear + [f"packing/{name}/{seed}" for name in PACKINGS for seed in range(1, PACKING_SEEDS + 1)]


def run(name: str) -> dict:
    """Execute one run and return its row of the table, with NaN for quantities of other kinds."""
    kind, variant, seed = parts_of(name)
    row = {"run": name, "kind": kind, "variant": variant, "seed": seed}
    return row | {"heap": run_heap, "shear": run_shear, "packing": run_packing}[kind](variant, seed)


def parts_of(name: str) -> tuple[str, str, int]:
    """Split a run's name into kind, variant and seed; a variant may contain a slash ("lift 1 mm/s")."""
    kind, rest = name.split("/", 1)
    variant, seed = rest.rsplit("/", 1)
    return kind, variant, int(seed)


def run_heap(variant: str, seed: int) -> dict:
    """Simulate a heap: angle by both estimators, and drift during the observation at rest (in radii, degrees)."""
    _, soil, setup, engine = HEAPS[variant]
    setting = replace(SOIL, **soil), replace(HEAP, **setup), replace(ENGINE, **engine)
    looks: deque[Simulation] = deque(maxlen=1)  # the simulation, for use after the test
    heap = angle_of_repose.run(*setting, seed, each=lambda simulation, _: looks.append(simulation))
    looks[0].run(WATCH_S)
    before, after = heap.grains, looks[0].grains
    shape, later = (measure_heap(grains.positions_m, grains.radii_m) for grains in (before, after))
    moved = np.array([np.inf])  # some grains have left the plate
    if len(after) == len(before):
        moved = np.linalg.norm(after.positions_m - before.positions_m, axis=1) / SOIL.radius_m
    return {
        "status": heap.status,
        "angle_of_repose_deg": shape.angle_profile_deg,
        "silhouette_deg": shape.angle_silhouette_deg,
        "drift_mean_radii": float(moved.mean()),
        "drift_largest_radii": float(moved.max()),
        "drift_deg": later.angle_profile_deg - shape.angle_profile_deg,
    }


def run_shear(variant: str, seed: int) -> dict:
    """Simulate a shear test: plateau, and its change from the third to the last quarter of the displacement."""
    setup = replace(BOX, normal_stress_pa=float(variant.split()[0]))
    reduction = specimen.stiffness_reduction(SOIL, setup, SHEAR_STIFFNESS_NUMBER, SHEAR_ENGINE.gravity_m_s2)
    test = direct_shear.run(SOIL, setup, replace(SHEAR_ENGINE, stiffness_reduction=reduction), seed)
    history = test.history
    read = strength(history["displacement_m"], history["shear_stress_pa"], history["plane_normal_stress_pa"], PLATEAU)
    friction = history["shear_stress_pa"] / history["plane_normal_stress_pa"]
    quarter = len(friction) // 4
    return {
        "status": "sheared",
        "plateau_shear_stress_pa": read.plateau_shear_stress_pa,
        "plane_normal_stress_pa": read.plane_normal_stress_pa,
        "friction_change": float(friction[-quarter:].mean() - friction[-2 * quarter : -quarter].mean()),
        "friction": float(friction[-2 * quarter :].mean()),
    }


def run_packing(variant: str, seed: int) -> dict:
    """Solid fraction of grains poured into a cylinder, without the margins at wall, floor and surface."""
    mu, radius = PACKINGS[variant], 1e-3
    tube = 16 * radius
    steel = SOIL.softened(1.0)
    touch = Interaction(restitution=0.5, static_friction=mu, rolling_friction=0.0)
    simulation = Simulation(
        materials={"glass": steel}, interactions={("glass", "glass"): touch}, smallest_radius_m=0.9 * radius,
        walls=[
            Box(name="floor", material="glass", low_m=(-1.0, -1.0, 0.0), high_m=(1.0, 1.0, 0.0)),
            Tube(name="tube", material="glass", radius_m=tube, bottom_m=0.0, top_m=10.0),
        ],
    )  # fmt: skip
    sizes = Sizes(mean_m=radius, sd_ratio=0.05)  # a small spread of the radii prevents crystallisation
    region = TubeRegion(radius_m=tube, bottom_m=0.0)
    simulation.add_factory(Factory(n_grains=4000, region=region, sizes=sizes, material="glass", seed=seed))
    simulation.run(3.0, until=lambda s: s.is_static(1e-6))
    core = solid_fraction(simulation.grains, tube - TUBE_MARGIN_RATIO * radius, END_MARGIN_RATIO * radius)
    return {"status": "poured", "solid_fraction": core}


def solid_fraction(grains, within_m: float, margin_m: float) -> float:
    """Volume fraction in a cylinder about the z axis, margin_m away from floor and surface.

    Estimated by Monte Carlo sampling: two million points give a standard error of 0.0004.
    """
    rng = np.random.default_rng(1)
    top = float(np.quantile(grains.positions_m[:, 2], 0.95)) - margin_m
    points = rng.uniform((-within_m, -within_m, margin_m), (within_m, within_m, top), (2_000_000, 3))
    points = points[np.hypot(*points[:, :2].T) < within_m]
    distance, nearest = cKDTree(grains.positions_m).query(points, k=4)
    return float((distance < grains.radii_m[nearest]).any(axis=1).mean())


def checks(table: pd.DataFrame) -> list[Check]:
    """Return the checks on the table of all runs."""
    heaps = table[table["kind"] == "heap"]
    return [*of_angles(heaps), *of_drift(heaps), *of_shear(table[table["kind"] == "shear"]), *of_packing(table)]


def angles(heaps: pd.DataFrame, variant: str) -> np.ndarray:
    """Angles in degrees of all seeds of a variant."""
    return heaps.loc[heaps["variant"] == variant, "angle_of_repose_deg"].to_numpy()


def pooled_sd(heaps: pd.DataFrame) -> float:
    """Standard deviation of the angle over seeds, pooled over the variants, in degrees."""
    groups = [group - group.mean() for _, group in heaps.groupby("variant")["angle_of_repose_deg"]]
    return float(np.sqrt(sum((group**2).sum() for group in groups) / sum(len(group) - 1 for group in groups)))


def of_angles(heaps: pd.DataFrame) -> Iterable[Check]:
    """Yield checks of the settings that change the angle and of those that must not."""
    sd, base = pooled_sd(heaps), angles(heaps, "base")

    def difference(a, b):
        one, other = angles(heaps, a), angles(heaps, b)
        return one.mean() - other.mean(), sd * np.sqrt(1 / len(one) + 1 / len(other))

    common: dict[str, Any] = {"group": GROUP, "unit": "deg"}
    scatter = f"standard deviation over seeds {sd:.2f} deg, pooled over the variants"
    yield Check(
        **common, case="heap of the paper's base set", quantity="angle of repose", source="Briend et al. 2011, Table 2",
        expected=27.47, obtained=base.mean(), tolerance=SCATTER * sd * np.sqrt(1 + 1 / len(base)),
        note=f"{len(base)} seeds of ours, one of theirs; {scatter}",
    )  # fmt: skip
    for lower, upper in (("mu_s 0.1", "base"), ("mu_r 0.05", "base"), ("base", "mu_r 0.2")):
        obtained, error = difference(upper, lower)
        yield Check(
            **common, case=f"heap, {lower} to {upper}", quantity="rise of the angle", source="Briend et al. 2011, Figure 5",
            expected=SCATTER * error, obtained=obtained, relation="at least", note="the bound is three standard errors",
        )  # fmt: skip
    obtained, error = difference("mu_s 0.9", "base")
    yield Check(
        **common, case="heap, base to mu_s 0.9", quantity="rise of the angle", source="Briend et al. 2011, Figure 5",
        expected=0.0, obtained=obtained, tolerance=SCATTER * error, relation="at least", note="saturates: it must not fall",
    )  # fmt: skip
    for variant in INSENSITIVE:
        obtained, error = difference(variant, "base")
        yield Check(
            **common, case=f"heap, {variant} against the base", quantity="change of the angle", source="no effect expected",
            expected=0.0, obtained=obtained, tolerance=SCATTER * error, note=f"standard error {error:.2f} deg",
        )  # fmt: skip


def of_drift(heaps: pd.DataFrame) -> Iterable[Check]:
    """Yield checks that heaps at rest remain at rest, with both rolling models."""
    for variant, name in (("base", "type A"), ("type C", "type C")):
        rows = heaps[heaps["variant"] == variant]
        for quantity, column, unit, bound in (
            ("mean displacement", "drift_mean_radii", "radii", 1e-3),
            ("change of the angle", "drift_deg", "deg", 0.1),
        ):
            yield Check(
                group=GROUP, case=f"settled heap watched for {WATCH_S} s, {name}", quantity=quantity, unit=unit,
                source="a heap at rest", expected=bound, obtained=float(rows[column].abs().max()), relation="at most",
                note=f"largest of {len(rows)} seeds",
            )  # fmt: skip


def of_shear(tests: pd.DataFrame) -> Iterable[Check]:
    """Yield checks of the plateau and of the linearity of strength in the normal stress."""
    means = tests.groupby("variant")[["plane_normal_stress_pa", "plateau_shear_stress_pa"]].mean()
    r = np.corrcoef(means.to_numpy().T)[0, 1]
    common: dict[str, Any] = {"group": GROUP, "unit": "-"}
    yield Check(
        **common, case="direct shear at four normal stresses", quantity="R2 of the strength line", source="Mohr-Coulomb",
        expected=0.99, obtained=float(r * r), relation="at least", note=f"means of {SHEAR_SEEDS} seeds at each stress",
    )  # fmt: skip
    change = tests["friction_change"].to_numpy()
    error = change.std(ddof=1) / np.sqrt(len(change))
    yield Check(
        **common, case="direct shear, third to last quarter of the displacement", quantity="change of tau / sigma",
        source="a plateau", expected=0.0, obtained=float(change.mean()), tolerance=float(SCATTER * error),
        note=f"mean of {len(change)} tests; tau / sigma is {tests['friction'].mean():.2f}",
    )  # fmt: skip


def of_packing(table: pd.DataFrame) -> Iterable[Check]:
    """Yield checks of the solid fractions of poured grains, means over seeds: the scatter of single packings is 0.002."""
    fractions = table[table["kind"] == "packing"].groupby("variant")["solid_fraction"]
    fraction, error = fractions.mean(), fractions.sem()
    common: dict[str, Any] = {"group": GROUP, "unit": "-", "quantity": "solid fraction"}
    yield Check(
        **common, case="poured without friction", source="random packings of spheres", expected=0.62, obtained=fraction["smooth"],
        tolerance=0.02,
        note=f"allowed: 0.60 to 0.64; {TUBE_MARGIN_RATIO:g} radii from the tube; mean of {PACKING_SEEDS} seeds, "
        f"standard error {error['smooth']:.4f}",
    )  # fmt: skip
    yield Check(
        **common, case="poured with mu_s 0.5", source="friction holds pores open", expected=fraction["smooth"],
        obtained=fraction["rough"], relation="at most",
    )  # fmt: skip
