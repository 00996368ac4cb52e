"""Check by simulation that dimensionless responses do not depend on radius, gravity and density.

    python benchmarks/scaling.py [--seeds 8] [--slow-seeds 4] [--shear-seeds 8]

Writes docs/scaling.md, on one core in 20 minutes. All tests have the fidelity of a campaign. Heaps of one table share the
lift speed over sqrt(g r), plane shear tests the inertial number. Equal seeds drop equal lattices of grains, so differences are
taken seed by seed. Two further tables are of heaps that must differ, as their lift speed over sqrt(g r) does.
"""

import argparse
import copy
import math
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np

from dem.experiments import angle_of_repose, plane_shear, strength
from dem.experiments.soil import Engine, Soil
from dem.measure.heap import measure_heap
from virtual_soil.calibration.scaling import lift_number
from virtual_soil.campaign.experiments.common import soil_of
from virtual_soil.campaign.experiments.plane_shear import declared as plane_shear_test
from virtual_soil.campaign.experiments.repose import declared as repose_test
from virtual_soil.campaign.sections import Study
from virtual_soil.campaign.settings import defaults

PAGE = Path(__file__).resolve().parents[1] / "docs" / "scaling.md"
CONFIG = defaults(Study)
MATERIAL, GRAVITY = CONFIG["material"], CONFIG["engine"]["gravity_m_s2"]
LIFT, STRESS_PA = CONFIG["fidelity"]["campaign"]["lift_speed_m_s"], 500.0
#: Weak and strong grains: the couples of the reference's sweep.
COUPLES = CONFIG["design"]["sweep_couples"]
#: Largest radius of the reference's sweep: there its heaps are lifted most slowly.
SLOWEST_M = max(CONFIG["design"]["sweep"]["radius_m"])


class Variant(NamedTuple):
    """A test's grains and surroundings; number : lift speed over sqrt(g r), by default that of the base heap."""

    name: str
    radius_m: float = MATERIAL["radius_m"]
    density_kg_m3: float = MATERIAL["density_kg_m3"]
    gravity_m_s2: float = GRAVITY
    stress_pa: float = STRESS_PA
    number: float = lift_number(LIFT, GRAVITY, MATERIAL["radius_m"])

    def material(self, couple: dict) -> dict:
        """Values of the `material` section."""
        return {**MATERIAL, **couple, "radius_m": self.radius_m, "density_kg_m3": self.density_kg_m3}


SLOW = lift_number(LIFT, GRAVITY, SLOWEST_M)
HEAPS = [
    Variant("50 µm, 9.81 m/s², 3000 kg/m³"),
    Variant("2 mm", radius_m=2e-3),
    Variant("1.62 m/s²", gravity_m_s2=1.62),
    Variant("2000 kg/m³", density_kg_m3=2000.0),
    Variant("0.3 mm, 3.71 m/s², 1700 kg/m³", radius_m=0.3e-3, gravity_m_s2=3.71, density_kg_m3=1700.0),
]
UNLIKE = [HEAPS[0], Variant("1.62 m/s², lifted at Earth's 5 mm/s", gravity_m_s2=1.62, number=lift_number(LIFT, 1.62, 50e-6))]
SLOWER = [
    Variant("0.5 mm: the reference's slowest", radius_m=SLOWEST_M, number=SLOW),
    Variant("0.5 mm, half as fast", radius_m=SLOWEST_M, number=0.5 * SLOW),
    Variant("0.5 mm, a quarter as fast", radius_m=SLOWEST_M, number=0.25 * SLOW),
]
SHEARED = [
    Variant("50 µm, 3000 kg/m³, 500 Pa"),
    Variant("2 mm", radius_m=2e-3),
    Variant("2000 kg/m³", density_kg_m3=2000.0),
    Variant("7 kPa", stress_pa=7000.0),
    Variant("0.3 mm, 1700 kg/m³, 3 kPa", radius_m=0.3e-3, density_kg_m3=1700.0, stress_pa=3000.0),
]
#: The page.
TEXT = """# One reference for all radii, gravities and densities

Written by `python benchmarks/scaling.py`. Rigid grains without adhesion have no scale of their own. A heap's angle therefore
depends on radius r, gravity g and lift speed through one number, the lift speed over √(g r), and not on the density; the strength
ratio in plane shear at one inertial number depends on none of these, nor on the stress. The first answer uses this to answer for
any of them from one reference campaign. The tests below check it at the fidelity of a campaign: {n_heaps} heaps and {n_sheared}
plane shear tests a cell, mean ± standard error in degrees. Differences are from the first row, seed by seed.

Gravities and densities whose factors are powers of two prove nothing: at {exact} the numbers of the whole simulation
differ from those of the base heap in nothing but their exponents, and the two heaps are {same}.

## Angle of repose at one lift speed over √(g r)

{heaps}

## Friction angle in plane shear: steady

{steady}

## Friction angle in plane shear: peak

{peak}

## Added error

The mean difference of all rows from the first, with its standard error from seed to seed. A first answer for another radius,
gravity, lift speed or density adds the root of the sum of their squares, rounded up, to the standard errors of the surrogates
(`scaling_error` of each response): what this check would have overlooked. Cohesions get none, for a factor on all strengths adds no
cohesion.

| response | difference (°) | added error (°) |
|---|---|---|
{verdicts}

## What differs

The same check sees a number that is not kept: the Moon's gravity with the lift speed of the Earth.

{unlike}

## Slower than the reference

"As slowly as you can" is slower than the reference's slowest heaps ({slow:.4f}). {n_slow} heaps a cell:

{slower}

For a slower lift the first answer takes the slowest heaps, marks the angle as extrapolated and adds the error of the last row.
Slower heaps are the steeper ones, if they differ. Below a quarter nothing was measured.
"""
#: A quarter and a half: every rounding is that of the base test, but for the exponent.
EXACT = Variant("9.81/4 m/s² and 1500 kg/m³", gravity_m_s2=GRAVITY / 4.0, density_kg_m3=0.5 * MATERIAL["density_kg_m3"])


def settings_of(test, variant: Variant, couple: dict) -> tuple[Soil, dict]:
    """Soil and settings of a campaign's test."""
    config = copy.deepcopy(CONFIG)
    config["engine"]["gravity_m_s2"] = variant.gravity_m_s2
    speed = variant.number * math.sqrt(variant.gravity_m_s2 * variant.radius_m)
    config["fidelity"]["campaign"]["lift_speed_m_s"] = speed
    row = {"fidelity": "campaign", "normal_stress_pa": variant.stress_pa, **variant.material(couple)}
    return soil_of(row, config), test.setup(config, row)


def heap(variant: Variant, couple: dict, seed: int) -> angle_of_repose.Heap:
    """A heap."""
    soil, settings = settings_of(repose_test, variant, couple)
    return angle_of_repose.run(soil, angle_of_repose.Setup(**settings["setup"]), Engine(**settings["engine"]), seed)


def angles_deg(variant: Variant, couple: dict, seed: int) -> tuple[float]:
    """Angle of repose."""
    made = heap(variant, couple, seed)
    if made.status != "static":
        raise SystemExit(f"{variant.name}, seed {seed}: the heap is {made.status}")
    return (measure_heap(made.grains.positions_m, made.grains.radii_m).angle_profile_deg,)


def strengths_deg(variant: Variant, couple: dict, seed: int) -> tuple[float, float]:
    """Steady and peak friction angle of one plane shear test, without cohesion."""
    soil, settings = settings_of(plane_shear_test, variant, couple)
    setup = plane_shear.Setup(**settings["setup"])
    history = plane_shear.run(soil, setup, Engine(**settings["engine"]), seed).history
    curve = history["shear_strain"], history["shear_stress_pa"], history["plane_normal_stress_pa"]
    found = strength.steady(*curve), strength.peak(*curve)
    return tuple(math.degrees(math.atan2(state.shear_stress_pa, state.normal_stress_pa)) for state in found)


def responses(measure, variants: list[Variant], n_seeds: int) -> np.ndarray:
    """Responses (couples, variants, seeds, k)."""
    began = time.process_time()
    result = []
    for couple in COUPLES:
        result.append([[measure(variant, couple, seed) for seed in range(1, n_seeds + 1)] for variant in variants])
        print(f"{measure.__name__}: {time.process_time() - began:.0f} s of processor time", flush=True)
    return np.array(result)


def mean_and_se(values: np.ndarray) -> tuple[float, float]:
    """Mean and its standard error of (n,) values."""
    return float(values.mean()), float(values.std(ddof=1) / math.sqrt(len(values)))


def overall(found: np.ndarray) -> tuple[float, float]:
    """Mean difference of all variants from the first, and its standard error from seed to seed.

    found : (couples, variants, seeds).
    """
    by_seed = (found[:, 1:] - found[:, :1]).mean(axis=1)
    variances = by_seed.var(axis=1, ddof=1) / by_seed.shape[1]
    return float(by_seed.mean()), float(math.sqrt(variances.sum()) / len(by_seed))


def table(variants: list[Variant], found: np.ndarray, number: bool) -> str:
    """A table of one response; found (couples, variants, seeds). number : True for a column of the lift's number."""
    names = [f"µs {couple['static_friction']:g}, µr {couple['rolling_friction']:g}" for couple in COUPLES]
    head = ["test", *(["lift / √(g r)"] if number else []), *(cell for name in names for cell in (name, "difference"))]
    rows = [f"| {' | '.join(head)} |", "|---" * len(head) + "|"]
    for k, variant in enumerate(variants):
        cells = [variant.name, *([f"{variant.number:.4f}"] if number else [])]
        for values in found:
            mean, error = mean_and_se(values[k])
            difference = "{:+.2f} ± {:.2f}".format(*mean_and_se(values[k] - values[0])) if k else "–"
            cells += [f"{mean:.2f} ± {error:.2f}", difference]
        rows.append(f"| {' | '.join(cells)} |")
    return "\n".join(rows)


def verdict(response: str, found: np.ndarray) -> str:
    """Line on the mean difference and the error that it adds."""
    difference, error = overall(found)
    return f"| {response} | {difference:+.2f} ± {error:.2f} | {math.hypot(difference, error):.2f} |"


def same_to_the_bit() -> bool:
    """True if the grains of a heap of EXACT lie where those of the base heap do."""
    places = [heap(variant, COUPLES[0], 1).grains.positions_m for variant in (HEAPS[0], EXACT)]
    return places[0].shape == places[1].shape and bool((places[0] == places[1]).all())


def measured(n_seeds: int, n_slow: int, n_sheared: int) -> dict:
    """Angles of all tests in degrees, each (couples, variants, seeds), and whether EXACT is exact."""
    exact = same_to_the_bit()
    heaps = responses(angles_deg, HEAPS, n_seeds)[..., 0]
    steady, peak = np.moveaxis(responses(strengths_deg, SHEARED, n_sheared), -1, 0)
    unlike = responses(angles_deg, UNLIKE[1:], n_seeds)[..., 0]
    slower = responses(angles_deg, SLOWER, n_slow)[..., 0]
    unlike = np.concatenate([heaps[:, :1], unlike], axis=1)
    return {"exact": exact, "heaps": heaps, "steady": steady, "peak": peak, "unlike": unlike, "slower": slower}


def page(found: dict) -> str:
    """The page of what was `measured`."""
    verdicts = {
        "angle of repose": found["heaps"],
        "steady friction angle": found["steady"],
        "peak friction angle": found["peak"],
        "angle of repose, lifted more slowly": found["slower"][:, [0, -1]],
    }
    return TEXT.format(
        n_heaps=found["heaps"].shape[-1],
        n_sheared=found["steady"].shape[-1],
        n_slow=found["slower"].shape[-1],
        exact=EXACT.name,
        same="the same to the last bit" if found["exact"] else "not the same",
        heaps=table(HEAPS, found["heaps"], number=True),
        steady=table(SHEARED, found["steady"], number=False),
        peak=table(SHEARED, found["peak"], number=False),
        verdicts="\n".join(verdict(name, values) for name, values in verdicts.items()),
        unlike=table(UNLIKE, found["unlike"], number=True),
        slow=SLOW,
        slower=table(SLOWER, found["slower"], number=True),
    )


def main() -> None:
    """Run all tests and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=8)
    parser.add_argument("--slow-seeds", type=int, default=4)
    parser.add_argument("--shear-seeds", type=int, default=8)
    given = parser.parse_args()
    text = page(measured(given.seeds, given.slow_seeds, given.shear_seeds))
    PAGE.write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
