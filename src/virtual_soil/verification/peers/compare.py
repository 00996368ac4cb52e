"""Tests that are run in both programs, and criteria of their agreement.

For equal definitions (type C and epsd2) the two means must agree within two standard errors of their difference,
sqrt(s1^2/n1 + s2^2/n2). Heaps and shear bands are chaotic, so only means over seeds are compared; equal programs satisfy the bound
with a probability of 95 %. For different definitions (type A) the difference itself is the result.
"""

import math
import tempfile
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path

import pandas as pd

from dem.experiments import angle_of_repose, direct_shear, specimen
from dem.experiments.soil import Engine, Soil
from dem.measure.heap import measure_heap
from dem.measure.shear import strength
from virtual_soil.verification.check import Check
from virtual_soil.verification.peers import contact, heap, liggghts, shear

GROUP = "Beside LIGGGHTS"
SOURCE = "LIGGGHTS-PUBLIC 3.8.0"
PEER = "liggghts"
SEEDS = range(1, 9)
#: The second rolling friction is twice the first: epsd2 with the second has the torque of type A with the first.
STATIC_FRICTION, ROLLING_FRICTIONS = 0.5, (0.15, 0.3)

#: The paper's base set, with frictions that give a heap high enough to measure its flank.
SOIL = Soil(
    radius_m=50e-6,
    density_kg_m3=3000.0,
    poisson_ratio=0.2,
    shear_modulus_pa=5e7,
    static_friction=STATIC_FRICTION,
    rolling_friction=ROLLING_FRICTIONS[0],
    restitution=0.5,
)
HEAP = angle_of_repose.Setup(
    n_particles=800,
    tube_diameter_ratio=10.0,
    plate_half_width_ratio=60.0,
    lift_speed_m_s=5e-3,
    max_time_s=0.3,
    scale_radius_m=SOIL.radius_m,
)
#: G = 2.5 MPa: a fifth above the minimum stiffness that LIGGGHTS allows.
HEAP_ENGINE = Engine(stiffness_reduction=20.0, time_step_rayleigh_ratio=0.4)
SHEAR = direct_shear.Setup(
    length_ratio=60.0,
    height_ratio=32.0,
    width_ratio=5.0,
    displacement_ratio=9.0,
    normal_stress_pa=1000.0,
    inertial_number=5e-3,
    frame_static_friction=0.0,
    preparation_friction_ratio=0.3,
    scale_radius_m=SOIL.radius_m,
)
#: E*/p as in config/config.yaml.
SHEAR_ENGINE = Engine(
    stiffness_reduction=specimen.stiffness_reduction(SOIL, SHEAR, stiffness_number=5000.0, gravity_m_s2=9.81),
    time_step_rayleigh_ratio=0.3,
)
PLATEAU_WINDOW = 0.5

UNITS = {"angle of repose": "deg", "filled height": "grain radii", "shear strength": "-", "radius in the rolling torque": "r"}


def heap_values(model: str, soil: Soil, seed: int, folder: Path) -> dict[str, float | str]:
    """Simulate a heap: angle of repose in degrees, and mean height of the grains in the filled tube in grain radii."""
    if model == PEER:
        made = heap.run(folder, soil, HEAP, HEAP_ENGINE, seed)
    else:
        made = angle_of_repose.run(soil, HEAP, replace(HEAP_ENGINE, rolling_model=model), seed)
    shape = measure_heap(made.grains.positions_m, made.grains.radii_m)
    filled = float(made.filled.positions_m[:, 2].mean()) / soil.radius_m
    return {"angle of repose": shape.angle_profile_deg, "filled height": filled, "status": made.status}


def shear_values(model: str, soil: Soil, seed: int, folder: Path) -> dict[str, float | str]:
    """Plateau shear stress over normal stress on the shear plane. LIGGGHTS shears the specimen consolidated with type C."""
    engine = replace(SHEAR_ENGINE, rolling_model="type_c" if model == PEER else model)
    ours = direct_shear.run(soil, SHEAR, engine, seed)
    history = ours.history
    if model == PEER:
        dt = direct_shear.build(soil, SHEAR, engine, seed).time_step_s
        history = shear.run(folder, soil, SHEAR, engine, ours, dt)
    stresses = history["shear_stress_pa"], history["plane_normal_stress_pa"]
    plateau = strength(history["displacement_m"], *stresses, plateau_window=PLATEAU_WINDOW)
    return {"shear strength": plateau.plateau_shear_stress_pa / plateau.plane_normal_stress_pa, "status": "sheared"}


def contact_values(model: str, sense: str, folder: Path) -> dict[str, float | str]:
    """Lever arm of the rolling torque over the grain radius."""
    speed = contact.SENSES[sense]
    ratio = contact.peers(folder, speed) if model == PEER else contact.ours(model, speed)
    return {"radius in the rolling torque": ratio, "status": sense}


def jobs(seeds) -> list[tuple]:
    """Return (test, model, rolling friction, seed or sense) of every run, the longest first."""
    models = (PEER, "type_c", "type_a")
    tests = [
        (test, model, mu_r, seed) for test in ("heap", "shear") for model in models for mu_r in ROLLING_FRICTIONS for seed in seeds
    ]
    return tests + [("contact", model, contact.ROLLING_FRICTION, sense) for model in models for sense in contact.SENSES]


def run_job(job: tuple) -> list[dict]:
    """Execute one run and return its rows: test, model, rolling_friction, seed, quantity, value, unit, status."""
    test, model, mu_r, seed = job
    with tempfile.TemporaryDirectory(prefix="peers-") as name:
        folder = Path(name)
        if test == "contact":
            values = contact_values(model, seed, folder)
        else:
            soil = replace(SOIL, rolling_friction=mu_r)
            values = {"heap": heap_values, "shear": shear_values}[test](model, soil, seed, folder)
    status = values.pop("status")
    row = {"test": test, "model": model, "rolling_friction": mu_r, "seed": 0 if test == "contact" else seed}
    return [row | {"quantity": q, "value": v, "unit": UNITS[q], "status": status} for q, v in values.items()]


def run_all(seeds=SEEDS, cores: int = 2) -> pd.DataFrame:
    """Execute all runs; returns one row per run and quantity."""
    liggghts.require_installed()
    # Each process must load the kernels, not compile them: fresh and cached machine code may round differently.
    context = get_context("spawn")
    with ProcessPoolExecutor(1, context) as pool:
        pool.submit(warm_up).result()
    with ProcessPoolExecutor(cores, context) as pool:
        return pd.DataFrame([row for rows in pool.map(run_job, jobs(seeds)) for row in rows])


def warm_up() -> None:
    """Compile the kernels for the runs."""
    for model in ("type_c", "type_a"):
        simulation = angle_of_repose.build(SOIL, HEAP, replace(HEAP_ENGINE, rolling_model=model), 1)
        simulation.advance(10)
        direct_shear.build(SOIL, SHEAR, replace(SHEAR_ENGINE, rolling_model=model), 1).advance(10)
        contact.ours(model, 1.0)


def summary(runs: pd.DataFrame) -> pd.DataFrame:
    """Mean, standard deviation and number of runs of each test, quantity, rolling friction and model."""
    by = runs[runs.test != "contact"].groupby(["test", "quantity", "rolling_friction", "model"], sort=False)["value"]
    return by.agg(mean="mean", sd="std", n="count").reset_index()


def standard_error(a: pd.Series, b: pd.Series) -> float:
    """Standard error of the difference of two means."""
    return math.sqrt(a["sd"] ** 2 / a["n"] + b["sd"] ** 2 / b["n"])


def checks(runs: pd.DataFrame) -> list[Check]:
    """Return all checks: contact, then heap and shear with equal definitions, then with different ones."""
    table = summary(runs).set_index(["quantity", "model", "rolling_friction"])
    low, high = ROLLING_FRICTIONS
    found = contact_checks(runs)
    for quantity in ("filled height", "angle of repose", "shear strength"):
        found += [equal_check(table, quantity, mu_r) for mu_r in ROLLING_FRICTIONS]
    for quantity in ("angle of repose", "shear strength"):
        found += definition_checks(table, quantity, low, high)
    return found


def contact_checks(runs: pd.DataFrame) -> list[Check]:
    """Check R / r of each law against the closed form."""
    exact = {
        (PEER, "opposite"): 0.5, (PEER, "same"): 0.0, ("type_c", "opposite"): 0.5, ("type_c", "same"): 0.0,
        ("type_a", "opposite"): 1.0, ("type_a", "same"): 1.0,
    }  # fmt: skip
    rows = runs[runs.test == "contact"]
    return [
        Check(
            group=GROUP,
            case=f"two grains meet, spins of {row.status} sense, {name_of(row.model)}",
            quantity=row.quantity,
            unit=row.unit,
            source="closed form",
            expected=exact[row.model, row.status],
            obtained=row.value,
            tolerance=0.01,
            note="EDEM's law: each grain's own spin, its own radius" if row.model == "type_a" else "relative spin, R* = r/2",
        )
        for row in rows.itertuples()
    ]


def name_of(model: str) -> str:
    """Name of a model in the printed tables."""
    return {PEER: "LIGGGHTS epsd2", "type_c": "type C", "type_a": "type A"}[model]


def spread(a: pd.Series, b: pd.Series) -> str:
    """Means, standard deviations and numbers of runs of both models, ours first."""
    each = " against ".join(f"{s['mean']:.3g} (SD {s['sd']:.2g}, n {s['n']:.0f})" for s in (a, b))
    return f"{each}; standard error of the difference {standard_error(a, b):.2g}"


def equal_check(table: pd.DataFrame, quantity: str, mu_r: float) -> Check:
    """Check type C against epsd2 with equal coefficients: same law, so same mean."""
    ours, peer = table.loc[(quantity, "type_c", mu_r)], table.loc[(quantity, PEER, mu_r)]
    return Check(
        group=GROUP,
        case=f"type C against epsd2, mu_s {STATIC_FRICTION}, mu_r {mu_r}",
        quantity=quantity,
        unit=UNITS[quantity],
        source=SOURCE,
        expected=peer["mean"],
        obtained=ours["mean"],
        tolerance=2.0 * standard_error(ours, peer),
        note=spread(ours, peer),
    )


def definition_checks(table: pd.DataFrame, quantity: str, low: float, high: float) -> list[Check]:
    """Check that type A is stronger at equal mu_r, and closer to epsd2 with twice its mu_r."""
    ours, same, doubled = table.loc[(quantity, "type_a", low)], table.loc[(quantity, PEER, low)], table.loc[(quantity, PEER, high)]
    gap, left = ours["mean"] - same["mean"], ours["mean"] - doubled["mean"]
    # Type A's mean enters both gaps, so its error cancels in their difference.
    closed_error = standard_error(same, doubled)
    case = f"type A, mu_r {low}, against epsd2"
    return [
        Check(
            group=GROUP,
            case=f"{case}, mu_r {low}",
            quantity=f"{quantity}, type A minus epsd2",
            unit=UNITS[quantity],
            source=SOURCE,
            expected=2.0 * standard_error(ours, same),
            obtained=gap,
            relation="at least",
            note=f"the same number means twice the torque in type A; {spread(ours, same)}",
        ),
        Check(
            group=GROUP,
            case=f"{case}, mu_r {high}",
            quantity=f"{quantity}, type A minus epsd2, size",
            unit=UNITS[quantity],
            source=SOURCE,
            expected=gap - 2.0 * closed_error,
            obtained=abs(left),
            relation="at most",
            note=f"equal largest torque; type A brakes grains that turn alike, and twisting, too; {spread(ours, doubled)}",
        ),
    ]
