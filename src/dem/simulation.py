"""The simulation a user holds: grains, walls, materials, and a clock that `run` moves on.

Frame and signs: z up; overlap positive when grains touch; forces on walls are those that the grains exert.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np

from dem import compiled, ledger
from dem.checks import SimulationError, check_finite, check_overlaps, check_ready, check_surroundings
from dem.clumps import records
from dem.clumps.mix import Mix, Shape
from dem.clumps.records import ClumpStates, NewClumps
from dem.contact.model import DAMPING_MODELS, NORMAL, ROLLING, TANGENTIAL, ContactModel
from dem.factory import Factory
from dem.html import Rich, table
from dem.jit import MAX_THREADS
from dem.layout import (
    FREE,
    INVERSE_MASS,
    MOTION,
    PLACE,
    RADIUS,
    SPEEDS,
    UX,
    VX,
    GrainArrays,
)
from dem.lists.pairs import deepest_overlap
from dem.lists.storage import Widths
from dem.material import Interaction, Material, require, require_vector
from dem.readings import WallContacts, wall_contacts
from dem.runner import Runner
from dem.shapes import Body, Drive, Mesh, Wall, may_turn
from dem.shapes.mesh import check_beside_grains
from dem.state import SimulationState
from dem.timestep import largest_time_step, stable_time_step

__all__ = ["Grains", "Simulation", "SimulationError"]

#: Number of grains from which on (the first-level cache is full) they are sorted in space, and steps from one sort to the next.
SORT_FROM, SORT_STEPS = 1000, 5000

#: The acceleration in `is_static` without gravity, the default of `gravity_m_s2`.
SCALE_WITHOUT_GRAVITY_M_S2 = 9.81


@dataclass(frozen=True)
class Grains(Rich):
    """A copy of the grains' state: positions_m and velocities_m_s (n, 3), angular_velocities_rad_s (n, 3), radii_m (n,).

    wholes, kinds : of the whole grain that each is, or whose clump it is part of (n,): number in the order of addition, which it
    keeps when others leave, and index of its shape in a mix. By default grains are no clumps.
    """

    positions_m: np.ndarray
    velocities_m_s: np.ndarray
    angular_velocities_rad_s: np.ndarray
    radii_m: np.ndarray
    wholes: np.ndarray = None  # type: ignore[assignment]  # set below
    kinds: np.ndarray = None  # type: ignore[assignment]

    def __post_init__(self):
        n = len(self.radii_m)
        for name, values in {"wholes": np.arange(n), "kinds": np.zeros(n, np.int64)}.items():
            if getattr(self, name) is None:
                object.__setattr__(self, name, values)

    def __len__(self):
        return len(self.radii_m)

    def __repr__(self):
        return f"Grains({len(self)} grains)"


def smallest_radii(given: float | Mapping[str, float], materials: Mapping[str, Material]) -> dict[str, float]:
    """Material -> smallest radius of its grains in m, from one radius for all or from such a mapping."""
    radii = dict(given) if isinstance(given, Mapping) else dict.fromkeys(materials, given)
    require(
        bool(radii) and set(radii) <= set(materials), "smallest_radius_m", radii, f"a radius, or one for some of {list(materials)}"
    )
    for name, radius in radii.items():
        require(0 < radius < math.inf, f"smallest_radius_m of {name!r}", radius, "a positive number")
    return radii


class Simulation:
    """Spheres, clumps of spheres and walls under gravity.

    Parameters
    ----------
    materials : name -> Material.
    interactions : (name, name) -> Interaction, one for every pair of materials that can meet; order does not matter.
    walls : rigid geometry, walls or bodies.
    gravity_m_s2 : acceleration vector.
    period_m : period along x, y, z; 0 where not periodic.
    time_step_rayleigh_ratio : time step over the smallest grain's Rayleigh time.
    time_step_s : time step in its place; refused where it is too long for a pair of materials that can meet.
    smallest_radius_m : smallest radius of any grain, which sets the time step; or material -> smallest radius of its grains. Of
        other materials there are walls only, which do not shorten the step however stiff they are.
    rolling_model : "type_a" (EDEM's) or "type_c" (elastic-plastic), see `dem.contact.laws`.
    damping_model : "edem" (at separation the dashpot pulls) or "no_pull", see `dem.contact.laws.hertz`; both rebound with e.
    tangential_model : "edem", or "liggghts", whose friction is not quite Coulomb's; see `dem.contact.laws`.
    adhesion : "none", "constant" (pull-off force, `dem.contact.laws.pull_off`), "jkr" or "capillary" (`dem.contact.laws`); by
        default "constant" if an interaction has a work of adhesion, else "none".
    precision : "float32" or "float64" of the contact arithmetic; positions are float64 always, velocities have 48 bits at least.
    vector_code : True for explicit vector code (`dem.step.vectors`) in the hottest kernels, False for plain numba.
    threads : number of threads (efficient from some 20 000 grains on; the result is the same).
    floor_m : grains below this height leave the simulation.
    energy_ledger : True to book every step in `energies_j` (see `dem.ledger`); steps then take several times as long.
    """

    def __init__(
        self,
        *,
        materials: dict[str, Material],
        interactions: dict[tuple[str, str], Interaction],
        smallest_radius_m: float | Mapping[str, float],
        walls: Sequence[Wall | Body] = (),
        gravity_m_s2: tuple[float, float, float] = (0.0, 0.0, -9.81),
        period_m: tuple[float, float, float] = (0.0, 0.0, 0.0),
        time_step_rayleigh_ratio: float = 0.2,
        time_step_s: float | None = None,
        rolling_model: str = "type_a",
        damping_model: str = "edem",
        tangential_model: str = "edem",
        adhesion: str | None = None,
        precision: str = "float32",
        vector_code: bool = True,
        threads: int = 1,
        floor_m: float = -math.inf,
        energy_ledger: bool = False,
    ):
        require(rolling_model in ROLLING, "rolling_model", repr(rolling_model), f"one of {list(ROLLING)}")
        require(damping_model in DAMPING_MODELS, "damping_model", repr(damping_model), f"one of {list(DAMPING_MODELS)}")
        require(tangential_model in TANGENTIAL, "tangential_model", repr(tangential_model), f"one of {list(TANGENTIAL)}")
        if adhesion is None:
            adhesion = "constant" if any(pair.work_of_adhesion_j_m2 for pair in interactions.values()) else "none"
        require(adhesion in NORMAL, "adhesion", repr(adhesion), f"one of {list(NORMAL)}")
        require(precision in ("float32", "float64"), "precision", repr(precision), "float32 or float64")
        smallest = smallest_radii(smallest_radius_m, materials)
        require_vector(gravity_m_s2, 3, "gravity_m_s2")
        require_vector(period_m, 3, "period_m")
        period = np.asarray(period_m, float)
        require(bool((period >= 0).all()), "period_m", period_m, "lengths, 0 where not periodic")
        require(floor_m < math.inf, "floor_m", floor_m, "a height, or -inf")
        require(1 <= threads <= MAX_THREADS, "threads", threads, f"1 to {MAX_THREADS}")
        self._settings: dict[str, Any] = {
            "smallest_radius_m": smallest,
            "gravity_m_s2": list(gravity_m_s2),
            "period_m": list(period_m),
            "time_step_rayleigh_ratio": time_step_rayleigh_ratio,
            "time_step_s": time_step_s,
            "rolling_model": rolling_model,
            "damping_model": damping_model,
            "tangential_model": tangential_model,
            "adhesion": adhesion,
            "precision": precision,
            "vector_code": vector_code,
            "threads": threads,
            "floor_m": floor_m,
            "energy_ledger": energy_ledger,
        }
        self.materials = dict(materials)
        self.smallest_radii_m, self.gravity_m_s2 = smallest, tuple(gravity_m_s2)
        steps = [stable_time_step(radius, materials[name], time_step_rayleigh_ratio) for name, radius in smallest.items()]
        self.time_step_s = min(steps) if time_step_s is None else time_step_s
        require(0 < self.time_step_s < math.inf, "time_step_s", time_step_s, "a positive number")
        self._floor = floor_m
        self._contact_model = ContactModel(rolling_model, damping_model, adhesion, tangential_model)
        self._state = SimulationState(
            widths=Widths(np.dtype(precision).type, self._contact_model.n_constants, self._contact_model.n_history),
            material_index={name: k for k, name in enumerate(materials)},
            pair_table=np.full((len(materials) ** 2, self._contact_model.n_columns), np.nan),
            gravity=np.asarray(gravity_m_s2, float),
            period=period,
            entries=np.zeros(len(ledger.ENTRIES)) if energy_ledger else None,
        )
        self._runner = Runner(
            self._state,
            self._contact_model,
            time_step_s=self.time_step_s,
            smallest_radius_m=min(smallest.values()),
            vector_code=vector_code,
            threads=threads,
        )
        for pair, interaction in interactions.items():
            self.set_interaction(*pair, interaction)
        bodies = [wall.as_wall() if isinstance(wall, Body) else wall for wall in walls]
        self._ensure_compiled(turning=any(may_turn(wall) for wall in bodies))
        for wall in bodies:
            self.add_wall(wall)

    # --- setting up -----------------------------------------------------------------------------------------------

    def _ensure_compiled(self, clumps: bool = False, turning: bool = False) -> None:
        """Have the kernels for these settings compiled, with what there is already and what is to come."""
        settings = self._settings
        turning = turning or self._state.poses is not None
        allowed = "False with meshes and walls that turn, which it does not book"
        require(not turning or self._state.entries is None, "energy_ledger", True, allowed)
        compiled.ensure(
            settings["precision"],
            settings["threads"] > 1,
            settings["energy_ledger"],
            rolling_model=settings["rolling_model"],
            adhesion=settings["adhesion"],
            tangential_model=settings["tangential_model"],
            vector_code=settings["vector_code"],
            periodic=bool((self._state.period > 0).any()),
            clumps=clumps or self._state.clumps is not None,
            turning=turning,
        )

    def set_interaction(self, a: str, b: str, interaction: Interaction) -> None:
        """Change how two materials interact from now on; contacts keep their history."""
        index = self._state.material_index
        for name in (a, b):
            require(name in index, "material of an interaction", repr(name), f"one of {list(index)}")
        needed = f"0 in a simulation with adhesion {self.adhesion!r}"
        for name in ("work_of_adhesion_j_m2", "bridge_volume_ratio"):
            value = getattr(interaction, name)
            require(value == 0 or name in NORMAL[self.adhesion].PROPERTIES, f"{name} of {a!r} with {b!r}", value, needed)
        self._check_step(a, b)
        i, j = index[a], index[b]
        row = self._contact_model.row(self.materials[a], self.materials[b], interaction)
        self._state.pair_table[[i * len(index) + j, j * len(index) + i]] = row

    def _check_step(self, a: str, b: str) -> None:
        """Refuse a time step in seconds that is too long for contacts of two materials."""
        if self._settings["time_step_s"] is None or not {a, b} & set(self.smallest_radii_m):
            return
        bodies = [(self.materials[name], self.smallest_radii_m.get(name, math.inf)) for name in (a, b)]
        against_walls = [(body, (self.materials[name], math.inf)) for body, name in zip(bodies, (b, a), strict=True)]
        most = min(largest_time_step(*pair) for pair in (bodies, *against_walls))
        allowed = f"at most {most:.3g} for {a!r} on {b!r}"
        require(self.time_step_s <= most, "time_step_s", self.time_step_s, allowed)

    def add_wall(self, wall: Wall | Body) -> None:
        """Add a wall or a body, which are the same; its name must be new and its material known.

        Raises
        ------
        ValueError : the above; a mesh whose size or walls make no sense beside the grains, or that stands in grains.
        """
        wall = wall.as_wall() if isinstance(wall, Body) else wall
        require(bool(wall.name), "wall name", repr(wall.name), "a name")
        require(wall.material in self.materials, f"material of wall {wall.name!r}", wall.material, f"one of {list(self.materials)}")
        require(wall.name not in self.wall_names, "wall name", repr(wall.name), "a name that no other wall has")
        if may_turn(wall):
            self._ensure_compiled(turning=True)
        if isinstance(wall, Mesh):
            check_beside_grains(wall, min(self.smallest_radii_m.values()))
            check_surroundings([wall], -math.inf, self._state.places[:, :3], self._state.places[:, RADIUS])
        self._state.add_wall(wall)

    def remove_wall(self, name: str) -> None:
        """Remove a wall; contacts with the others keep their history."""
        gone = self._wall_index(name)
        require(gone not in self._state.glued.body, "wall to remove", repr(name), "a wall that carries no glued grains")
        self._state.remove_wall(gone)

    @property
    def adhesion(self) -> str:
        """The law of adhesion: "none", or a key of `dem.contact.model.NORMAL`."""
        return self._contact_model.adhesion

    @property
    def wall_names(self) -> list[str]:
        """Names of the walls, in the order in which they were added."""
        return [wall.name for wall in self._state.walls]

    def _wall_index(self, name: str) -> int:
        require(name in self.wall_names, "wall", repr(name), f"one of {self.wall_names}")
        return self.wall_names.index(name)

    def wall(self, name: str) -> Wall:
        """The wall where it is now."""
        return self._state.wall(self._wall_index(name))

    def move_wall(self, name: str, velocity_m_s: tuple[float, float, float]) -> None:
        """Give a wall a new prescribed velocity."""
        require_vector(velocity_m_s, 3, f"velocity_m_s of wall {name!r}")
        self._state.bodies.velocity[self._wall_index(name)] = velocity_m_s

    def turn_wall(self, name: str, angular_velocity_rad_s: tuple[float, float, float]) -> None:
        """Give a wall a new prescribed rate of turn; one that is driven keeps its drive."""
        w = self._wall_index(name)
        wall = replace(self.wall(name), angular_velocity_rad_s=angular_velocity_rad_s)
        self._ensure_compiled(turning=True)
        self._state.replace_walls([wall if k == w else self._state.wall(k) for k in range(len(self.wall_names))])

    def drive_wall(self, name: str, *drives: Drive) -> None:
        """Give a wall other drives along axes; it keeps its velocity, prescribed from now on along axes without a drive."""
        w = self._wall_index(name)
        wall = replace(self.wall(name), drive=drives or None)
        self._state.replace_walls([wall if k == w else self._state.wall(k) for k in range(len(self.wall_names))])

    def add_factory(self, factory: Factory) -> None:
        """Have a factory make its grains when the clock reaches its time."""
        self._check_radius("a factory", factory.material, factory.smallest_m)
        self._state.factories.append(factory)
        self._run_factories()

    def _check_radius(self, of: str, material: str, smallest_m: float) -> None:
        """Refuse grains of a material that has none, or that are smaller than those that set the time step."""
        least = self.smallest_radii_m
        require(material in least, f"material of {of}", repr(material), f"one of {list(least)}")
        allowed = f"at least smallest_radius_m = {least.get(material)}, which sets the time step"
        require(smallest_m >= least[material] * (1 - 1e-12), f"smallest radius of {of}", smallest_m, allowed)

    def _run_factories(self) -> None:
        due = [factory for factory in self._state.factories if factory.time_s <= self.time_s]
        self._state.factories = [factory for factory in self._state.factories if factory.time_s > self.time_s]
        for factory in due:
            positions, radii = factory.make()
            apart = self.n_grains == 0
            if factory.shape is None:
                self._add(positions, radii, factory.material, factory.velocities(), apart=apart)
            else:
                turns, kinds, velocities = factory.orientations(), factory.kinds(), factory.velocities()
                self._add_clumps(factory.shape, kinds, positions, radii, factory.material, turns, velocities, apart=apart)

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

    def add_clumps(
        self,
        clump: Shape,
        positions_m,
        equivalent_radii_m,
        material: str,
        *,
        kinds=None,
        orientations=None,
        seed: int | None = None,
        velocities_m_s=(0.0, 0.0, 0.0),
        angular_velocities_rad_s=(0.0, 0.0, 0.0),
    ) -> None:
        """Add n clumps of one shape, or of those of a mix, at rest or moving; their spheres are grains that stay together.

        Parameters
        ----------
        clump : the shape, or a mix of them. positions_m : (n, 3), of the centres of mass.
        kinds : (n,), index of each one's shape in a mix, which needs them (`Mix.draw`).
        equivalent_radii_m : (n,) or a number, radii of spheres of the clumps' volume.
        orientations : (4,) or (n, 4), quaternions (w, x, y, z) of any length that turn the frame of `clump.spheres` to space; by
            default both frames agree. seed : draws random orientations instead.
        velocities_m_s, angular_velocities_rad_s : (3,) or (n, 3).

        Raises
        ------
        ValueError : what `add_grains` refuses, of all spheres; orientations together with a seed, or of length zero; kinds that are
            no indices of shapes.
        """
        positions = np.atleast_2d(np.asarray(positions_m, float))
        radii = np.broadcast_to(np.asarray(equivalent_radii_m, float), len(positions))
        require(bool((radii > 0.0).all()), "equivalent_radii_m", radii.min(initial=0.0), "positive numbers")
        require(orientations is None or seed is None, "seed beside orientations", seed, "one of the two")
        if seed is None:
            turns = records.unit_quaternions(orientations, len(positions))
        else:
            turns = records.random_orientations(len(positions), np.random.default_rng(seed))
        require(kinds is not None or not isinstance(clump, Mix), "kinds of a mix", kinds, "an index of its shapes for every clump")
        kinds = np.zeros(len(positions), np.int64) if kinds is None else np.asarray(kinds)
        known = kinds.shape == (len(positions),) and bool(np.isin(kinds, np.arange(len(clump.shapes))).all())
        require(known, "kinds", kinds.tolist(), f"{len(positions)} indices from 0 to {len(clump.shapes) - 1}")
        self._add_clumps(clump, kinds.astype(int), positions, radii, material, turns, velocities_m_s, angular_velocities_rad_s)

    def _add_clumps(
        self, shape, kinds, positions, radii, material, turns, velocities_m_s, angular_velocities_rad_s=(0, 0, 0), apart=False
    ):
        """As `add_clumps`; kinds (n,), positions (n, 3), radii (n,), turns (n, 4) of length 1."""
        require(material in self.materials, "material of clumps", repr(material), f"one of {list(self.materials)}")
        velocities, spins = (
            np.broadcast_to(np.asarray(v, float), (len(radii), 3)) for v in (velocities_m_s, angular_velocities_rad_s)
        )
        density = self.materials[material].density_kg_m3
        new = records.new_clumps(shape, kinds, positions, radii, turns, velocities, spins, density)
        self._ensure_compiled(clumps=True)
        members = records.members_of(new)
        self._add(members.positions, members.radii, material, members.velocities, members.spins, apart, new)

    def _add(
        self,
        positions_m,
        radii_m,
        material,
        velocities_m_s,
        angular_velocities_rad_s=(0.0, 0.0, 0.0),
        apart=False,
        clumps: NewClumps | None = None,
    ):
        """As `add_grains`; apart: the new grains are known not to touch each other, nor others. clumps : whose members they are."""
        positions = np.atleast_2d(np.asarray(positions_m, float))
        n = len(positions)
        radii = np.broadcast_to(np.asarray(radii_m, float), n)
        velocities, spins = np.asarray(velocities_m_s, float), np.asarray(angular_velocities_rad_s, float)
        named = {"positions_m": positions, "radii_m": radii, "velocities_m_s": velocities, "angular_velocities_rad_s": spins}
        for name, values in named.items():
            require(bool(np.isfinite(values).all()), name, "not finite", "finite numbers")
        self._check_radius("grains", material, radii.min(initial=math.inf))
        if not apart:
            check_overlaps(self._state, positions, radii, np.full(n, -1) if clumps is None else clumps.owner)
        check_surroundings([self.wall(name) for name in self.wall_names], self._floor, positions, radii)
        place, motion, remainder = np.zeros((n, PLACE)), np.zeros((n, MOTION)), np.zeros((n, MOTION))
        place[:, 0:3], place[:, RADIUS] = positions, radii
        motion[:, VX : VX + 3], motion[:, UX : UX + 3] = velocities, spins * radii[:, None]
        remainder[:, SPEEDS] = (motion - motion.astype(self._state.widths.number))[:, SPEEDS]
        mass = self.materials[material].density_kg_m3 * 4.0 / 3.0 * np.pi * radii**3
        remainder[:, INVERSE_MASS], remainder[:, FREE] = 1.0 / mass, 1.0
        if clumps is not None:
            remainder[:, SPEEDS] = 0.0
            remainder[:, INVERSE_MASS], remainder[:, FREE] = clumps.table[clumps.owner, records.INV_MASS], 0.0
        new = GrainArrays(place, motion, remainder)
        self._state.restructure(np.arange(self.n_grains), new, np.full(n, self._state.material_index[material]), clumps)

    def glue(self, grain_indices, wall: str) -> None:
        """Fix grains to a wall: they move with it, and forces on them act on the wall. A clump is fixed with any of its members."""
        self._state.glue(grain_indices, self._wall_index(wall))

    def remove_grains(self, grain_indices) -> None:
        """Remove grains, by their indices in `grains`, and with a member its clump.

        The others keep their order and the history of their contacts.

        Raises
        ------
        ValueError : an index that no grain has.
        """
        indices, n = np.unique(np.asarray(grain_indices, np.int64)), self.n_grains
        require(bool(((indices >= 0) & (indices < n)).all()), "grains to remove", indices, f"indices from 0 to {n - 1}")
        stays = np.ones(n, bool)
        stays[np.argsort(self._state.ids)[indices]] = False
        if self._state.clumps is not None:
            owner = self._state.clumps.owner
            stays &= ~np.isin(owner, owner[~stays & (owner >= 0)])
        self._state.restructure(np.flatnonzero(stays))

    # --- running --------------------------------------------------------------------------------------------------

    def advance(self, n_steps: int) -> None:
        """Make n_steps time steps, then let grains leave and run due factories.

        Raises
        ------
        SimulationError : a grain moves too fast or has no sensible position: the state is worthless.
        """
        require(n_steps >= 0, "n_steps", n_steps, "zero or positive")
        state = self._state
        check_ready(state, self._runner.skin + self._runner.reach_m)
        loads = np.zeros((len(state.walls), 6))
        remaining = n_steps
        while remaining:
            large = self.n_grains >= SORT_FROM
            if large and self.n_steps % SORT_STEPS == 0:
                self._runner.sort_in_space()
            chunk = min(remaining, SORT_STEPS - self.n_steps % SORT_STEPS) if large else remaining
            loads += self._runner.steps(chunk) * chunk
            state.n_steps += chunk
            state.time_s += chunk * self.time_step_s
            remaining -= chunk
        loads /= max(n_steps, 1)
        state.mean_wall_forces_n = dict(zip(self.wall_names, loads[:, :3], strict=True))
        state.mean_wall_torques_n_m = dict(zip(self.wall_names, loads[:, 3:], strict=True))
        check_finite(state)
        self._let_grains_leave()
        self._run_factories()

    def _let_grains_leave(self):
        stays = self._state.heights >= self._floor
        if not stays.all():
            self._state.n_left += int((~stays).sum())
            self._state.n_wholes_left += len(np.unique(self._state.wholes[~stays]))
            self._state.restructure(np.flatnonzero(stays))

    def run(
        self,
        duration_s: float,
        *,
        until: Callable[["Simulation"], bool] | None = None,
        every_steps: int = 500,
        each: Callable[["Simulation"], None] | None = None,
    ) -> bool:
        """Run for a time, or until a condition holds.

        Parameters
        ----------
        duration_s : maximum time. until : condition on the simulation. every_steps : steps between two checks of it.
        each : called before every check (to record, to report progress).

        Returns
        -------
        True if the condition held, or if there is none; False if the time ran out first.
        """
        require(0 <= duration_s < math.inf, "duration_s", duration_s, "a finite number, zero or positive")
        require(every_steps >= 1, "every_steps", every_steps, "at least 1")
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
    def n_grains(self) -> int:
        """Number of grains now."""
        return self._state.n_grains

    @property
    def time_s(self) -> float:
        """Simulated time in s."""
        return self._state.time_s

    @property
    def n_steps(self) -> int:
        """Number of steps made."""
        return self._state.n_steps

    @property
    def n_left(self) -> int:
        """Number of grains that have left below the floor."""
        return self._state.n_left

    @property
    def n_wholes_left(self) -> int:
        """The same, with every clump counted once."""
        return self._state.n_wholes_left

    @property
    def mean_wall_forces_n(self) -> dict[str, np.ndarray]:
        """Wall -> mean force (3,) of the grains on it during the last call of `advance`."""
        return self._state.mean_wall_forces_n

    @property
    def mean_wall_torques_n_m(self) -> dict[str, np.ndarray]:
        """Wall -> mean torque (3,) of the grains on it about its pivot during the last call of `advance`.

        The pivot of a mesh is its origin. Zero in a simulation without meshes and walls that turn.
        """
        return self._state.mean_wall_torques_n_m

    def wall_contacts(self, wall: str) -> WallContacts:
        """Contacts of a wall now: places, forces and torques, those of the step to come. Reading them changes nothing.

        Raises
        ------
        ValueError : no step was made since grains or walls were added or removed: neighbours are not known.
        """
        return wall_contacts(self._runner, self._wall_index(wall))

    @property
    def grains(self) -> Grains:
        """A copy of the grains' state, in the order in which they were added."""
        order = np.argsort(self._state.ids)
        places, velocities = self._state.places[order], self._state.velocities[order]
        radii = places[:, RADIUS].copy()
        wholes, kinds = self._state.wholes[order], self._state.kinds[order]
        return Grains(places[:, 0:3].copy(), velocities[:, :3].copy(), velocities[:, 3:] / radii[:, None], radii, wholes, kinds)

    @property
    def clumps(self) -> ClumpStates:
        """A copy of the clumps' state, in the order in which they were added; without those that were glued to a wall."""
        return records.states_of(self._state.clumps, self._state.ids)

    @property
    def top_m(self) -> float:
        """Height of the highest grain's top; 0 without grains."""
        return float((self._state.places[:, 2] + self._state.places[:, RADIUS]).max(initial=0.0))

    @property
    def kinetic_energy_j(self) -> float:
        """Translational and rotational kinetic energy of free grains and clumps."""
        return float(sum(self._state.kinetic_energies_j()))

    @property
    def energies_j(self) -> dict[str, float]:
        """The energy ledger at the last step: its entries (`dem.ledger`), energy exchanged with grains, and the residual.

        Raises
        ------
        ValueError : the simulation keeps no ledger.
        """
        require(self._state.entries is not None, "energy_ledger", False, "True, to read energies_j")
        return ledger.summary(cast(np.ndarray, self._state.entries), self._state.exchanged_j)

    def is_static(self, ratio: float = 1e-8) -> bool:
        """True if the translational kinetic energy per free grain or clump is below `ratio` times m g r (a fall by one radius).

        Spin does not count: with type C nothing brakes a grain that spins about its contact's normal, and it moves nothing.

        Without gravity, g is the earth's (`SCALE_WITHOUT_GRAVITY_M_S2`): rigid grains have no speed of their own to compare with.
        Grains that no other holds then drift on, and slow down only as they collide: a packing may need a ratio of 1e-5 or more.
        """
        free, clumps = self._state.is_free, records.table_of(self._state.clumps)
        if not free.any() and not len(clumps):
            return True
        g = np.linalg.norm(self._state.gravity) or SCALE_WITHOUT_GRAVITY_M_S2
        weight = g / self._state.inverse_masses[free]
        scale = float((weight * self._state.places[free, RADIUS]).sum()) + float(
            (g * clumps[:, records.SIZE] / clumps[:, records.INV_MASS]).sum()
        )
        translation, _ = self._state.kinetic_energies_j()
        return translation < ratio * scale

    def largest_overlap_ratio(self) -> float:
        """Largest overlap of two grains over the smaller radius, now."""
        outer = self._state.lists.pairs.outer
        return deepest_overlap(self._state.grains, self._state.period, outer.row, outer.partner)

    def __repr__(self):
        return (
            f"Simulation(t = {self.time_s:.4g} s, {self.n_grains} grains, walls {self.wall_names}, step {self.time_step_s:.3g} s)"
        )

    def _repr_html_(self) -> str:
        names = ("time_s", "n_steps", "time_step_s", "n_grains", "n_left", "kinetic_energy_j", "wall_names")
        return table("Simulation", {name: getattr(self, name) for name in names} | self.materials)
