"""One rolling contact in both programs: head-on impact of two equal smooth grains with equal or opposite spins.

Without sliding friction (mu_s = 0) and dashpot (e = 1) only the rolling resistance changes the spins. The impulse of the normal
force is m dv, so the law's lever arm R follows from |d omega| = 5/2 mu_r (R / r) dv / r. In epsd2 and type C, R = R* = r/2 if the
spins differ, 0 if they are equal; in type A, R = r in both cases.
"""

from pathlib import Path

import numpy as np

from dem import Interaction, Material, Simulation
from virtual_soil.verification.peers.liggghts import Liggghts, data_text, header_lines, material_lines

RADIUS_M, DENSITY_KG_M3, POISSON_RATIO, SHEAR_MODULUS_PA = 50e-6, 3000.0, 0.2, 2.5e6
ROLLING_FRICTION = 0.1
SPEED_M_S, SPIN_RAD_S = 0.01, 2000.0
#: Time step with some 250 steps per contact.
RAYLEIGH_RATIO = 0.02
N_STEPS = 1000
#: Sense of the second grain's spin relative to the first's.
SENSES = {"opposite": -1.0, "same": 1.0}


def start(sense: float):
    """Initial positions, velocities and spins (2, 3) of two grains that approach each other along x."""
    positions = np.array([[-1.001, 0.0, 0.0], [1.001, 0.0, 0.0]]) * RADIUS_M
    velocities = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]]) * SPEED_M_S
    spins = np.array([[0.0, 1.0, 0.0], [0.0, sense, 0.0]]) * SPIN_RAD_S
    return positions, velocities, spins


def radius_ratio(velocities_m_s, spins_rad_s) -> float:
    """R / r of the law, from the final velocity and spin of the first grain."""
    speed_change = abs(velocities_m_s[0, 0] - SPEED_M_S)
    spin_change = SPIN_RAD_S - spins_rad_s[0, 1]
    return float(spin_change * RADIUS_M / (2.5 * ROLLING_FRICTION * speed_change))


def simulation(rolling_model: str) -> Simulation:
    """Create a simulation in our engine, without grains, gravity or walls."""
    material = Material(density_kg_m3=DENSITY_KG_M3, poisson_ratio=POISSON_RATIO, shear_modulus_pa=SHEAR_MODULUS_PA)
    interaction = Interaction(restitution=1.0, static_friction=0.0, rolling_friction=ROLLING_FRICTION)
    return Simulation(
        materials={"soil": material},
        interactions={("soil", "soil"): interaction},
        gravity_m_s2=(0.0, 0.0, 0.0),
        smallest_radius_m=RADIUS_M,
        time_step_rayleigh_ratio=RAYLEIGH_RATIO,
        rolling_model=rolling_model,
        precision="float64",
    )


def ours(rolling_model: str, sense: float) -> float:
    """R / r in our engine."""
    pair = simulation(rolling_model)
    positions, velocities, spins = start(sense)
    pair.add_grains(positions, RADIUS_M, "soil", velocities, spins)
    pair.advance(N_STEPS)
    return radius_ratio(pair.grains.velocities_m_s, pair.grains.angular_velocities_rad_s)


def peers(folder: Path, sense: float) -> float:
    """R / r in LIGGGHTS."""
    positions, velocities, spins = start(sense)
    box = [(-20 * RADIUS_M, 20 * RADIUS_M)] * 3
    radii = np.full(2, RADIUS_M)
    (folder / "grains.data").write_text(data_text("two grains", box, 1, positions, radii, DENSITY_KG_M3, spins, velocities))
    lines = [
        *header_lines("f f f", folder / "grains.data", 0.2 * RADIUS_M),
        *material_lines(SHEAR_MODULUS_PA, POISSON_RATIO, 1.0, [[0.0]], [[ROLLING_FRICTION]]),
        f"timestep {simulation('type_c').time_step_s:.9g}",
        "fix motion all nve/sphere",
    ]
    with Liggghts(folder, lines) as peer:
        peer.run(N_STEPS)
        table = peer.dump("vx vy vz omegax omegay omegaz")
    return radius_ratio(table[:, 1:4], table[:, 4:7])
