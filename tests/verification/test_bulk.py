"""What the comparisons over seeds say of runs whose means are known."""

import numpy as np
import pandas as pd
import pytest

from virtual_soil.campaign.tables import check_table
from virtual_soil.verification import bulk, table_of

#: Means in degrees of heaps that behave; the scatter over seeds is 1 degree.
ANGLES = {"mu_s 0.1": 20.0, "mu_s 0.9": 30.0, "mu_r 0.05": 20.0, "mu_r 0.2": 35.0, "type C": 15.0, "lift 20 mm/s": 18.0}


def runs(angles=(), friction_change=0.0, cohesion_pa=0.0, drift_radii=0.0, smooth=0.62):
    """A table of runs; angles: means of variants that differ from what is expected."""
    angles, rng, rows = ANGLES | dict(angles), np.random.default_rng(1), []
    for name in bulk.runs():
        kind, variant, seed = bulk.parts_of(name)
        row = dict.fromkeys(bulk.COLUMNS, np.nan) | {
            "run": name,
            "kind": kind,
            "variant": variant,
            "seed": seed,
            "status": "ok",
        }
        if kind == "heap":
            row["angle_of_repose_deg"] = angles.get(variant, 27.0) + (1.0 if seed % 2 else -1.0)
            row |= {"drift_mean_radii": drift_radii, "drift_largest_radii": drift_radii, "drift_deg": 0.0}
        elif kind == "shear":
            stress = float(variant.split()[0])
            row |= {"plane_normal_stress_pa": stress, "plateau_shear_stress_pa": 0.7 * stress + cohesion_pa * (stress == 500.0)}
            row |= {"friction": 0.7, "friction_change": friction_change + 0.01 * rng.standard_normal()}
        else:
            row["solid_fraction"] = (smooth if variant == "smooth" else 0.58) + (0.002 if seed % 2 else -0.002)
        rows.append(row)
    return check_table(pd.DataFrame(rows), "bulk_runs", "test")


def failed(table):
    checks = table_of(bulk.checks(table))
    return set(checks.loc[~checks["passed"], "case"])


def test_runs_as_expected_pass():
    assert failed(runs()) == set()


@pytest.mark.parametrize(
    ("changes", "case"),
    [
        ({"angles": {"G 5e7 Pa": 30.0}}, "heap, G 5e7 Pa against the base"),
        ({"angles": {"float64": 24.5}}, "heap, float64 against the base"),
        ({"angles": {"mu_r 0.2": 27.5}}, "heap, base to mu_r 0.2"),
        ({"angles": {"mu_s 0.1": 27.0}}, "heap, mu_s 0.1 to base"),
        ({"angles": {"mu_s 0.9": 24.0}}, "heap, base to mu_s 0.9"),
        ({"drift_radii": 0.01}, "settled heap watched for 0.1 s, type A"),
        ({"cohesion_pa": 200.0}, "direct shear at four normal stresses"),
        ({"friction_change": -0.1}, "direct shear, third to last quarter of the displacement"),
        ({"smooth": 0.641}, "poured without friction"),
        ({"smooth": 0.599}, "poured without friction"),
        ({"smooth": 0.57}, "poured with mu_s 0.5"),
    ],
)
def test_a_deviation_is_seen(changes, case):
    assert case in failed(runs(**changes))


def test_every_run_has_a_name_of_its_own():
    assert len(set(bulk.runs())) == len(bulk.runs())


def test_a_solid_fraction_is_that_of_a_crystal():
    """A simple cubic lattice fills pi / 6."""
    from dem import Grains

    axis = np.arange(-8.0, 8.1, 2.0) * 1e-3
    positions = np.stack(np.meshgrid(axis, axis, axis + 9e-3), axis=-1).reshape(-1, 3)
    still = np.zeros_like(positions)
    grains = Grains(positions, still, still, np.full(len(positions), 1e-3))
    assert bulk.solid_fraction(grains, 6e-3, 2e-3) == pytest.approx(np.pi / 6, abs=0.02)
