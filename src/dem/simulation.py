"""The simulation a user holds: grains, walls, materials, and a clock that `run` moves on.

Frame and signs: z up; overlap positive when grains touch; forces on walls are those that the grains exert.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import cast

import numpy as np

from dem import compiled, ledger
from dem.factory import Factory
from dem.html import Rich, table
from dem.jit import MAX_THREADS, set_num_threads
from dem.layout import (
    BLOCK,
    BUFFER,
    CONSTANTS,
    FREE,
    INVERSE_MASS,
    LOAD,
    MOTION,
    PLACE,
    RADIUS,
    SPEEDS,
    UX,
    VX,
    GrainArrays,
    aligned_zeros,
)
from dem.lists.blocks import LINE
from dem.lists.grid import cell_size, is_sound, sort_into_cells
from dem.lists.pairs import deepest_overlap
from dem.lists.slabs import GRAINS_PER_SLAB, SLABS, most_slabs
from dem.material import DAMPING_MODELS, Interaction, Material, pair_constants, require
from dem.step import loop
from dem.step.motion import kinetic_energy
from dem.step.schedule import GROUPS, STEPS_AT_ONCE
from dem.timestep import stable_time_step
from dem.walls import Wall, distance_to, from_arrays, to_arrays

#: Stands in for zero in m, N and rad, so that no division is by zero; its square root and square are float32 numbers too.
TINY = 1e-18

#: Stands in for no lower bound of the normal force (N).
NO_BOUND = -1e30

#: Neighbour skin in mean grain radii: rebuilding costs as much as pruning near this value.
SKIN_RATIO = 0.55
#: In a narrow periodic domain the skin is smaller, so that no grain sees two images of another.
LEAST_SKIN_RATIO = 0.2

#: Room in the lists to begin with; they grow when needed. Contacts are the outer list's entries that may touch soon.
PAIRS_PER_GRAIN, CONTACT_SHARE, WALL_PAIRS_PER_GRAIN = 5.2, 0.8, 0.5

#: From so many grains on (the first-level cache is full), they are sorted in space every so many steps.
SORT_FROM, SORT_STEPS = 1000, 5000

#: New grains may overlap by this fraction of a radius at most: more would throw them apart.
LARGEST_OVERLAP_RATIO = 0.05

#: A grain that crosses more than this fraction of its radius in one step has been thrown out by an unstable contact.
LARGEST_STEP_RATIO = 0.2


class SimulationError(RuntimeError):
    """The simulation cannot go on: it blew up or was set up impossibly."""


@dataclass(frozen=True)
class Grains(Rich):
    """A copy of the grains' state: positions_m and velocities_m_s (n, 3), angular_velocities_rad_s (n, 3), radii_m (n,)."""

    positions_m: np.ndarray
    velocities_m_s: np.ndarray
    angular_velocities_rad_s: np.ndarray
    radii_m: np.ndarray

    def __len__(self):
        return len(self.radii_m)

    def __repr__(self):
        return f"Grains({len(self)} grains)"


class Simulation:
    """Spheres and walls under gravity.

    Parameters
    ----------
    materials : name -> Material.
    interactions : (name, name) -> Interaction, one for every pair of materials that can meet; order does not matter.
    walls : rigid geometry.
    gravity_m_s2 : acceleration vector.
    period_m : period along x, y, z; 0 where not periodic.
    time_step_rayleigh_ratio : time step over the smallest grain's Rayleigh time.
    smallest_radius_m : radius that sets the time step (every factory's grains must be at least as large).
    rolling_model : "type_a" (EDEM's) or "type_c" (elastic-plastic), see `dem.contact.laws.rolling`.
    damping_model : "edem" (at separation the dashpot pulls) or "no_pull", see `dem.contact.laws.hertz`; both rebound with e.
    precision : "float32" or "float64" of the contact arithmetic; positions are float64 always, velocities have 48 bits at least.
    vector_code : whether the hottest kernels run as explicit vector code (`dem.step.vectors`) or as plain numba.
    threads : on how many threads this simulation runs (worth it from some 20 000 grains on; the result is the same).
    floor_m : grains below this height leave the simulation.
    energy_ledger : whether every step is booked in `energies_j` (see `dem.ledger`); steps then take several times as long.
    """

    def __init__(
        self,
        *,
        materials: dict[str, Material],
        interactions: dict[tuple[str, str], Interaction],
        smallest_radius_m: float,
        walls: list[Wall] | tuple[Wall, ...] = (),
        gravity_m_s2: tuple[float, float, float] = (0.0, 0.0, -9.81),
        period_m: tuple[float, float, float] = (0.0, 0.0, 0.0),
        time_step_rayleigh_ratio: float = 0.2,
        rolling_model: str = "type_a",
        damping_model: str = "edem",
        precision: str = "float32",
        vector_code: bool = True,
        threads: int = 1,
        floor_m: float = -math.inf,
        energy_ledger: bool = False,
    ):
        require(rolling_model in ("type_a", "type_c"), "rolling_model", repr(rolling_model), "type_a or type_c")
        require(damping_model in DAMPING_MODELS, "damping_model", repr(damping_model), f"one of {list(DAMPING_MODELS)}")
        require(precision in ("float32", "float64"), "precision", repr(precision), "float32 or float64")
        require(0 < smallest_radius_m < math.inf, "smallest_radius_m", smallest_radius_m, "a positive number")
        require(bool(np.isfinite(gravity_m_s2).all()), "gravity_m_s2", gravity_m_s2, "three finite numbers")
        periods = np.asarray(period_m, float)
        require(bool((np.isfinite(periods) & (periods >= 0)).all()), "period_m", period_m, "lengths, 0 where not periodic")
        require(not math.isnan(floor_m), "floor_m", floor_m, "a height, or -inf")
        require(1 <= threads <= MAX_THREADS, "threads", threads, f"1 to {MAX_THREADS}")
        self.materials = dict(materials)
        self._settings = {
            "smallest_radius_m": smallest_radius_m, "gravity_m_s2": list(gravity_m_s2), "period_m": list(period_m),
            "time_step_rayleigh_ratio": time_step_rayleigh_ratio, "rolling_model": rolling_model, "damping_model": damping_model,
            "precision": precision, "vector_code": vector_code, "threads": threads, "floor_m": floor_m,
            "energy_ledger": energy_ledger,
        }  # fmt: skip
        self._damping_model = damping_model
        self._material_index = {name: k for k, name in enumerate(materials)}
        self._pair_table = np.full((len(materials) ** 2, 5), np.nan)
        for pair, interaction in interactions.items():
            self.set_interaction(*pair, interaction)
        self.smallest_radius_m = smallest_radius_m
        self.time_step_s = min(
            stable_time_step(smallest_radius_m, material, time_step_rayleigh_ratio) for material in materials.values()
        )
        self._type = np.dtype(precision).type
        least = 0.0 if damping_model == "no_pull" else NO_BOUND
        self._constants = loop.Constants(
            self.time_step_s, *(self._type(value) for value in (self.time_step_s, 1.0, 0.0, TINY, least))
        )
        self._threads, self._parallel = threads, None if threads == 1 else True
        self.gravity_m_s2 = tuple(gravity_m_s2)
        self._gravity = np.asarray(gravity_m_s2, float)
        self._period = np.asarray(period_m, float)
        self._options = loop.Options(vector_code, rolling_model == "type_c", bool((self._period > 0).any()))
        self._n_history = 6 if self._options.elastic_rolling else 3
        self._floor = floor_m
        self._entries = np.zeros(len(ledger.ENTRIES)) if energy_ledger else None
        self._exchanged_j = 0.0
        self._wall_definitions: list[Wall] = []
        self._walls = to_arrays([], self._material_index)
        self._factories: list[Factory] = []
        self.time_s = 0.0
        self.n_steps = 0
        self.n_left = 0
        compiled.ensure(precision, threads > 1, energy_ledger)
        self.mean_wall_forces_n: dict[str, np.ndarray] = {}
        self._speeds = np.zeros((STEPS_AT_ONCE, SLABS))
        self._allocate(GrainArrays(np.zeros(0), np.zeros(0), np.zeros(0)), np.zeros(0, np.int64), np.zeros(0, np.int64))
        self._glued = np.zeros(0, np.int64)
        self._carrier = np.zeros(0, np.int64)
        for wall in walls:
            self.add_wall(wall)

    # --- setting up -----------------------------------------------------------------------------------------------

    def set_interaction(self, a: str, b: str, interaction: Interaction) -> None:
        """Change how two materials interact from now on; contacts keep their history."""
        names = list(self.materials)
        for name in (a, b):
            require(name in names, "material of an interaction", repr(name), f"one of {names}")
        i, j = names.index(a), names.index(b)
        row = pair_constants(self.materials[a], self.materials[b], interaction, self._damping_model)
        self._pair_table[[i * len(names) + j, j * len(names) + i]] = row

    def add_wall(self, wall: Wall) -> None:
        """Put one more wall into the simulation; its name must be new and its material known."""
        require(wall.material in self.materials, f"material of wall {wall.name!r}", wall.material, f"one of {list(self.materials)}")
        require(wall.name not in self.wall_names, "wall name", repr(wall.name), "a name that no other wall has")
        for definition, w in zip(self._wall_definitions, range(len(self._wall_definitions)), strict=True):
            self._wall_definitions[w] = from_arrays(definition, self._walls, w)
        self._wall_definitions.append(wall)
        self._walls = to_arrays(self._wall_definitions, self._material_index)
        self._wall_contacts = self._new_contacts(*self._wall_room(len(self._wall_pairs.partner)))
        self._list_age[0] = loop.LISTS_STALE

    def remove_wall(self, name: str) -> None:
        """Take a wall away; contacts with the others keep their history."""
        gone = self._wall_index(name)
        kept = [w for w in range(len(self._wall_definitions)) if w != gone]
        self._wall_definitions = [from_arrays(self._wall_definitions[w], self._walls, w) for w in kept]
        self._walls = to_arrays(self._wall_definitions, self._material_index)
        require(gone not in self._carrier, "wall to remove", repr(name), "a wall that carries no glued grains")
        self._carrier = np.where(self._carrier > gone, self._carrier - 1, self._carrier)
        partner = self._wall_pairs.partner
        partner[:] = np.where(partner > gone, partner - 1, np.where(partner == gone, -1, partner))
        self._list_age[0] = loop.LISTS_STALE

    @property
    def wall_names(self) -> list[str]:
        """Names of the walls, in the order in which they were added."""
        return [wall.name for wall in self._wall_definitions]

    def _wall_index(self, name: str) -> int:
        require(name in self.wall_names, "wall", repr(name), f"one of {self.wall_names}")
        return self.wall_names.index(name)

    def wall(self, name: str) -> Wall:
        """The wall as it stands now."""
        w = self._wall_index(name)
        return from_arrays(self._wall_definitions[w], self._walls, w)

    def move_wall(self, name: str, velocity_m_s: tuple[float, float, float]) -> None:
        """Give a wall a new prescribed velocity."""
        require(bool(np.isfinite(velocity_m_s).all()), f"velocity of wall {name!r}", velocity_m_s, "three finite numbers")
        self._walls.velocity[self._wall_index(name)] = velocity_m_s

    def add_factory(self, factory: Factory) -> None:
        """Have a factory make its grains when the clock reaches its time."""
        require(factory.material in self.materials, "material of a factory", factory.material, f"one of {list(self.materials)}")
        require(
            factory.sizes.smallest_m >= self.smallest_radius_m * (1 - 1e-12),
            "smallest radius of a factory",
            factory.sizes.smallest_m,
            f"at least smallest_radius_m = {self.smallest_radius_m}, which sets the time step",
        )
        self._factories.append(factory)
        self._run_factories()

    def _run_factories(self) -> None:
        due = [factory for factory in self._factories if factory.time_s <= self.time_s]
        self._factories = [factory for factory in self._factories if factory.time_s > self.time_s]
        for factory in due:
            positions, radii = factory.make()
            self._add(positions, radii, factory.material, factory.velocity_m_s, apart=self.n_grains == 0)

    def add_grains(
        self, positions_m, radii_m, material: str, velocities_m_s=(0.0, 0.0, 0.0), angular_velocities_rad_s=(0.0, 0.0, 0.0)
    ):
        """Add n grains at rest or moving.

        Parameters
        ----------
        positions_m : (n, 3). radii_m : (n,) or a number. velocities_m_s, angular_velocities_rad_s : (3,) or (n, 3).

        Raises
        ------
        ValueError : non-finite values, a radius below smallest_radius_m, an unknown material, grains that overlap each other, that
            stand in a wall, or that are below floor_m.
        """
        self._add(positions_m, radii_m, material, velocities_m_s, angular_velocities_rad_s)

    def _add(self, positions_m, radii_m, material, velocities_m_s, angular_velocities_rad_s=(0.0, 0.0, 0.0), apart=False):
        """As `add_grains`; apart: the new grains are known not to touch each other, nor others."""
        positions = np.atleast_2d(np.asarray(positions_m, float))
        n = len(positions)
        radii = np.broadcast_to(np.asarray(radii_m, float), n)
        velocities, spins = np.asarray(velocities_m_s, float), np.asarray(angular_velocities_rad_s, float)
        named = {"positions_m": positions, "radii_m": radii, "velocities_m_s": velocities, "angular_velocities_rad_s": spins}
        for name, values in named.items():
            require(bool(np.isfinite(values).all()), name, "not finite", "finite numbers")
        if n:
            least = self.smallest_radius_m * (1 - 1e-12)
            require(radii.min() >= least, "smallest radius", radii.min(), f"at least smallest_radius_m = {self.smallest_radius_m}")
        require(material in self.materials, "material of grains", repr(material), f"one of {list(self.materials)}")
        self._check_places(positions, radii, apart)
        place, motion, remainder = np.zeros((n, PLACE)), np.zeros((n, MOTION)), np.zeros((n, MOTION))
        place[:, 0:3], place[:, RADIUS] = positions, radii
        motion[:, VX : VX + 3], motion[:, UX : UX + 3] = velocities, spins * radii[:, None]
        remainder[:, SPEEDS] = (motion - motion.astype(self._type))[:, SPEEDS]
        mass = self.materials[material].density_kg_m3 * 4.0 / 3.0 * np.pi * radii**3
        remainder[:, INVERSE_MASS], remainder[:, FREE] = 1.0 / mass, 1.0
        new = GrainArrays(place, motion, remainder)
        self._restructure(np.arange(self.n_grains), new, np.full(n, self._material_index[material]))

    def _check_places(self, positions, radii, apart) -> None:
        """Refuse new grains that stand in each other or in those that are there (unless `apart`), in a wall, or below the floor."""
        allowed = f"at most {LARGEST_OVERLAP_RATIO} of the smaller radius"
        if not apart:
            everywhere = np.concatenate([self._places[:, 0:3], positions])
            every_radius = np.concatenate([self._places[:, RADIUS], radii])
            i, j, depth = overlaps(everywhere, every_radius, self._period)
            ratios = np.where(j >= self.n_grains, depth / np.minimum(every_radius[i], every_radius[j]), 0.0)
            for k in np.flatnonzero(ratios == ratios.max(initial=0.0))[:1]:
                found = f"{ratios[k]:.3g} of a radius"
                require(ratios[k] <= LARGEST_OVERLAP_RATIO, f"overlap of grains {i[k]} and {j[k]}", found, allowed)
        for name in self.wall_names if len(positions) else ():
            ratios = 1.0 - distance_to(self.wall(name), positions) / radii
            k = int(np.argmax(ratios))
            outside = f"grain {k} at {positions[k].tolist()} in wall {name!r}: its overlap"
            require(ratios[k] <= LARGEST_OVERLAP_RATIO, outside, f"{ratios[k]:.3g} of a radius", allowed)
        if len(positions):
            k = int(np.argmin(positions[:, 2]))
            require(positions[k, 2] >= self._floor, f"height of grain {k}", positions[k, 2], f"at least floor_m = {self._floor}")

    def glue(self, grain_indices, wall: str) -> None:
        """Fix grains to a wall: they move with it, and what pushes them pushes the wall."""
        indices = np.argsort(self._ids)[np.unique(np.asarray(grain_indices, np.int64))]
        w = self._wall_index(wall)
        remainder, held_j = self._grains.remainder.reshape(-1, MOTION), self._held_by_grains_j()
        remainder[indices, INVERSE_MASS] = 0.0
        remainder[indices, FREE] = 0.0
        self._exchanged_j += self._held_by_grains_j() - held_j
        self._glued = np.concatenate([self._glued, indices])
        self._carrier = np.concatenate([self._carrier, np.full(len(indices), w, np.int64)])
        self._list_age[0] = loop.LISTS_STALE

    # --- arrays ---------------------------------------------------------------------------------------------------

    @property
    def _places(self) -> np.ndarray:
        return self._grains.place.reshape(-1, PLACE)

    @property
    def _velocities(self) -> np.ndarray:
        """Velocities and spin velocities (n, 6), a copy in float64."""
        return (self._grains.motion.astype(float) + self._grains.remainder).reshape(-1, MOTION)[:, SPEEDS]

    @property
    def _inverse_masses(self) -> np.ndarray:
        return self._grains.remainder.reshape(-1, MOTION)[:, INVERSE_MASS].astype(float)

    @property
    def _free(self) -> np.ndarray:
        return self._grains.remainder.reshape(-1, MOTION)[:, FREE] > 0

    @property
    def n_grains(self) -> int:
        """How many grains there are now."""
        return len(self._places)

    def _allocate(self, grains, material, ids):
        n, types = len(ids), (float, self._type, self._type)
        self._grains = GrainArrays(*(aligned_zeros(values.size, types[k], k) for k, values in enumerate(grains)))
        for own, values in zip(self._grains, grains, strict=True):
            own[:] = values.ravel()
        self._material, self._ids = material, ids
        self._loads = aligned_zeros(n * LOAD, self._type, 3)
        n_buffers = 1 if self._threads == 1 else GROUPS // 2
        # anew each time, as a copied simulation's begin at no cache line: that costs 8 % of the speed
        self._buffers = aligned_zeros(n_buffers * BUFFER * BLOCK, self._type).reshape(n_buffers, -1)
        capacity = int(n * PAIRS_PER_GRAIN) + 64
        self._pairs, self._spare, self._contacts = self._new_lists(n, capacity, contact_room(n, CONTACT_SHARE * capacity), SLABS)
        capacity = int(n * WALL_PAIRS_PER_GRAIN) + 64
        self._wall_pairs, self._wall_spare, self._wall_contacts = self._new_lists(n, capacity, *self._wall_room(capacity))
        self._origin = np.zeros((n, 3))
        self._list_age = np.full(2, loop.LISTS_STALE)

    def _new_lists(self, n, capacity, room, n_parts):
        """Outer list and its spare, room for so many entries; contacts as `_new_contacts`."""
        lists = [
            loop.OuterList(
                row=np.zeros((n, 2), np.int64),
                owner=np.zeros(capacity, np.int32),
                partner=np.zeros(capacity, np.int32),
                history=np.zeros((capacity, self._n_history), self._type),
                order=np.zeros(n, np.int64),
                slab=np.zeros(SLABS + 1, np.int64),
            )
            for _ in range(2)
        ]
        return (*lists, self._new_contacts(room, n_parts))

    def _new_contacts(self, room, n_parts):
        """Room for so many contacts, in so many slabs or with so many walls."""
        contacts = loop.Contacts(
            first=np.zeros(room, np.int32),
            second=np.zeros(room, np.int32),
            slot=np.zeros(room, np.int32),
            constants=aligned_zeros(room * CONSTANTS, self._type).reshape(-1, CONSTANTS * BLOCK),
            history=aligned_zeros(room * self._n_history, self._type).reshape(-1, self._n_history * BLOCK),
            begin=np.zeros(n_parts + 1, np.int64),
            count=np.zeros(n_parts, np.int64),
            common=aligned_zeros(CONSTANTS * BLOCK, self._type).reshape(1, -1),
            alike=np.zeros(1, np.int64),
        )
        contacts.begin[n_parts] = room
        return contacts

    def _wall_room(self, capacity):
        """Room for the contacts of an outer list of so many entries with all walls, and the number of their parts."""
        n_parts = len(self._wall_definitions) * most_slabs(self.n_grains)
        return contact_room(0, capacity + LINE * n_parts), n_parts

    def _lengthen(self, reason):
        """Give the list that was too short more room, so that the run can go on."""
        self._list_age[0] = loop.LISTS_STALE
        if reason == loop.WALL_PAIRS_FULL:
            old = self._wall_pairs
            capacity = int(1.5 * len(old.partner)) + 128
            lists = self._new_lists(self.n_grains, capacity, *self._wall_room(capacity))
            self._wall_pairs, self._wall_spare, self._wall_contacts = lists
            loop.copy_list(old, self._wall_pairs)
            return
        old, capacity, room = self._pairs, len(self._pairs.partner), len(self._contacts.first)
        if reason == loop.PAIRS_FULL:
            capacity = int(1.3 * capacity) + 128
        lists = self._new_lists(self.n_grains, capacity, contact_room(self.n_grains, 1.3 * room), SLABS)
        self._pairs, self._spare, self._contacts = lists
        loop.copy_list(old, self._pairs)

    def _restructure(self, selected, new_grains=None, new_material=()):
        """Keep the grains of the given numbers, in that order, and append others; contacts keep their history."""
        old_pairs, old_walls, held_j = self._pairs, self._wall_pairs, self._held_by_grains_j()
        next_id = self._ids.max(initial=-1) + 1
        n_old, n_new = self.n_grains, len(new_material)
        kept = [values.reshape(n_old, -1)[selected] for values in self._grains] if n_old else []
        self._allocate(
            GrainArrays(*(np.concatenate(parts) for parts in zip(*(part for part in (kept, new_grains) if part), strict=True))),
            np.concatenate([self._material[selected], np.asarray(new_material, np.int64)]),
            np.concatenate([self._ids[selected], next_id + np.arange(n_new)]),
        )
        number = np.full(n_old, -1)
        number[selected] = np.arange(len(selected))
        for name, old, partner_number, reason in (
            ("_pairs", old_pairs, number, loop.PAIRS_FULL),
            ("_wall_pairs", old_walls, None, loop.WALL_PAIRS_FULL),
        ):
            row, partner, history = renumber_list(old, number, partner_number, self.n_grains)
            while len(partner) > len(getattr(self, name).partner):
                self._lengthen(reason)
            target = getattr(self, name)
            target.row[:] = row
            target.partner[: len(partner)] = partner
            target.history[: len(partner)] = history
        self._exchanged_j += self._held_by_grains_j() - held_j
        stays = number[self._glued] >= 0
        self._carrier = self._carrier[stays]
        self._glued = number[self._glued[stays]]

    def _sort_in_space(self):
        """Put neighbours next to each other in memory: out of the cache this halves the cost of a step."""
        order = np.zeros(self.n_grains, np.int64)
        if is_sound(self._grains):
            sort_into_cells(self._grains, self._period, cell_size(self._grains, self._skin), order)
            self._restructure(order)

    # --- running --------------------------------------------------------------------------------------------------

    def advance(self, n_steps: int) -> None:
        """Make n_steps time steps, then let grains leave, check for blow-up and run due factories.

        Raises
        ------
        SimulationError : a grain moves so fast, or stands so oddly, that the state is worthless.
        """
        self._check_ready()
        forces = np.zeros((len(self._wall_definitions), 3))
        remaining = n_steps
        while remaining:
            large = self.n_grains >= SORT_FROM
            if large and self.n_steps % SORT_STEPS == 0:
                self._sort_in_space()
            chunk = min(remaining, SORT_STEPS - self.n_steps % SORT_STEPS) if large else remaining
            forces += self._steps(chunk) * chunk
            self.n_steps += chunk
            self.time_s += chunk * self.time_step_s
            remaining -= chunk
        self.mean_wall_forces_n = dict(zip(self.wall_names, forces / max(n_steps, 1), strict=True))
        self._let_grains_leave()
        self._run_factories()

    def _steps(self, n_steps):
        """Run the kernels for n_steps; returns the mean force of the grains on every wall."""
        remaining, forces = n_steps, np.zeros((len(self._wall_definitions), 3))
        while remaining:
            mean_force = np.zeros_like(forces)
            if self._parallel:
                set_num_threads(self._threads)
            reason, done, _, _ = loop.advance(
                self._grains, self._material, self._loads, self._walls,
                self._pairs, self._wall_pairs, self._spare, self._wall_spare, self._contacts, self._wall_contacts,
                self._pair_table, len(self.materials), self._glued, self._carrier, self._gravity, self._period, self._buffers,
                self._speeds, self._constants,
                self.time_step_s, self._skin, self._speed_limit, remaining, self._options, self._origin, self._list_age,
                mean_force, self._parallel, self._ledger(),
            )  # fmt: skip
            forces += mean_force * done
            remaining -= done
            if reason == loop.BLEW_UP:
                self._raise_blow_up()
            if reason != loop.FINISHED:
                self._lengthen(reason)
        return forces / max(n_steps, 1)

    def _ledger(self):
        if self._entries is None:
            return None
        notes = (np.empty((len(contacts.first), ledger.NOTES)) for contacts in (self._contacts, self._wall_contacts))
        return ledger.Ledger(self._entries, *notes)

    @property
    def _skin(self) -> float:
        radii = self._places[:, RADIUS]
        if not self.n_grains:
            return SKIN_RATIO * self.smallest_radius_m
        periods = self._period[self._period > 0]
        widest = 0.49 * periods.min() - 2.0 * radii.max() if len(periods) else math.inf
        return float(np.clip(widest, LEAST_SKIN_RATIO * radii.mean(), SKIN_RATIO * radii.mean()))

    def _check_ready(self):
        names, present = list(self.materials), np.unique(self._material).tolist()
        used = {(a, b) for a in present for b in (*present, *self._walls.material.tolist())}
        for a, b in used:
            missing = np.isnan(self._pair_table[a * len(names) + b, 0])
            require(
                not missing,
                f"interaction of {names[a]!r} with {names[b]!r}",
                "missing",
                "an Interaction for every pair that can meet",
            )
        if self.n_grains:
            reach = 2.0 * (2.0 * self._places[:, RADIUS].max() + self._skin)
            for axis, period in zip("xyz", self._period, strict=True):
                allowed = f"0 or more than {reach:.3g}, or a grain could touch two images of another"
                require(period == 0 or period > reach, f"period_m along {axis}", period, allowed)

    @property
    def _speed_limit(self) -> float:
        return LARGEST_STEP_RATIO * self.smallest_radius_m / self.time_step_s

    def _raise_blow_up(self):
        velocities = self._velocities
        if not (np.isfinite(velocities).all() and np.isfinite(self._places).all()):
            raise SimulationError(f"blew up: a grain's state is not finite after t = {self.time_s:.4g} s")
        speed = np.linalg.norm(velocities[:, :3], axis=1)
        k = int(np.argmax(speed))
        raise SimulationError(
            f"blew up: grain {k} moves at {speed[k]:.3g} m/s after t = {self.time_s:.4g} s, "
            f"more than {LARGEST_STEP_RATIO} of a radius in one step ({self._speed_limit:.3g} m/s)"
        )

    def _let_grains_leave(self):
        stays = self._places[:, 2] >= self._floor
        if not stays.all():
            self.n_left += int((~stays).sum())
            self._restructure(np.flatnonzero(stays))

    def run(
        self,
        duration_s: float,
        *,
        until: Callable[["Simulation"], bool] | None = None,
        every_steps: int = 500,
        each: Callable[["Simulation"], None] | None = None,
    ) -> bool:
        """Run for a time, or until a condition, looked at every so many steps, holds.

        Parameters
        ----------
        duration_s : how long at most. until : condition on the simulation. every_steps : steps between two looks.
        each : called after every look (to record, to report progress).

        Returns
        -------
        True when the condition held, or when there is none; False when the time ran out first.
        """
        require(duration_s >= 0, "duration_s", duration_s, "zero or positive")
        remaining = math.ceil(duration_s / self.time_step_s - 1e-9)
        while remaining > 0:
            chunk = min(every_steps, remaining)
            self.advance(chunk)
            remaining -= chunk
            if each is not None:
                each(self)
            if until is not None and until(self):
                return True
        return until is None

    # --- looking --------------------------------------------------------------------------------------------------

    @property
    def grains(self) -> Grains:
        """A copy of the grains' state, in the order in which they were added."""
        order = np.argsort(self._ids)
        places, velocities = self._places[order], self._velocities[order]
        radii = places[:, RADIUS].copy()
        return Grains(places[:, 0:3].copy(), velocities[:, :3].copy(), velocities[:, 3:] / radii[:, None], radii)

    @property
    def top_m(self) -> float:
        """Height of the highest grain's top; 0 without grains."""
        return float((self._places[:, 2] + self._places[:, RADIUS]).max(initial=0.0))

    @property
    def kinetic_energy_j(self) -> float:
        """Translational and rotational kinetic energy of the free grains."""
        return float(sum(kinetic_energy(self._grains)))

    @property
    def energies_j(self) -> dict[str, float]:
        """The energy ledger at the last step: its entries (`dem.ledger`), what came with the grains, and the residual.

        Raises
        ------
        ValueError : the simulation keeps no ledger.
        """
        require(self._entries is not None, "energy_ledger", False, "True, to read energies_j")
        return ledger.summary(cast(np.ndarray, self._entries), self._exchanged_j)

    def _held_by_grains_j(self) -> float:
        """Kinetic and potential energy of the free grains, for the ledger."""
        if self._entries is None:
            return 0.0
        heights = self._places[self._free, 0:3] @ self._gravity
        return float(sum(kinetic_energy(self._grains)) - (heights / self._inverse_masses[self._free]).sum())

    def is_static(self, ratio: float = 1e-8) -> bool:
        """Whether the translational kinetic energy per grain is below `ratio` times m g r (a fall by one radius).

        Spin does not count: with type C nothing brakes a grain that spins about its contact's normal, and it moves nothing.
        """
        if not self.n_grains:
            return True
        weight = np.linalg.norm(self._gravity) / self._inverse_masses[self._free]
        translation, _ = kinetic_energy(self._grains)
        return translation < ratio * float((weight * self._places[self._free, RADIUS]).sum())

    def largest_overlap_ratio(self) -> float:
        """Largest overlap of two grains over the smaller radius, now."""
        return deepest_overlap(self._grains, self._period, self._pairs.row, self._pairs.partner)

    def __repr__(self):
        return (
            f"Simulation(t = {self.time_s:.4g} s, {self.n_grains} grains, walls {self.wall_names}, step {self.time_step_s:.3g} s)"
        )

    def _repr_html_(self) -> str:
        names = ("time_s", "n_steps", "time_step_s", "n_grains", "n_left", "kinetic_energy_j", "wall_names")
        return table("Simulation", {name: getattr(self, name) for name in names} | self.materials)


def overlaps(positions, radii, period):
    """Pairs i < j that overlap (m,), (m,) and their overlaps in m (m,); nearest images where periodic."""
    from scipy.spatial import cKDTree  # here, as a factory's grains need it not and it takes a quarter of a short job's start

    places = positions.copy()
    periodic = period > 0
    places[:, periodic] %= period[periodic]
    pairs = cKDTree(places, boxsize=period).query_pairs(2.0 * radii.max(initial=0.0), output_type="ndarray")
    i, j = pairs.T
    apart = positions[i] - positions[j]
    apart[:, periodic] -= period[periodic] * np.rint(apart[:, periodic] / period[periodic])
    depth = radii[i] + radii[j] - np.linalg.norm(apart, axis=1)
    touching = depth > 0
    return i[touching], j[touching], depth[touching]


def contact_room(n_grains, n_contacts):
    """Entries of whole blocks that hold so many contacts, cut into slabs."""
    return (int(n_contacts) // BLOCK + 2 + min(SLABS, n_grains // GRAINS_PER_SLAB)) * BLOCK


def owners_and_entries(outer):
    """Owner and position of every entry of an outer list, row by row."""
    lengths = outer.row[:, 1] - outer.row[:, 0]
    owner = np.repeat(np.arange(len(lengths)), lengths)
    entry = np.arange(len(owner)) - np.repeat(np.cumsum(lengths) - lengths, lengths) + np.repeat(outer.row[:, 0], lengths)
    return owner, entry


def renumber_list(outer, number, partner_number, n_grains):
    """Rows, partners and history of an outer list after grain k became number[k] (-1: gone) among n_grains.

    partner_number does the same for the partners; None leaves them (walls).
    """
    owner, entry = owners_and_entries(outer)
    partner = outer.partner[entry] if partner_number is None else partner_number[outer.partner[entry]]
    stays = number[owner] >= 0
    if partner_number is not None:
        stays &= partner >= 0
    new_owner = number[owner[stays]]
    by_owner = np.argsort(new_owner, kind="stable")
    end = np.cumsum(np.bincount(new_owner, minlength=n_grains)) if n_grains else np.zeros(0, np.int64)
    begin = np.concatenate([[0], end[:-1]]) if n_grains else end
    return np.column_stack([begin, end]), partner[stays][by_owner], outer.history[entry[stays][by_owner]]
