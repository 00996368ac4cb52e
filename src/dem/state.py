"""The state of a simulation: all that its future depends on beside its settings, and so what a checkpoint holds."""

from dataclasses import dataclass, field

import numpy as np

from dem.bodies import Bodies, Glued, Scene, Surfaces, arrays_of, no_glued, wall_now
from dem.clumps import records
from dem.clumps.records import Clumps, NewClumps
from dem.factory import Factory
from dem.layout import FREE, INVERSE_MASS, LOAD, MOTION, PLACE, SPEEDS, GrainArrays, State, aligned_zeros
from dem.lists import storage
from dem.lists.blocks import LINE
from dem.lists.slabs import SLABS, max_slabs
from dem.lists.storage import STALE, Lists, Neighbours, Widths
from dem.meshes.search import Grid, grid_of, no_grid
from dem.meshes.triangles import Triangles, assembled
from dem.poses import Poses, Rigid, arms, poses_of
from dem.shapes import Mesh, Wall, may_turn
from dem.shapes.mesh import part
from dem.step.loop import CONTACTS_FULL, PAIRS_FULL, SURFACE_PAIRS_FULL
from dem.step.motion import kinetic_energy

#: Initial capacity of the lists; they grow on demand. Contacts are the outer list's entries that may touch soon.
PAIRS_PER_GRAIN, CONTACT_SHARE, SURFACE_PAIRS_PER_GRAIN = 5.2, 0.8, 0.5


@dataclass
class SimulationState:
    """Grains, walls, lists and clock.

    Attributes
    ----------
    widths : of the contact lists. material_index : name -> index. pair_table : see `dem.contact.model`.
    grains, material, ids : records, index of the material (n,), number in the order of addition (n,); the order in memory may
    differ. wholes, kinds : of the whole grain that each is or is part of, number in the order of addition and index of its shape
    in a mix (n,). clumps : None until the first clump is added. walls : as they were added; bodies, surfaces, glued : as they are.
    factories : still to run.
    entries, exchanged_j : energy ledger (None without one), and the energy that came or left with grains.
    """

    widths: Widths
    material_index: dict[str, int]
    pair_table: np.ndarray
    gravity: np.ndarray
    period: np.ndarray
    entries: np.ndarray | None
    exchanged_j: float = 0.0
    time_s: float = 0.0
    n_steps: int = 0
    n_left: int = 0
    n_wholes_left: int = 0
    walls: list[Wall] = field(default_factory=list)
    factories: list[Factory] = field(default_factory=list)
    mean_wall_forces_n: dict[str, np.ndarray] = field(default_factory=dict)
    mean_wall_torques_n_m: dict[str, np.ndarray] = field(default_factory=dict)
    glued: Glued = field(default_factory=no_glued)
    clumps: Clumps | None = None

    def __post_init__(self):
        self.bodies: Bodies
        self.surfaces: Surfaces
        self.bodies, self.surfaces = arrays_of([], self.material_index)
        self.poses: Poses | None = None
        self.triangles: Triangles
        self.grid: Grid
        self.triangulate()
        self.allocate(GrainArrays(np.zeros(0), np.zeros(0), np.zeros(0)), *(np.zeros(0, np.int64) for _ in range(4)))

    # --- grains ---------------------------------------------------------------------------------------------------

    @property
    def n_grains(self) -> int:
        """Number of grains."""
        return len(self.ids)

    @property
    def places(self) -> np.ndarray:
        """Place records (n, PLACE), a view."""
        return self.grains.place.reshape(-1, PLACE)

    @property
    def heights(self) -> np.ndarray:
        """Height of every grain, or of its clump's centre, in m (n,)."""
        heights = self.places[:, 2].copy()
        if self.clumps is not None:
            member = self.clumps.owner >= 0
            heights[member] = records.table_of(self.clumps)[self.clumps.owner[member], records.CENTRE + 2]
        return heights

    @property
    def velocities(self) -> np.ndarray:
        """Velocities and spin velocities (n, 6), a copy in float64."""
        return (self.grains.motion.astype(float) + self.grains.remainder).reshape(-1, MOTION)[:, SPEEDS]

    @property
    def inverse_masses(self) -> np.ndarray:
        """Inverse masses in 1/kg (n,), 0 for glued grains."""
        return self.grains.remainder.reshape(-1, MOTION)[:, INVERSE_MASS].astype(float)

    @property
    def is_free(self) -> np.ndarray:
        """True for grains that move by themselves (n,): no body carries them, and they are no members of a clump."""
        return self.grains.remainder.reshape(-1, MOTION)[:, FREE] > 0

    def held_by_grains_j(self) -> float:
        """Kinetic and potential energy of free grains and clumps, for the ledger; 0 without one."""
        if self.entries is None:
            return 0.0
        heights = self.places[self.is_free, 0:3] @ self.gravity
        potential = records.potential_energy(self.clumps, self.gravity) - (heights / self.inverse_masses[self.is_free]).sum()
        return float(sum(self.kinetic_energies_j()) + potential)

    def kinetic_energies_j(self) -> tuple[float, float]:
        """Translational and rotational kinetic energy of free grains and clumps."""
        pairs = zip(kinetic_energy(self.grains), records.kinetic_energies(self.clumps), strict=True)
        translation, rotation = (float(sum(pair)) for pair in pairs)
        return translation, rotation

    def view(self) -> State:
        """Grains, materials and loads, for the kernels."""
        return State(self.grains, self.material, self.loads)

    def scene(self) -> Scene:
        """Bodies, surfaces, gravity and period, for the kernels."""
        rigid = None if self.poses is None else Rigid(self.poses, self.triangles, self.grid)
        return Scene(self.bodies, self.surfaces, self.glued, self.clumps, rigid, self.gravity, self.period)

    def allocate(self, grains: GrainArrays, material: np.ndarray, ids: np.ndarray, wholes: np.ndarray, kinds: np.ndarray) -> None:
        """Copy grains into arrays of their own, with zero loads and empty lists."""
        n, types = len(ids), (float, self.widths.number, self.widths.number)
        self.grains = GrainArrays(*(aligned_zeros(values.size, types[k], k) for k, values in enumerate(grains)))
        for own, values in zip(self.grains, grains, strict=True):
            own[:] = values.ravel()
        self.material, self.ids, self.wholes, self.kinds = material, ids, wholes, kinds
        self.loads = aligned_zeros(n * LOAD, self.widths.number, 3)
        capacity = int(n * PAIRS_PER_GRAIN) + 64
        pairs = self.new_pairs(capacity, storage.contact_capacity(n, CONTACT_SHARE * capacity))
        surfaces = self.new_surface_pairs(int(n * SURFACE_PAIRS_PER_GRAIN) + 64)
        self.lists = Lists(pairs, surfaces, np.zeros(n * PLACE), np.zeros(n), np.zeros(n * PLACE), np.zeros(n), np.full(2, STALE))

    def restructure(
        self, selected: np.ndarray, new_grains: GrainArrays | None = None, new_material=(), new_clumps: NewClumps | None = None
    ) -> None:
        """Keep the grains of the given numbers, in that order, and append others, the members of new clumps last.

        Contacts keep their history.
        """
        old, held_j = self.lists, self.held_by_grains_j()
        next_id = self.ids.max(initial=-1) + 1
        next_whole = self.wholes.max(initial=-1) + 1
        n_old, n_new = self.n_grains, len(new_material)
        owner, kind = (np.arange(n_new), np.zeros(n_new, np.int64)) if new_clumps is None else (new_clumps.owner, new_clumps.kind)
        kept = [values.reshape(n_old, -1)[selected] for values in self.grains] if n_old else []
        self.allocate(
            GrainArrays(*(np.concatenate(parts) for parts in zip(*(part for part in (kept, new_grains) if part), strict=True))),
            np.concatenate([self.material[selected], np.asarray(new_material, np.int64)]),
            np.concatenate([self.ids[selected], next_id + np.arange(n_new)]),
            np.concatenate([self.wholes[selected], next_whole + owner]),
            np.concatenate([self.kinds[selected], kind[owner]]),
        )
        number = np.full(n_old, -1)
        number[selected] = np.arange(len(selected))
        self.carry("pairs", old.pairs, number, number)
        self.carry("surfaces", old.surfaces, number, None)
        self.clumps = records.selected(self.clumps, number, new_clumps, self.n_grains)
        self.exchanged_j += self.held_by_grains_j() - held_j
        stays = number[self.glued.grain] >= 0
        self.glued = Glued(number[self.glued.grain[stays]], self.glued.body[stays], self.glued.arm[stays])

    def glue(self, numbers: np.ndarray, body: int) -> None:
        """Make grains part of a body, a clump with any of its members as a whole; numbers are those in the order of addition."""
        indices = np.argsort(self.ids)[np.unique(np.asarray(numbers, np.int64))]
        remainder, held_j = self.grains.remainder.reshape(-1, MOTION), self.held_by_grains_j()
        if self.clumps is not None:
            owners = self.clumps.owner[indices]
            with_them = np.isin(self.clumps.owner, owners[owners >= 0])
            indices = np.union1d(indices, np.flatnonzero(with_them))
            self.clumps = records.selected(self.clumps, np.where(with_them, -1, np.arange(self.n_grains)), None, self.n_grains)
        remainder[indices, INVERSE_MASS] = 0.0
        remainder[indices, FREE] = 0.0
        self.exchanged_j += self.held_by_grains_j() - held_j
        carriers = np.full(len(indices), body, np.int64)
        grains, carriers = np.concatenate([self.glued.grain, indices]), np.concatenate([self.glued.body, carriers])
        places = arms(self.poses, carriers[-len(indices) :], self.places[indices, :3]) if len(indices) else np.zeros((0, 3))
        self.glued = Glued(grains, carriers, np.concatenate([self.glued.arm, places]))
        self.mark_stale()

    # --- walls ----------------------------------------------------------------------------------------------------

    def wall(self, w: int) -> Wall:
        """Wall w where it is now."""
        return wall_now(self.walls[w], self.scene(), w)

    def add_wall(self, wall: Wall) -> None:
        """Append a wall."""
        self.replace_walls([self.wall(w) for w in range(len(self.walls))] + [wall])
        outer = self.lists.surfaces
        contacts = storage.new_contacts(*self.surface_capacity(len(outer.outer.partner)), self.widths)
        self.lists = self.lists._replace(surfaces=outer._replace(contacts=contacts))
        self.mark_stale()

    def remove_wall(self, gone: int) -> None:
        """Remove wall `gone`; contacts with the others keep their history."""
        begin, end = self.triangles.first_key[gone : gone + 2]
        self.glued = self.glued._replace(body=np.where(self.glued.body > gone, self.glued.body - 1, self.glued.body))
        self.replace_walls([self.wall(w) for w in range(len(self.walls)) if w != gone])
        partner = self.lists.surfaces.outer.partner
        partner[:] = np.where(partner >= end, partner - (end - begin), np.where(partner >= begin, -1, partner))
        self.mark_stale()

    def replace_walls(self, walls: list[Wall]) -> None:
        """Take other walls; they may turn from the first that does on, or that is a mesh."""
        turning = self.poses is not None or any(may_turn(wall) for wall in walls)
        self.walls = walls
        self.bodies, self.surfaces = arrays_of(walls, self.material_index)
        self.poses = poses_of(walls) if turning else None
        self.triangulate()
        self.glued = self.glued._replace(arm=arms(self.poses, self.glued.body, self.places[self.glued.grain, :3]))

    def triangulate(self) -> None:
        """Take the triangles of the walls; the grid follows when the largest grain is known."""
        self.triangles = assembled([part(wall) if isinstance(wall, Mesh) else None for wall in self.walls])
        self.grid = no_grid(len(self.walls))

    def prepare_grid(self, cutoff: float) -> None:
        """Have a grid that finds all triangles within a cutoff in m of a grain's centre."""
        if self.poses is not None and self.grid.cutoff[0] < cutoff:
            self.grid = grid_of(self.triangles, cutoff)

    # --- lists ----------------------------------------------------------------------------------------------------

    def mark_stale(self) -> None:
        """Have the lists rebuilt before the next step."""
        self.lists.age[0] = STALE

    def new_pairs(self, capacity: int, contacts: int) -> Neighbours:
        """Empty lists of pairs: entries of the outer list, and of the contact blocks."""
        blocks = storage.new_contacts(contacts, SLABS, self.widths)
        return storage.new_neighbours(self.n_grains, capacity, blocks, self.widths)

    def new_surface_pairs(self, capacity: int, contacts: int | None = None) -> Neighbours:
        """Empty lists of grains near surfaces; contacts : capacity of their blocks, by default what the outer list may need."""
        enough, n_parts = self.surface_capacity(capacity)
        blocks = storage.new_contacts(enough if contacts is None else contacts, n_parts, self.widths)
        return storage.new_neighbours(self.n_grains, capacity, blocks, self.widths)

    def surface_capacity(self, capacity: int) -> tuple[int, int]:
        """Capacity of the contact blocks for an outer list of `capacity` entries, and the number of their parts."""
        n_parts = len(self.surfaces.kind) * max_slabs(self.n_grains)
        return storage.contact_capacity(0, capacity + LINE * n_parts), n_parts

    def carry(self, name: str, old: Neighbours, number: np.ndarray, partner_number: np.ndarray | None) -> None:
        """Fill list `name` with the entries of an old one after grain k became number[k]."""
        row, partner, history = storage.renumbered(old.outer, number, partner_number, self.n_grains)
        while len(partner) > len(getattr(self.lists, name).outer.partner):
            self.lengthen(PAIRS_FULL if name == "pairs" else SURFACE_PAIRS_FULL)
        target = getattr(self.lists, name).outer
        target.row[:] = row
        target.partner[: len(partner)] = partner
        target.history[: len(partner)] = history

    def lengthen(self, reason: int) -> None:
        """Give the list that was too short more capacity."""
        self.mark_stale()
        if reason == SURFACE_PAIRS_FULL:
            old = self.lists.surfaces
            new = self.new_surface_pairs(int(1.5 * len(old.outer.partner)) + 128)
            self.lists = self.lists._replace(surfaces=new)
        else:
            old = self.lists.pairs
            capacity, contacts = len(old.outer.partner), len(old.contacts.first)
            if reason != CONTACTS_FULL:
                capacity = int(1.3 * capacity) + 128
            new = self.new_pairs(capacity, storage.contact_capacity(self.n_grains, 1.3 * contacts))
            self.lists = self.lists._replace(pairs=new)
        storage.copy_list(old.outer, new.outer)
