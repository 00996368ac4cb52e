"""The simulation a user holds: grains, walls, materials, and a clock that `run` moves on.

Frame and signs: z up; overlap positive when grains touch; forces on walls are those that the grains exert.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from dem import loop, motion
from dem.factory import Factory
from dem.layout import BLOCK, BUFFER, FREE, GRAIN, INVERSE_MASS, LOAD, N_HISTORY, RADIUS, ROWS, UX, VX, aligned_zeros
from dem.material import Interaction, Material, pair_constants, require
from dem.timestep import stable_time_step
from dem.walls import Wall, from_arrays, to_arrays

#: Stands in for zero in m, N and rad, so that no division is by zero; its square root and square are float32 numbers too.
TINY = 1e-18

#: Neighbour skin in mean grain radii: rebuilding costs as much as pruning near this value.
SKIN_RATIO = 0.55
#: In a narrow periodic domain the skin is smaller, so that no grain sees two images of another.
LEAST_SKIN_RATIO = 0.2

#: A grain that crosses more than this fraction of its radius in one step has been thrown out by an unstable contact.
LARGEST_STEP_RATIO = 0.2


class SimulationError(RuntimeError):
    """The simulation cannot go on: it blew up or was set up impossibly."""


@dataclass(frozen=True)
class Grains:
    """A copy of the grains' state: positions_m and velocities_m_s (n, 3), angular_velocities_rad_s (n, 3), radii_m (n,)."""

    positions_m: np.ndarray
    velocities_m_s: np.ndarray
    angular_velocities_rad_s: np.ndarray
    radii_m: np.ndarray

    def __len__(self):
        return len(self.radii_m)


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
    rolling_model : "type_a" (EDEM's) or "type_c" (elastic-plastic), see `dem.contact.rolling`.
    precision : "float32" or "float64" of the contact arithmetic; positions and velocities are float64 always.
    vector_code : whether the hottest kernels run as explicit vector code (`dem.vectors`) or as plain numba.
    floor_m : grains below this height leave the simulation.
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
        precision: str = "float32",
        vector_code: bool = True,
        floor_m: float = -math.inf,
    ):
        require(rolling_model in ("type_a", "type_c"), "rolling_model", repr(rolling_model), "type_a or type_c")
        require(precision in ("float32", "float64"), "precision", repr(precision), "float32 or float64")
        require(0 < smallest_radius_m < math.inf, "smallest_radius_m", smallest_radius_m, "a positive number")
        self.materials = dict(materials)
        self._material_index = {name: k for k, name in enumerate(materials)}
        self._pair_table = np.full((len(materials) ** 2, 5), np.nan)
        for pair, interaction in interactions.items():
            self.set_interaction(*pair, interaction)
        self.smallest_radius_m = smallest_radius_m
        self.time_step_s = min(
            stable_time_step(smallest_radius_m, material, time_step_rayleigh_ratio) for material in materials.values()
        )
        self._type = np.dtype(precision).type
        self.gravity_m_s2 = tuple(gravity_m_s2)
        self._gravity = np.asarray(gravity_m_s2, float)
        self._period = np.asarray(period_m, float)
        self._options = loop.Options(vector_code, rolling_model == "type_c", bool((self._period > 0).any()))
        self._floor = floor_m
        self._wall_definitions: list[Wall] = []
        self._walls = to_arrays([], self._material_index)
        self._factories: list[Factory] = []
        self.time_s = 0.0
        self.n_steps = 0
        self.n_left = 0
        self.mean_wall_forces_n: dict[str, np.ndarray] = {}
        self._allocate(np.zeros(0), np.zeros(0, np.int64))
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
        row = pair_constants(self.materials[a], self.materials[b], interaction)
        self._pair_table[[i * len(names) + j, j * len(names) + i]] = row

    def add_wall(self, wall: Wall) -> None:
        """Put one more wall into the simulation; its name must be new and its material known."""
        require(wall.material in self.materials, f"material of wall {wall.name!r}", wall.material, f"one of {list(self.materials)}")
        require(wall.name not in self.wall_names, "wall name", repr(wall.name), "a name that no other wall has")
        for definition, w in zip(self._wall_definitions, range(len(self._wall_definitions)), strict=True):
            self._wall_definitions[w] = from_arrays(definition, self._walls, w)
        self._wall_definitions.append(wall)
        self._walls = to_arrays(self._wall_definitions, self._material_index)
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
            self.add_grains(positions, radii, factory.material, factory.velocity_m_s)

    def add_grains(
        self, positions_m, radii_m, material: str, velocities_m_s=(0.0, 0.0, 0.0), angular_velocities_rad_s=(0.0, 0.0, 0.0)
    ):
        """Add n grains at rest or moving.

        Parameters
        ----------
        positions_m : (n, 3). radii_m : (n,) or a number. velocities_m_s, angular_velocities_rad_s : (3,) or (n, 3).

        Raises
        ------
        ValueError : non-finite values, a radius below smallest_radius_m, an unknown material.
        """
        positions = np.atleast_2d(np.asarray(positions_m, float))
        n = len(positions)
        radii = np.broadcast_to(np.asarray(radii_m, float), n)
        require(bool(np.isfinite(positions).all()), "positions_m", "not finite", "finite numbers")
        require(bool(np.isfinite(radii).all()), "radii_m", "not finite", "finite numbers")
        if n:
            least = self.smallest_radius_m * (1 - 1e-12)
            require(radii.min() >= least, "smallest radius", radii.min(), f"at least smallest_radius_m = {self.smallest_radius_m}")
        require(material in self.materials, "material of grains", repr(material), f"one of {list(self.materials)}")
        record = np.zeros((n, GRAIN))
        record[:, 0:3] = positions
        record[:, VX : VX + 3] = velocities_m_s
        record[:, UX : UX + 3] = np.asarray(angular_velocities_rad_s, float) * radii[:, None]
        mass = self.materials[material].density_kg_m3 * 4.0 / 3.0 * np.pi * radii**3
        record[:, INVERSE_MASS] = 1.0 / mass
        record[:, FREE] = 1.0
        record[:, RADIUS] = radii
        self._restructure(np.ones(self.n_grains, bool), record, np.full(n, self._material_index[material]))

    def glue(self, grain_indices, wall: str) -> None:
        """Fix grains to a wall: they move with it, and what pushes them pushes the wall."""
        indices = np.unique(np.asarray(grain_indices, np.int64))
        w = self._wall_index(wall)
        record = self._records
        record[indices, INVERSE_MASS] = 0.0
        record[indices, FREE] = 0.0
        self._glued = np.concatenate([self._glued, indices])
        self._carrier = np.concatenate([self._carrier, np.full(len(indices), w, np.int64)])
        self._list_age[0] = loop.LISTS_STALE

    # --- arrays ---------------------------------------------------------------------------------------------------

    @property
    def _records(self) -> np.ndarray:
        return self._grains.reshape(-1, GRAIN)

    @property
    def n_grains(self) -> int:
        """How many grains there are now."""
        return len(self._grains) // GRAIN

    def _allocate(self, grains, material, pairs_per_grain=8.0, walls_per_grain=2.0):
        n = len(grains) // GRAIN
        self._grains, self._material = aligned_zeros(len(grains), float), material
        self._grains[:] = grains
        self._loads = aligned_zeros(n * LOAD, self._type)
        self._pairs, self._spare, self._contacts = self._new_lists(n, int(n * pairs_per_grain) + 64)
        self._wall_pairs, self._wall_spare, self._wall_contacts = self._new_lists(n, int(n * walls_per_grain) + 64)
        self._buffer = aligned_zeros(BUFFER * BLOCK, self._type)
        self._origin = np.zeros((n, 3))
        self._list_age = np.full(2, loop.LISTS_STALE)

    def _new_lists(self, n, capacity):
        lists = [
            loop.OuterList(np.zeros((n, 2), np.int64), np.zeros(capacity, np.int32), np.zeros((capacity, N_HISTORY), self._type))
            for _ in range(2)
        ]
        n_blocks = capacity // BLOCK + 1
        indices = [np.zeros(n_blocks * BLOCK, np.int32) for _ in range(3)]
        return (*lists, loop.Contacts(*indices, aligned_zeros(n_blocks * BLOCK * ROWS, self._type)))

    def _lengthen(self, reason):
        """Give the list that was too short half as much room again."""
        if reason == loop.PAIRS_FULL:
            old, capacity = self._pairs, int(1.5 * len(self._pairs.partner)) + 64
            self._pairs, self._spare, self._contacts = self._new_lists(self.n_grains, capacity)
            loop.copy_list(old, self._pairs)
        else:
            old, capacity = self._wall_pairs, int(1.5 * len(self._wall_pairs.partner)) + 64
            self._wall_pairs, self._wall_spare, self._wall_contacts = self._new_lists(self.n_grains, capacity)
            loop.copy_list(old, self._wall_pairs)

    def _restructure(self, keep, new_records, new_material):
        """Drop grains, append others, and keep the contact history of all that stay."""
        old_pairs, old_walls = self._pairs, self._wall_pairs
        grains = np.concatenate([self._records[keep], new_records]).ravel()
        n_new = len(new_records)
        material = np.concatenate([self._material[keep], new_material])
        self._allocate(grains, material)
        renumber = np.where(keep, np.cumsum(keep) - 1, -1)
        for old, partner_map, name in ((old_pairs, renumber, "pairs"), (old_walls, None, "walls")):
            row, partner, history = renumber_list(old, keep, partner_map, n_new)
            reason = loop.PAIRS_FULL if name == "pairs" else loop.WALL_PAIRS_FULL
            while len(partner) > len(self._target(name).partner):
                self._lengthen(reason)
            target = self._target(name)
            target.row[:] = row
            target.partner[: len(partner)] = partner
            target.history[: len(partner)] = history
        kept_glue = keep[self._glued] if len(self._glued) else np.zeros(0, bool)
        self._carrier = self._carrier[kept_glue]
        self._glued = renumber[self._glued[kept_glue]] if len(self._glued) else self._glued

    def _target(self, name):
        return self._pairs if name == "pairs" else self._wall_pairs

    # --- running --------------------------------------------------------------------------------------------------

    def advance(self, n_steps: int) -> None:
        """Make n_steps time steps, then let grains leave, check for blow-up and run due factories.

        Raises
        ------
        SimulationError : a grain moves so fast, or stands so oddly, that the state is worthless.
        """
        self._check_ready()
        remaining, forces = n_steps, np.zeros((len(self._wall_definitions), 3))
        while remaining:
            mean_force = np.zeros_like(forces)
            reason, done, _, _ = loop.advance(
                self._grains, self._material, self._loads, self._walls,
                self._pairs, self._wall_pairs, self._spare, self._wall_spare, self._contacts, self._wall_contacts,
                self._pair_table, len(self.materials), self._glued, self._carrier, self._gravity, self._period, self._buffer,
                loop.Constants(*(self._type(value) for value in (self.time_step_s, 1.0, 0.0, TINY))),
                self.time_step_s, self._skin, self._speed_limit, remaining, self._options, self._origin, self._list_age,
                mean_force,
            )  # fmt: skip
            forces += mean_force * done
            remaining -= done
            if reason == loop.BLEW_UP:
                self._raise_blow_up()
            if reason != loop.FINISHED:
                self._lengthen(reason)
        self.n_steps += n_steps
        self.time_s += n_steps * self.time_step_s
        self.mean_wall_forces_n = dict(zip(self.wall_names, forces / max(n_steps, 1), strict=True))
        self._let_grains_leave()
        self._run_factories()

    @property
    def _skin(self) -> float:
        radii = self._records[:, RADIUS]
        if not self.n_grains:
            return SKIN_RATIO * self.smallest_radius_m
        periods = self._period[self._period > 0]
        widest = 0.49 * periods.min() - 2.0 * radii.max() if len(periods) else math.inf
        return float(np.clip(widest, LEAST_SKIN_RATIO * radii.mean(), SKIN_RATIO * radii.mean()))

    def _check_ready(self):
        names = list(self.materials)
        used = {(int(a), int(b)) for a in np.unique(self._material) for b in (*np.unique(self._material), *self._walls.material)}
        for a, b in used:
            missing = np.isnan(self._pair_table[a * len(names) + b, 0])
            require(
                not missing,
                f"interaction of {names[a]!r} with {names[b]!r}",
                "missing",
                "an Interaction for every pair that can meet",
            )
        if self.n_grains:
            reach = 2.0 * (2.0 * self._records[:, RADIUS].max() + self._skin)
            for axis, period in zip("xyz", self._period, strict=True):
                allowed = f"0 or more than {reach:.3g}, or a grain could touch two images of another"
                require(period == 0 or period > reach, f"period_m along {axis}", period, allowed)

    @property
    def _speed_limit(self) -> float:
        return LARGEST_STEP_RATIO * self.smallest_radius_m / self.time_step_s

    def _raise_blow_up(self):
        record = self._records
        if not np.isfinite(record).all():
            raise SimulationError(f"blew up: a grain's state is not finite after t = {self.time_s:.4g} s")
        speed = np.linalg.norm(record[:, VX : VX + 3], axis=1)
        k = int(np.argmax(speed))
        raise SimulationError(
            f"blew up: grain {k} moves at {speed[k]:.3g} m/s after t = {self.time_s:.4g} s, "
            f"more than {LARGEST_STEP_RATIO} of a radius in one step ({self._speed_limit:.3g} m/s)"
        )

    def _let_grains_leave(self):
        stays = self._records[:, 2] >= self._floor
        if not stays.all():
            self.n_left += int((~stays).sum())
            self._restructure(stays, np.zeros((0, GRAIN)), np.zeros(0, np.int64))

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
        """A copy of the grains' state."""
        record, radii = self._records, self._records[:, RADIUS]
        return Grains(record[:, 0:3].copy(), record[:, VX : VX + 3].copy(), record[:, UX : UX + 3] / radii[:, None], radii.copy())

    @property
    def kinetic_energy_j(self) -> float:
        """Translational and rotational kinetic energy of the free grains."""
        return float(sum(motion.kinetic_energy(self._grains)))

    def is_static(self, ratio: float = 1e-8) -> bool:
        """Whether the translational kinetic energy per grain is below `ratio` times m g r (a fall by one radius).

        Spin does not count: with type C nothing brakes a grain that spins about its contact's normal, and it moves nothing.
        """
        record = self._records
        if not self.n_grains:
            return True
        free = record[:, FREE] > 0
        weight = np.linalg.norm(self._gravity) / record[free, INVERSE_MASS]
        translation, _ = motion.kinetic_energy(self._grains)
        return translation < ratio * float((weight * record[free, RADIUS]).sum())

    def largest_overlap_ratio(self) -> float:
        """Largest overlap of two grains over the smaller radius, now."""
        i, entry = owners_and_entries(self._pairs)
        if not len(entry):
            return 0.0
        j = self._pairs.partner[entry]
        record = self._records
        apart = record[i, 0:3] - record[j, 0:3]
        periodic = self._period > 0
        apart[:, periodic] -= self._period[periodic] * np.rint(apart[:, periodic] / self._period[periodic])
        overlap = record[i, RADIUS] + record[j, RADIUS] - np.linalg.norm(apart, axis=1)
        return float(max(0.0, (overlap / np.minimum(record[i, RADIUS], record[j, RADIUS])).max()))

    def __repr__(self):
        return (
            f"Simulation(t = {self.time_s:.4g} s, {self.n_grains} grains, walls {self.wall_names}, step {self.time_step_s:.3g} s)"
        )


def owners_and_entries(outer):
    """Owner and position of every entry of an outer list, row by row."""
    lengths = outer.row[:, 1] - outer.row[:, 0]
    owner = np.repeat(np.arange(len(lengths)), lengths)
    entry = np.arange(len(owner)) - np.repeat(np.cumsum(lengths) - lengths, lengths) + np.repeat(outer.row[:, 0], lengths)
    return owner, entry


def renumber_list(outer, keep, partner_map, n_new):
    """Rows, partners and history of an outer list after grains were dropped and n_new appended (partner_map None: walls)."""
    owner, entry = owners_and_entries(outer)
    partner, history = outer.partner[entry], outer.history[entry]
    stays = keep[owner] if partner_map is None else keep[owner] & keep[partner]
    counts = np.bincount(owner[stays], minlength=len(keep))[keep] if len(keep) else np.zeros(0, int)
    ends = np.cumsum(np.concatenate([counts, np.zeros(n_new, int)]))
    row = np.column_stack([ends - np.concatenate([counts, np.zeros(n_new, int)]), ends])
    kept_partner = partner[stays] if partner_map is None else partner_map[partner[stays]]
    return row, kept_partner, history[stays]
