"""The specimen of a shear test: grains in a box, pressed by a lid under a constant force.

The box is periodic in y. Floor and lid become rough when the grains that touch them are glued to them: like the toothed plates of
a real shear box, they hand the full shear force over without slip.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import cast

import numpy as np

from dem import ENDLESS_M, Box, BoxRegion, Drive, Grains, Rich, Simulation
from dem.experiments.soil import Engine, Soil
from dem.experiments.state import State, steps_in

#: Consolidation ends when the lid moves less than this fraction of a radius between two looks; at the latest after this number of
#: inertial times, at the earliest after this number of steps.
STILL_RATIO, CONSOLIDATION_TIMES, CONSOLIDATION_STEPS = 1e-3, 400.0, 5000
#: Solid fraction assumed to choose the number of grains.
FILL_FRACTION = 0.57
#: Grains whose surface is nearer than this fraction of their radius to floor or lid are glued to it.
GLUE_REACH_RATIO = 0.5


@dataclass(frozen=True, kw_only=True)
class Specimen(Rich):
    """Geometry and preparation; ratios are over scale_radius_m.

    preparation_friction_ratio multiplies the grains' friction during filling and consolidation: below 1 it gives a denser
    specimen, as tamping does (rough grains that roll badly otherwise stand as a house of cards). Grains stick to each other, to
    floor and lid, not to the frames, and only after the consolidation, unless prepared_with_adhesion: specimens that stick before
    have a packing of their own at every stress, and their strength line hides the cohesion.
    """

    length_ratio: float
    height_ratio: float
    width_ratio: float
    normal_stress_pa: float
    preparation_friction_ratio: float
    scale_radius_m: float
    prepared_with_adhesion: bool = False

    @property
    def length_m(self) -> float:
        """Length of the box along x."""
        return self.length_ratio * self.scale_radius_m

    @property
    def height_m(self) -> float:
        """Nominal height of the grains."""
        return self.height_ratio * self.scale_radius_m

    @property
    def width_m(self) -> float:
        """Width of the box along y, its period."""
        return self.width_ratio * self.scale_radius_m

    @property
    def area_m2(self) -> float:
        """Cross-section of the box at the shear plane."""
        return self.length_m * self.width_m


def n_grains(soil: Soil, specimen: Specimen) -> int:
    """Number of grains that fill the box to its nominal height."""
    return round(FILL_FRACTION * specimen.length_m * specimen.width_m * specimen.height_m / soil.grain_volume_m3)


def plane_stress_pa(soil: Soil, specimen: Specimen, gravity_m_s2: float) -> float:
    """Normal stress that the shear plane will carry: the lid's, and the weight of the upper half."""
    return specimen.normal_stress_pa + FILL_FRACTION * soil.density_kg_m3 * gravity_m_s2 * 0.5 * specimen.height_m


def stiffness_reduction(soil: Soil, specimen: Specimen, stiffness_number: float | None, gravity_m_s2: float) -> float:
    """By how much to soften the grains so that E* over the plane's normal stress is a number; never stiffer than they are.

    The same number at every stress gives the same relative overlaps, so softening does not bend the strength line; the soil's own
    weight counts, because a box that grows with its grains presses more than a small lid load, and so does adhesion. Forces press
    the more on the smaller spheres of a clump. None leaves the grains as they are.
    """
    if stiffness_number is None:
        return 1.0
    E_star = soil.shear_modulus_pa / (1.0 - soil.poisson_ratio)
    stress = (plane_stress_pa(soil, specimen, gravity_m_s2) + soil.contact_stress_pa) * soil.pressed_ratio
    return max(1.0, E_star / (stiffness_number * stress))


def inertial_time(soil: Soil, specimen: Specimen) -> float:
    """Time in s in which the pressure moves a grain by its diameter: d sqrt(rho / p)."""
    return 2.0 * soil.radius_m * math.sqrt(soil.density_kg_m3 / specimen.normal_stress_pa)


def rectangle(name, low_xz, high_xz, material="frame") -> Box:
    """A rectangle that spans the box in y."""
    return Box(name=name, material=material, low_m=(low_xz[0], -ENDLESS_M, low_xz[1]), high_m=(high_xz[0], ENDLESS_M, high_xz[1]))


def floor() -> Box:
    """The floor, endless in x and y."""
    return rectangle("floor", (-ENDLESS_M, 0.0), (ENDLESS_M, 0.0), "plate")


def lid(soil: Soil, specimen: Specimen, n_grains: int, height_m: float) -> Box:
    """Lid under a constant force; its mass is a tenth of the soil's, its damping critical for the soil's inertial time."""
    load = specimen.normal_stress_pa * specimen.area_m2
    mass = 0.1 * n_grains * soil.density_kg_m3 * 4.0 / 3.0 * math.pi * soil.radius_m**3
    drive = Drive(axis=2, applied_force_n=-load, mass_kg=mass, damping_kg_s=2.0 * mass / inertial_time(soil, specimen))
    plate = rectangle("lid", (-ENDLESS_M, height_m), (ENDLESS_M, height_m), "plate")
    return Box(name=plate.name, material=plate.material, low_m=plate.low_m, high_m=plate.high_m, drive=drive)


def filled(soil: Soil, specimen: Specimen, engine: Engine, seed: int, sides: list[Box], frame_static_friction=0.0) -> Simulation:
    """Box with dropped grains and the lid above them, at time 0; without sides it is periodic in x too."""
    grain, n, periodic = soil.softened(engine.stiffness_reduction), n_grains(soil, specimen), not sides
    region = BoxRegion(
        low_m=(0.0, 0.0), high_m=(specimen.length_m, specimen.width_m), bottom_m=0.0, periodic_x=periodic, periodic_y=True
    )
    simulation = Simulation(
        materials={"soil": grain, "frame": grain, "plate": grain},
        interactions={
            ("soil", "soil"): soil.interaction(),
            ("soil", "plate"): soil.interaction(),
            ("soil", "frame"): soil.interaction(frame_static_friction, 0.0),
        },
        walls=[floor(), *sides],
        period_m=(specimen.length_m if periodic else 0.0, specimen.width_m, 0.0),
        smallest_radius_m=soil.smallest_sphere_m,
        floor_m=-2.0 * soil.sizes.largest_m,
        **engine.options(soil),
    )
    simulation.add_factory(soil.factory(n, region, seed))
    simulation.add_wall(lid(soil, specimen, n, simulation.top_m))
    return simulation


def consolidation(simulation: Simulation, soil: Soil, specimen: Specimen) -> State:
    """The test at its beginning: the lid about to press the grains together, with the specimen's preparation friction."""
    for other in ("soil", "plate"):
        early = simulation.adhesion if specimen.prepared_with_adhesion else "none"
        simulation.set_interaction("soil", other, soil.prepared(specimen.preparation_friction_ratio, early))
    steps = steps_in(CONSOLIDATION_TIMES * inertial_time(soil, specimen), simulation)
    return State(simulation, "consolidate", steps, {"n_particles": len(soil.wholes(simulation.grains)), "lid_height_m": math.inf})


def consolidate(
    state: State, soil: Soil, each: Callable[[Simulation, str], None] | None, keep: Callable[[State], None] | None
) -> None:
    """Run the rest of the consolidation; each, keep : as in the tests' `run`."""

    def look(current: State) -> bool:
        if each is not None:
            each(current.simulation, current.stage)
        return lid_is_still(current, soil.radius_m)

    state.go_on(look, keep)


def lid_height_m(simulation: Simulation) -> float:
    """Height of the lid's lower face."""
    return cast(Box, simulation.wall("lid")).low_m[2]


def lid_is_still(state: State, radius_m: float) -> bool:
    """True if the lid has stopped moving since the last look."""
    height, last = lid_height_m(state.simulation), state.notes["lid_height_m"]
    state.notes["lid_height_m"] = height
    return abs(height - last) < STILL_RATIO * radius_m and state.simulation.n_steps > CONSOLIDATION_STEPS


def roughen(simulation: Simulation, soil: Soil) -> float:
    """Glue the outermost layers to floor and lid, and give the grains their own friction; returns the lid's height in m."""
    for other in ("soil", "plate"):
        simulation.set_interaction("soil", other, soil.interaction(adhesion=simulation.adhesion))
    grains = simulation.grains
    top, height = lid_height_m(simulation), grains.positions_m[:, 2]
    reach = glue_reach_m(soil, grains)
    simulation.glue(np.flatnonzero(height < reach), "floor")
    simulation.glue(np.flatnonzero(height > top - reach), "lid")
    return top


def glue_reach_m(soil: Soil, spheres: Grains) -> np.ndarray:
    """Distance of every sphere's centre from a plate below which its grain is glued to the plate, (n,)."""
    return spheres.radii_m + GLUE_REACH_RATIO * soil.wholes(spheres).radii_m[soil.owners(spheres)]


def weight_above_n(simulation: Simulation, soil: Soil, height_m: float) -> float:
    """Weight of the grains above a height."""
    grains = soil.wholes(simulation.grains)
    cubes = float((grains.radii_m[grains.positions_m[:, 2] > height_m] ** 3).sum())
    return 4.0 / 3.0 * math.pi * simulation.materials["soil"].density_kg_m3 * cubes * -simulation.gravity_m_s2[2]


def solid_fraction(grains: Grains, specimen: Specimen, height_m: float) -> float:
    """Volume of the grains (`Soil.wholes`) over that of the box up to a height."""
    return 4.0 / 3.0 * math.pi * float((grains.radii_m**3).sum()) / (specimen.area_m2 * height_m)
