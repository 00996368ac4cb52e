"""A steel ball falls into a bed of grains a tenth of its size, beside the curve of another code on the same packing."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import dem

DATA = Path(__file__).parents[3] / "shared" / "bulk-benchmarks"
PACKING, CURVE = DATA / "penetration_25000.parquet", DATA / "impact_25000_liggghts.csv"
GRAIN = dem.Material(density_kg_m3=2500.0, poisson_ratio=0.2, shear_modulus_pa=1e9 / 2.4)
STEEL = dem.Material(density_kg_m3=7200.0, poisson_ratio=0.2, shear_modulus_pa=210e9 / 2.4)
#: Inner faces of the box in m; the bottom is where the packing stands.
HALF_X_M, HALF_Y_M, BOTTOM_M, FAR_M = 0.049, 0.030, -0.0902431, 1.0
#: Start of the curve: the ball just above the bed, as after its free fall.
BALL_RADIUS_M, BALL_Z_M, BALL_SPEED_M_S = 10e-3, -0.0462, 5.203990776


def touch(restitution, static_friction):
    return dem.Interaction(restitution=restitution, static_friction=static_friction, rolling_friction=0.0)


def walls():
    faces = {
        "bottom": ((-FAR_M, -FAR_M, -FAR_M), (FAR_M, FAR_M, BOTTOM_M)),
        "left": ((-FAR_M, -FAR_M, -FAR_M), (-HALF_X_M, FAR_M, FAR_M)),
        "right": ((HALF_X_M, -FAR_M, -FAR_M), (FAR_M, FAR_M, FAR_M)),
        "front": ((-FAR_M, -FAR_M, -FAR_M), (FAR_M, -HALF_Y_M, FAR_M)),
        "back": ((-FAR_M, HALF_Y_M, -FAR_M), (FAR_M, FAR_M, FAR_M)),
    }
    return [dem.Box(name=name, material="steel", low_m=low, high_m=high) for name, (low, high) in faces.items()]


@pytest.mark.skipif(not PACKING.exists(), reason="the published packing is not here")
def test_a_ball_penetrates_a_bed_as_in_another_code():
    """To 5 ms, 15 mm deep; two codes with unlike dashpots were 0.1 mm apart, 0.3 mm is the benchmark's tolerance.

    Set-up: Dosta et al. 2024, Computer Physics Communications, article 109066. The curve is one run of LIGGGHTS 3.8.0.
    """
    packing, curve = pd.read_parquet(PACKING), pd.read_csv(CURVE)
    simulation = dem.Simulation(
        materials={"grain": GRAIN, "steel": STEEL},
        interactions={
            ("grain", "grain"): touch(0.5, 0.3), ("grain", "steel"): touch(0.4, 0.2), ("steel", "steel"): touch(0.6, 0.5),
        },
        smallest_radius_m={"grain": float(packing["radius_m"].min()), "steel": BALL_RADIUS_M},
        time_step_s=5e-7,
        gravity_m_s2=(0.0, 0.0, -9.8),
        walls=walls(),
    )  # fmt: skip
    simulation.add_grains(packing[["x_m", "y_m", "z_m"]].to_numpy(), packing["radius_m"].to_numpy(), "grain")
    simulation.add_grains([(0.0, 0.0, BALL_Z_M)], BALL_RADIUS_M, "steel", velocities_m_s=(0.0, 0.0, -BALL_SPEED_M_S))
    apart = []
    for time_s in np.arange(1, 6) * 1e-3:
        simulation.advance(round(time_s / simulation.time_step_s) - simulation.n_steps)
        theirs = curve.loc[np.isclose(curve["t_s"], time_s), "z_m"].item()
        apart.append(float(simulation.grains.positions_m[-1, 2]) - theirs)
    assert np.abs(apart).max() < 0.3e-3
    assert simulation.n_grains == len(packing) + 1
