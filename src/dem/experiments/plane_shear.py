"""Plane shear test: a bed without side walls is sheared between a rough floor and a rough lid to any strain.

The box is periodic in x and y: nothing but the soil resists, and the strain has no end, so one run gives the peak and the steady
(critical-state) strength. The floor moves along +x at constant speed; the lid rests on the soil under a constant force and rises as
the soil dilates. Floor and lid are rough by the grains glued to them (see `dem.experiments.specimen`). There is no gravity, so that
the normal stress is the lid's everywhere.

A run goes on until its strength is steady (see `dem.experiments.strength`), or to the largest strain, and then says so.

Signs: `shear_force_n` is what the soil does to the floor along -x, positive when it resists.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from dem import Grains, Rich, Simulation, SimulationError
from dem.experiments.soil import Engine, Soil, energy_balance
from dem.experiments.specimen import (
    Specimen,
    consolidate,
    consolidation,
    filled,
    lid_height_m,
    roughen,
    solid_fraction,
)
from dem.experiments.state import State
from dem.experiments.strength import LEAST_SAMPLES, steady

#: Samples per unit of shear strain, and strain between two looks whether the strength is steady.
SAMPLES_PER_STRAIN, LOOK_STRAIN = 50, 0.5
#: Layers over the height in which the velocity is averaged.
N_LAYERS = 10


@dataclass(frozen=True, kw_only=True)
class Setup(Specimen):
    """Geometry and protocol; ratios are over scale_radius_m.

    shear_strain, max_shear_strain: displacement of the floor over the height of the bed before shearing, at which the test may end
    if the strength is steady, and at which it ends. The inertial number I sets the shear rate: U / h = I / (d sqrt(rho/p)).
    """

    shear_strain: float
    max_shear_strain: float
    inertial_number: float


@dataclass(frozen=True)
class PlaneShear(Rich):
    """Results of the test: time series, grains before and after, counts. See `record` for the series' names.

    status: "steady", or "unsteady" if the strength still changed at the largest strain. velocity_profile (N_LAYERS,): mean velocity
    of equally thick layers along x over that of the floor, from the floor up, after half of shear_strain; nan where there were no
    grains.
    """

    status: str
    history: dict[str, np.ndarray]
    before: Grains
    after: Grains
    n_particles: int
    n_steps: int
    simulated_time_s: float
    solid_fraction: float
    velocity_profile: np.ndarray
    max_overlap_ratio: float
    energy_dissipated_j: float = math.nan
    energy_residual_ratio: float = math.nan

    @property
    def localisation(self) -> float:
        """Largest shear rate between two layers over the mean; 1 for homogeneous shear, N_LAYERS - 1 for one plane of slip."""
        return float(np.nanmax(-np.diff(self.velocity_profile)) * (N_LAYERS - 1))


def shear_rate(soil: Soil, setup: Setup) -> float:
    """Shear rate in 1/s at which the inertial number is the wanted one."""
    return setup.inertial_number / (2.0 * soil.radius_m) * math.sqrt(setup.normal_stress_pa / soil.density_kg_m3)


def build(soil: Soil, setup: Setup, engine: Engine, seed: int) -> Simulation:
    """Box with grains on a loose lattice and the lid above them, at time 0, without gravity."""
    return filled(soil, setup, replace(engine, gravity_m_s2=0.0), seed, sides=[])


def start(soil: Soil, setup: Setup, engine: Engine, seed: int) -> State:
    """The test at its beginning: the lid about to press the grains together."""
    return consolidation(build(soil, setup, engine, seed), soil, setup)


def record(simulation: Simulation, soil: Soil, setup: Setup, displacement: float, height: float) -> dict[str, float]:
    """One sample. The normal stress is what the soil does to the lid."""
    force, top = simulation.mean_wall_forces_n, lid_height_m(simulation)
    shear_force = -force["floor"][0]
    return {
        "time_s": simulation.time_s,
        "displacement_m": displacement,
        "shear_strain": displacement / height,
        "shear_force_n": shear_force,
        "shear_stress_pa": shear_force / setup.area_m2,
        "applied_normal_stress_pa": setup.normal_stress_pa,
        "plane_normal_stress_pa": force["lid"][2] / setup.area_m2,
        "lid_height_m": top,
        "solid_fraction": solid_fraction(soil.wholes(simulation.grains), setup, top),
    }


def layer_velocities(simulation: Simulation) -> np.ndarray:
    """Sum of the velocities along x and number of grains in each layer, (2, N_LAYERS)."""
    grains = simulation.grains
    layer = np.clip(N_LAYERS * grains.positions_m[:, 2] / lid_height_m(simulation), 0, N_LAYERS - 1).astype(int)
    return np.array(
        [
            np.bincount(layer, weights=grains.velocities_m_s[:, 0], minlength=N_LAYERS),
            np.bincount(layer, minlength=N_LAYERS),
        ]
    )


def sample_steps(soil: Soil, setup: Setup, simulation: Simulation) -> int:
    """Steps between two samples."""
    return max(1, math.ceil(1.0 / SAMPLES_PER_STRAIN / shear_rate(soil, setup) / simulation.time_step_s))


def shear(state: State, soil: Soil, setup: Setup) -> None:
    """Make floor and lid rough, remember the grains, and have the floor move from now on."""
    simulation = state.simulation
    top = roughen(simulation, soil)
    state.notes |= {
        "top_m": top,
        "start_time_s": simulation.time_s,
        "samples": [],
        "layers": np.zeros((2, N_LAYERS)),
        "max_overlap_ratio": 0.0,
    }
    state.note_grains("before", simulation.grains)
    simulation.move_wall("floor", (shear_rate(soil, setup) * top, 0.0, 0.0))
    state.begin("strain", math.ceil(SAMPLES_PER_STRAIN * setup.max_shear_strain) * sample_steps(soil, setup, simulation))


def is_steady(samples: list[dict[str, float]]) -> bool:
    """True if the strength recorded so far is steady; so short a curve that it cannot be told is not."""
    if len(samples) < LEAST_SAMPLES:
        return False
    curve = ([sample[name] for sample in samples] for name in ("shear_strain", "shear_stress_pa", "plane_normal_stress_pa"))
    return steady(*curve).steady


def may_end(samples: list[dict[str, float]], setup: Setup) -> bool:
    """True at the looks from shear_strain on at which the strength is steady."""
    beyond = len(samples) - math.ceil(SAMPLES_PER_STRAIN * setup.shear_strain)
    return beyond >= 0 and beyond % round(SAMPLES_PER_STRAIN * LOOK_STRAIN) == 0 and is_steady(samples)


def run(
    soil: Soil,
    setup: Setup,
    engine: Engine,
    seed: int,
    each: Callable[[Simulation, str], None] | None = None,
    *,
    state: State | None = None,
    keep: Callable[[State], None] | None = None,
) -> PlaneShear:
    """Consolidate, shear until steady, and return the record; or finish a test that was interrupted in a state.

    `each` and `keep` as in `dem.experiments.direct_shear.run`. A run that goes on from a state ends as it would have without the
    interruption, bit for bit.

    Raises
    ------
    dem.SimulationError : the run blew up, or grains leaked out of the box.
    """
    state = start(soil, setup, engine, seed) if state is None else state
    simulation = state.simulation

    def sampling(current):
        notes = current.notes
        displacement = shear_rate(soil, setup) * notes["top_m"] * (simulation.time_s - notes["start_time_s"])
        notes["samples"].append(record(simulation, soil, setup, displacement, notes["top_m"]))
        if displacement > 0.5 * setup.shear_strain * notes["top_m"]:
            notes["layers"] = np.asarray(notes["layers"]) + layer_velocities(simulation)
        notes["max_overlap_ratio"] = max(notes["max_overlap_ratio"], simulation.largest_overlap_ratio())
        if each is not None:
            each(simulation, "strain")
        if simulation.n_left:
            raise SimulationError(f"{simulation.n_wholes_left} grains leaked out of the plane shear cell")
        return may_end(notes["samples"], setup)

    if state.stage == "consolidate":
        consolidate(state, soil, each, keep)
        shear(state, soil, setup)
    ended = state.go_on(sampling, keep, sample_steps(soil, setup, simulation))
    notes, before = state.notes, state.noted_grains("before")
    samples, (sums, counts) = notes["samples"], np.asarray(notes["layers"])
    floor_m_s = shear_rate(soil, setup) * notes["top_m"]
    return PlaneShear(
        status="steady" if ended or is_steady(samples) else "unsteady",
        history={name: np.array([sample[name] for sample in samples]) for name in samples[0]},
        before=before,
        after=simulation.grains,
        n_particles=notes["n_particles"],
        n_steps=simulation.n_steps,
        simulated_time_s=simulation.time_s,
        solid_fraction=solid_fraction(soil.wholes(before), setup, notes["top_m"]),
        velocity_profile=np.divide(sums, counts * floor_m_s, out=np.full(N_LAYERS, np.nan), where=counts > 0),
        max_overlap_ratio=notes["max_overlap_ratio"],
        **energy_balance(simulation, engine),
    )
