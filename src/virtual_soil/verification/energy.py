"""Energy balance: grains fall into a tube and settle, then the tube rises; work, stored energy and dissipation must balance.

The ledger (`dem.ledger`) evaluates the contact laws independently of the fast kernels. It balances only if their loads, the spring
histories, the wall forces and the motion are consistent. The residual is the error of the time integration, of second order.
"""

from typing import Any

import dem
from virtual_soil.verification.check import Check
from virtual_soil.verification.scene import PRECISIONS, SOFT

GROUP = "Energy"
RADIUS_M = 1e-3
#: Largest residual over dissipated energy at the default step of 0.2 T_R: the error of the spring energies within a step.
CLOSURE = 3e-3
#: Minimum reduction factor of the residual at a quarter of the step: 16 in theory, half of it because the trajectories differ.
BETTER = 8.0


def checks() -> list[Check]:
    """Run all cases of the energy balance."""
    cases = [(model, "edem") for model in ("type_a", "type_c")] + [("type_a", "no_pull")]
    return [check for case in cases for check in closing(*case)] + [*single_precision(), *frictionless()]


def lifted(restitution=0.5, static_friction=0.4, rolling_friction=0.1, **settings) -> dict[str, float]:
    """Energy ledger in J after 120 grains fell, settled and were released."""
    touch = dem.Interaction(restitution=restitution, static_friction=static_friction, rolling_friction=rolling_friction)
    simulation = dem.Simulation(
        materials={"grain": SOFT}, interactions={("grain", "grain"): touch}, smallest_radius_m=RADIUS_M, energy_ledger=True,
        walls=[
            dem.Box(name="floor", material="grain", low_m=(-1.0, -1.0, 0.0), high_m=(1.0, 1.0, 0.0)),
            dem.Tube(name="tube", material="grain", radius_m=5.0 * RADIUS_M, bottom_m=0.0, top_m=1.0),
        ],
        **settings,
    )  # fmt: skip
    region = dem.TubeRegion(radius_m=5.0 * RADIUS_M, bottom_m=0.0)
    sizes = dem.Sizes(mean_m=RADIUS_M)
    simulation.add_factory(dem.Factory(n_grains=120, region=region, sizes=sizes, material="grain", seed=1))
    simulation.run(0.12)
    simulation.move_wall("tube", (0.0, 0.0, 0.05))
    simulation.run(0.05)
    return simulation.energies_j


def closing(rolling_model: str, damping_model: str) -> list[Check]:
    """Residual of the energy balance at the default step and at a quarter of it."""
    settings = {"rolling_model": rolling_model, "damping_model": damping_model, "precision": "float64"}
    coarse, fine = (
        abs(energies["residual"]) / energies["dissipated"]
        for energies in (lifted(time_step_rayleigh_ratio=ratio, **settings) for ratio in (0.2, 0.05))
    )
    common: dict[str, Any] = {
        "group": GROUP,
        "case": f"filling and lifting, {rolling_model}, {damping_model}",
        "unit": "-",
        "source": "first law",
    }
    return [
        Check(**common, quantity="residual / dissipated", expected=CLOSURE, obtained=coarse, relation="at most", note="0.2 T_R"),
        Check(
            **common, quantity="residual, 0.2 over 0.05 T_R", expected=BETTER, obtained=coarse / fine, relation="at least",
            note=f"16 for second order; {fine:.1e} at 0.05 T_R",
        ),
    ]  # fmt: skip


def single_precision() -> list[Check]:
    """Energy balance with contact arithmetic in float32, the default."""
    energies = lifted()
    return [
        Check(
            group=GROUP, case="filling and lifting, float32", quantity="residual / dissipated", unit="-", source="first law",
            expected=CLOSURE, obtained=abs(energies["residual"]) / energies["dissipated"], relation="at most",
            note=f"springs remade: {energies['springs_remade'] / energies['dissipated']:.3f} of what is dissipated",
        )
    ]  # fmt: skip


def frictionless() -> list[Check]:
    """Elastic frictionless grains dissipate no energy, in both precisions."""
    rows = []
    for precision in PRECISIONS:
        energies = lifted(1.0, 0.0, 0.0, time_step_rayleigh_ratio=0.05, precision=precision)
        held = energies["kinetic"] + energies["potential"] + energies["normal_springs"]
        put_in = energies["exchanged"] + energies["work_of_walls"]
        rows.append(
            Check(
                group=GROUP, case=f"elastic grains without friction, {precision}", quantity="energy held over put in", unit="-",
                source="conservation", expected=1.0, obtained=held / put_in, tolerance=1e-3, note="0.05 T_R, 0.17 s of collisions",
            )
        )  # fmt: skip
    return rows
