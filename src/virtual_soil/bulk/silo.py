"""Silo: a cylinder with a cone of 45 degrees runs out through an orifice. Both codes have the same triangles.

Outflow beside Beverloo, Leniger, van de Velde 1961 (Chem. Eng. Sci. 15, 260): W = C rho_b sqrt(g) (D - k d)^2.5, C = 0.58, k = 1.4,
for flat bottoms; a cone of 45 degrees flows up to a fifth faster.
"""

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

import dem
from dem import solids
from virtual_soil.bulk import peer
from virtual_soil.bulk.materials import GRAVITY_M_S2, STEEL, TANGENTIAL_MODEL, interactions, materials
from virtual_soil.bulk.packings import Packing
from virtual_soil.bulk.run import Run, sampled

#: In the order of LIGGGHTS' types.
NAMES = ("M1", STEEL)
#: Facets round, and parts of cone and cylinder along the axis.
SIDES, RINGS = 100, 4
#: Beverloo's constants, and the solid fraction that the benchmark's expected outflow has.
BEVERLOO_C, BEVERLOO_K, SOLID_FRACTION = 0.58, 1.4, 0.58
#: Grains leave this far below the orifice, in m.
BELOW_M = 0.02
#: Translational energy over m g r below which a filling is at rest, and the time in s after which it is given up.
REST_RATIO, REST_TIME_S = 1e-5, 3.0
#: Flow is steady from here on, in s.
STEADY_FROM_S = 0.1


@dataclass(frozen=True, kw_only=True)
class Setup:
    """Silo, filling and clock; softening: the grains' E is divided by it.

    The defaults are a scaled run: the benchmark's silo and grains, but fewer, softer, and for a shorter time.
    """

    orifice_radius_m: float
    bottom_m: float
    cone_top_m: float
    top_m: float
    cylinder_radius_m: float = 0.1
    grain_radius_m: float = 2e-3
    n_grains: int = 30_000
    softening: float = 100.0
    time_step_s: float = 4e-5
    sample_s: float = 0.01
    duration_s: float = 0.6


SCALED = {
    "small": Setup(orifice_radius_m=0.02, bottom_m=-0.0593008, cone_top_m=0.0206992, top_m=0.320699),
    "large": Setup(orifice_radius_m=0.03, bottom_m=-0.0554222, cone_top_m=0.0145778, top_m=0.314578),
}
#: The benchmark's own runs.
FULL = {
    f"{orifice}_full": replace(setup, n_grains=100_000, softening=1.0, time_step_s=1.5e-6, sample_s=0.06, duration_s=5.04)
    for orifice, setup in SCALED.items()
}
SETUPS = SCALED | FULL


def profile(setup: Setup) -> list[tuple[float, float]]:
    """Radius and height in m of the wall's rings, from the orifice up."""
    shares = np.linspace(0.0, 1.0, RINGS + 1)
    cone = [
        (
            setup.orifice_radius_m + share * (setup.cylinder_radius_m - setup.orifice_radius_m),
            setup.bottom_m + share * (setup.cone_top_m - setup.bottom_m),
        )
        for share in shares
    ]
    return [
        *cone,
        *((setup.cylinder_radius_m, setup.cone_top_m + share * (setup.top_m - setup.cone_top_m)) for share in shares[1:]),
    ]


def wall(setup: Setup) -> dem.Mesh:
    """Cone and cylinder."""
    return solids.revolved(profile(setup), SIDES, name="silo", material=STEEL)


def simulation_of(setup: Setup, walls: list[dem.Wall]) -> dem.Simulation:
    """Silo without grains."""
    return dem.Simulation(
        materials=materials(NAMES, setup.softening),
        interactions=interactions(NAMES),
        smallest_radius_m={"M1": setup.grain_radius_m},
        time_step_s=setup.time_step_s,
        gravity_m_s2=(0.0, 0.0, -GRAVITY_M_S2),
        tangential_model=TANGENTIAL_MODEL,
        walls=walls,
        floor_m=setup.bottom_m - BELOW_M,
    )


def fill(setup: Setup, seed: int) -> Packing:
    """Grains at rest on the closed orifice.

    Raises
    ------
    ValueError : the grains do not fit below the top. RuntimeError : they do not come to rest.
    """
    wide = 2.0 * setup.cylinder_radius_m
    lid = dem.Box(name="lid", material=STEEL, low_m=(-wide, -wide, setup.bottom_m), high_m=(wide, wide, setup.bottom_m))
    simulation = simulation_of(setup, [wall(setup), lid])
    inner = setup.cylinder_radius_m * math.cos(math.pi / SIDES)
    region = dem.TubeRegion(radius_m=inner, bottom_m=setup.cone_top_m)
    sizes = dem.Sizes(mean_m=setup.grain_radius_m)
    simulation.add_factory(dem.Factory(n_grains=setup.n_grains, region=region, sizes=sizes, material="M1", seed=seed))
    if simulation.top_m > setup.top_m:
        raise ValueError(f"n_grains is {setup.n_grains}; allowed: grains whose loose layers end below top_m = {setup.top_m} m.")
    if not simulation.run(REST_TIME_S, until=lambda now: now.is_static(REST_RATIO)):
        raise RuntimeError(f"The filling of {setup.n_grains} grains still moves after {REST_TIME_S} s.")
    grains = simulation.grains
    return Packing(positions_m=grains.positions_m, radii_m=grains.radii_m, materials=np.full(len(grains), "M1"))


def ours(packing: Packing, setup: Setup) -> Run:
    """Our code, the orifice open; quantities above (grains above the orifice) and grains (those not yet removed)."""
    simulation = simulation_of(setup, [wall(setup)])
    simulation.add_grains(packing.positions_m, packing.radii_m, "M1")

    def look(now: dem.Simulation) -> dict[str, float]:
        return {"above": float((now.grains.positions_m[:, 2] > setup.bottom_m).sum()), "grains": float(now.n_grains)}

    return sampled(simulation, look, setup.duration_s, setup.sample_s)


def of_liggghts(packing: Packing, setup: Setup, folder: Path) -> Run:
    """LIGGGHTS in a folder; quantities as those of `ours`."""
    wide = 1.1 * setup.cylinder_radius_m
    box = [(-wide, wide), (-wide, wide), (setup.bottom_m - BELOW_M, setup.top_m)]
    lines = [
        *peer.grains_lines(folder, packing, box, NAMES),
        *peer.material_lines(NAMES, setup.softening),
        peer.mesh_line(folder, "silo", wall(setup).corners_m, len(NAMES)),
        peer.mesh_walls(["silo"]),
        f"region above block INF INF INF INF {setup.bottom_m:.9g} INF",
        *peer.motion_lines(setup.time_step_s),
    ]
    values = {"above": "count(all,above)", "grains": "count(all)"}
    clock = peer.Clock(setup.duration_s, setup.sample_s, setup.time_step_s)
    return peer.sampled(folder, lines, values, len(packing), clock)


def beverloo_per_s(setup: Setup) -> float:
    """Expected outflow in grains/s; density and mass of a grain cancel to the solid fraction over its volume."""
    d = 2.0 * setup.grain_radius_m
    opening = 2.0 * setup.orifice_radius_m - BEVERLOO_K * d
    return BEVERLOO_C * SOLID_FRACTION * math.sqrt(GRAVITY_M_S2) * opening**2.5 / (math.pi * d**3 / 6.0)


def steady(times_s: np.ndarray, above: np.ndarray, n_cone: int) -> np.ndarray:
    """True (k,) for samples of the steady flow: after its start, and while the cylinder holds grains.

    above (k,) grains above the orifice; n_cone : grains that the cone holds.
    """
    return (times_s >= STEADY_FROM_S) & (above > n_cone)


def in_cone(packing: Packing, setup: Setup) -> int:
    """Number of grains of a packing in the cone."""
    return int((packing.positions_m[:, 2] < setup.cone_top_m).sum())


def outflow_per_s(times_s: np.ndarray, above: np.ndarray) -> tuple[float, float]:
    """Mean outflow in grains/s of the steady samples (k,), and its relative change from the first to the last of them.

    Raises
    ------
    ValueError : fewer than five samples.
    """
    if len(times_s) < 5:
        raise ValueError(f"samples of the steady outflow are {len(times_s)}; allowed: at least 5 (more grains, or finer samples).")
    since = times_s - times_s.mean()
    curvature, slope, _ = np.polyfit(since, above, 2)
    return -float(slope), float(2.0 * curvature * np.ptp(since) / slope)
