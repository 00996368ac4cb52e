"""Conservation laws of an isolated cloud of grains: momentum and, depending on the rolling model, angular momentum.

Contact forces are equal and opposite and act at one point, so both are conserved without rolling resistance and with type C.
Type A applies the torque mu_r F_n R_i against each grain's own spin. The two torques of a contact are in general not equal and
opposite, so angular momentum is lost. For one contact of a spinning grain with a non-spinning one the loss is mu_r R times the
integral of F_n, i.e. mu_r R m* (1 + e_push) v.
"""

from functools import partial

import numpy as np

import dem
from virtual_soil.verification import closed_forms
from virtual_soil.verification.check import Check
from virtual_soil.verification.scene import ALUMINIUM, PRECISIONS, SOFT, mass_kg, record, scene

GROUP = "Conservation"

RADIUS_M = 1e-3
TIME_STEP_RATIO = 0.1
DURATION_S = 0.1


def checks() -> list[Check]:
    """Run all cases of conservation."""
    return [
        *(check for precision in PRECISIONS for check in cloud("type_c", 0.0, precision)),
        *(check for precision in PRECISIONS for check in cloud("type_c", 0.2, precision)),
        *(check for precision in PRECISIONS for check in cloud("type_a", 0.2, precision)),
        *(angular_momentum_of_a_pair(model) for model in ("type_a", "type_c")),
    ]


def make_cloud(precision: str = "float64", model: str = "type_a", mu_r: float = 0.0, seed: int = 2, **settings):
    """Create 64 grains of unequal size that approach each other, collide, slide and spin, without gravity or walls."""
    rng = np.random.default_rng(seed)
    simulation = scene(
        SOFT, 0.5 * RADIUS_M, TIME_STEP_RATIO * dem.rayleigh_time(0.5 * RADIUS_M, SOFT), restitution=0.7, static_friction=0.5,
        rolling_friction=mu_r, precision=precision, rolling_model=model, **settings,
    )  # fmt: skip
    positions = np.stack(np.meshgrid(*[np.arange(4) * 2.05 * RADIUS_M] * 3), -1).reshape(-1, 3)
    positions -= positions.mean(axis=0)
    velocities = -20.0 * positions + rng.normal(0.0, 0.02, (64, 3))
    spins = rng.normal(0.0, 20.0, (64, 3))
    return simulation, positions, rng.uniform(0.5 * RADIUS_M, RADIUS_M, 64), velocities, spins


def momenta(run, radii):
    """Momentum and angular momentum about the origin (t, 3), and the initial sums of the magnitudes of all contributions."""
    mass = mass_kg(SOFT, radii)[:, None]
    momentum = mass * run.velocities_m_s
    orbital = np.cross(run.positions_m, momentum)
    spin = 0.4 * mass * radii[:, None] ** 2 * run.spins_rad_s
    scales = np.linalg.norm(momentum[0], axis=1).sum(), (np.linalg.norm(orbital[0], axis=1) + np.linalg.norm(spin[0], axis=1)).sum()
    return momentum.sum(axis=1), (orbital + spin).sum(axis=1), scales


def cloud(model: str, mu_r: float, precision: str) -> list[Check]:
    """Check momentum and angular momentum of a cloud: change relative to the sum of the magnitudes of the grains' contributions.

    Rounding: the relative error of every load is its rounding unit. The error of the sum is that unit times the exchanged impulse,
    a few times the initial sum. In addition, every update of positions and velocities has the rounding error of float64.
    """
    simulation, positions, radii, velocities, spins = make_cloud(precision, model, mu_r)
    simulation.add_grains(positions, radii, "grain", velocities, spins)
    n_steps = round(DURATION_S / simulation.time_step_s)
    run = record(simulation, 1, n_steps)
    momentum, angular, scales = momenta(run, radii)
    lost = [float(np.linalg.norm(kind[-1] - kind[0]) / scale) for kind, scale in zip((momentum, angular), scales, strict=True)]
    rolling = "no rolling resistance" if mu_r == 0.0 else f"µr = {mu_r:g}, {model}"
    check = partial(
        Check, group=GROUP, case=f"cloud of 64 grains, {rolling}, {precision}", unit="-", source="closed form (action = reaction)",
        expected=0.0, tolerance=10.0 * PRECISIONS[precision] + n_steps * PRECISIONS["float64"],
    )  # fmt: skip
    if model == "type_a":
        note = f"angular momentum is not kept: it changes by {lost[1]:.1g} of its parts"
        return [check(quantity="change of momentum", obtained=lost[0], note=note)]
    return [
        check(quantity="change of momentum", obtained=lost[0]),
        check(quantity="change of angular momentum", obtained=lost[1]),
    ]


def angular_momentum_of_a_pair(model: str) -> Check:
    """Head-on collision of two equal frictionless spheres with rolling resistance mu_r; the first spins about a transverse axis."""
    r, v, e, mu_r, spin, steps = 0.1, 0.2, 0.5, 0.1, 20.0, 5000
    impact = closed_forms.of_spheres(ALUMINIUM, r, r, v, e)
    simulation = scene(ALUMINIUM, r, impact.duration_s / steps, restitution=e, rolling_friction=mu_r, rolling_model=model)
    simulation.add_grains(
        [(-r, 0, 0), (r, 0, 0)], r, "grain", velocities_m_s=[(v / 2, 0, 0), (-v / 2, 0, 0)],
        angular_velocities_rad_s=[(0, 0, spin), (0, 0, 0)],
    )  # fmt: skip
    run = record(simulation, 1, 2 * steps)
    inertia = 0.4 * mass_kg(ALUMINIUM, r) * r**2
    lost = inertia * float((run.spins_rad_s[0] - run.spins_rad_s[-1])[:, 2].sum())
    loss = mu_r * r * impact.mass_kg * (1.0 + impact.push_restitution) * v
    known = "type A takes angular momentum away, as EDEM's does"
    return Check(
        group=GROUP, case=f"two spheres, one spinning, µr = {mu_r:g}, {model}", source="closed form (impulse times µr R)",
        quantity="angular momentum lost", unit="kg m²/s", expected=loss if model == "type_a" else 0.0, obtained=lost,
        tolerance=closed_forms.damped_step_error(steps) * loss if model == "type_a" else 1e-12 * inertia * spin,
        note=known if model == "type_a" else "",
    )  # fmt: skip
