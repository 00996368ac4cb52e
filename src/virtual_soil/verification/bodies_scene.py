"""Shared by the cases of bodies: spheres under gravity on bodies of rigid material, a row of the group."""

import math

import numpy as np

import dem
from virtual_soil.verification import closed_forms
from virtual_soil.verification.check import Check
from virtual_soil.verification.rest import GRAVITY_M_S2, RADIUS_M, TIME_STEP_S
from virtual_soil.verification.scene import SOFT, mass_kg, scene

GROUP = "Bodies"
RIGID_BODY = "closed form (rigid bodies)"

WEIGHT_N = mass_kg(SOFT, RADIUS_M) * GRAVITY_M_S2
DOWN = (0.0, 0.0, -GRAVITY_M_S2)

#: Half the edge of a square floor.
HALF_M = 0.2

#: Overlap of a sphere that lies on a floor under its weight.
OVERLAP_M = (WEIGHT_N / closed_forms.on_wall(SOFT, RADIUS_M, 1.0).stiffness) ** (2.0 / 3.0)


def check(case: str, quantity: str, unit: str, source: str, expected: float, obtained, tolerance: float = 0.0, **more) -> Check:
    """One check of this group."""
    return Check(
        group=GROUP, case=case, quantity=quantity, unit=unit, source=source, expected=expected, obtained=float(obtained),
        tolerance=tolerance, **more,
    )  # fmt: skip


def on(walls, *, friction=(0.5, 0.0), gravity_m_s2=DOWN, restitution=0.5, **settings) -> dem.Simulation:
    """Soft spheres on some bodies of rigid material under gravity."""
    static, rolling = friction
    rough = {"restitution": restitution, "static_friction": static, "rolling_friction": rolling}
    return scene(SOFT, RADIUS_M, TIME_STEP_S, gravity_m_s2=gravity_m_s2, walls=walls, **rough | settings)


def body(shape: dem.Wall, name: str = "floor", **motion) -> dem.Body:
    """A body of rigid material."""
    return dem.Body(name=name, material="rigid", shape=shape, motion=dem.Motion(**motion))


def vee(half_angle_rad: float) -> dem.Mesh:
    """A groove of two planes along y, its bottom at the origin."""
    x, z, y = 0.02 * math.sin(half_angle_rad), 0.02 * math.cos(half_angle_rad), 0.02
    vertices = np.array([(0, -y, 0), (0, y, 0), (x, -y, z), (x, y, z), (-x, -y, z), (-x, y, z)])
    return dem.Mesh(vertices_m=vertices, triangles=np.array([(0, 2, 3), (0, 3, 1), (0, 1, 5), (0, 5, 4)]), source="groove")
