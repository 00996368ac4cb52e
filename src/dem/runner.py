"""Runs the kernels on a state: chooses their code by the settings, gives them working memory, lengthens lists that are full."""

import math
from typing import cast

import numpy as np

from dem import ledger
from dem.bodies import nothing_carried
from dem.checks import SimulationError, behind_message, blow_up_message, room_beside_images
from dem.contact.model import ContactModel, Model
from dem.jit import DISABLED, set_num_threads
from dem.layout import BLOCK, BUFFER, RADIUS, Access, Period, aligned_zeros
from dem.lists.grid import cell_size, is_sound, sort_into_cells
from dem.lists.pairs import WIDE_FROM, WIDEST
from dem.lists.slabs import SLABS
from dem.lists.storage import STALE
from dem.meshes.contacts import Near, new_near
from dem.poses import no_poses
from dem.shapes import RECORD
from dem.state import SimulationState
from dem.step import loop
from dem.step.schedule import GROUPS, STEPS_AT_ONCE, Scratch

#: Neighbour skin in mean grain radii: rebuilding costs as much as pruning near this value.
SKIN_RATIO = 0.55
#: In a narrow periodic domain the skin is smaller, so that no grain interacts with two images of another.
LEAST_SKIN_RATIO = 0.2

#: Capacity for triangles near grains, to begin with.
LEAST_TRIANGLES = 4096

#: A grain that crosses more than this fraction of its radius in one step has been thrown out by an unstable contact.
LARGEST_STEP_RATIO = 0.2


class Runner:
    """The kernels for one simulation.

    Parameters
    ----------
    state : what they read and write. contact_model : the laws. time_step_s, smallest_radius_m : as in `dem.Simulation`.
    vector_code, threads : as in `dem.Simulation`.
    """

    def __init__(self, state, contact_model: ContactModel, *, time_step_s, smallest_radius_m, vector_code, threads):
        self.state: SimulationState = state
        self.time_step_s, self.smallest_radius_m, self.threads = time_step_s, smallest_radius_m, threads
        self.contact_model = contact_model
        self.n_triangles = LEAST_TRIANGLES
        self.laws = contact_model.laws(state.widths.number, time_step_s)
        period, is_periodic = state.period, state.period > 0
        frequency = np.divide(1.0, period, out=np.zeros(3), where=is_periodic)
        self.access = Access(
            vector=True if vector_code and not DISABLED else None,  # it has no interpreted version
            images=Period(period, frequency) if is_periodic.any() else None,
            spins=True if contact_model.separate_spins else None,
        )

    @property
    def model(self) -> Model:
        """What the kernels know of contacts."""
        table, n_materials = self.state.pair_table, len(self.state.material_index)
        return Model(self.laws, table, n_materials, self.time_step_s, self.access, self.reach_m)

    @property
    def reach_m(self) -> float:
        """Gap in m up to which contacts may act."""
        return self.contact_model.reach_m(self.state.pair_table, float(self.state.places[:, RADIUS].max(initial=0.0)))

    @property
    def skin(self) -> float:
        """Skin of the outer lists in m, beyond the gap up to which contacts act."""
        radii, period = self.state.places[:, RADIUS], self.state.period
        if not self.state.n_grains:
            return SKIN_RATIO * self.smallest_radius_m
        periods = period[period > 0]
        widest = 0.49 * periods.min() - 2.0 * radii.max() if len(periods) else math.inf
        return float(np.clip(widest, LEAST_SKIN_RATIO * radii.mean(), SKIN_RATIO * radii.mean()))

    @property
    def largest_allowance(self) -> float:
        """Largest outer allowance of a grain in m.

        In a periodic domain neither it nor a mesh is near two images of the other; of many grains none needs too wide a cell.
        """
        skin, period, largest = self.skin, self.state.period, float(self.state.places[:, RADIUS].max(initial=0.0))
        periods = period[period > 0]
        widest = 0.5 * (0.49 * periods.min() - 2.0 * largest) if len(periods) else math.inf
        beside = room_beside_images(self.state.walls, period) - largest - self.reach_m - 0.5 * skin
        within = math.inf
        if self.state.n_grains >= WIDE_FROM:
            within = 0.5 * (WIDEST * cell_size(self.state.grains, skin + self.reach_m) - self.reach_m) - largest
        return float(max(min(2.0 * skin, widest, beside, within), 0.5 * skin))

    @property
    def speed_limit(self) -> float:
        """Speed in m/s above which the state is worthless."""
        return LARGEST_STEP_RATIO * self.smallest_radius_m / self.time_step_s

    def scratch(self) -> Scratch:
        """Working memory; allocated anew each time, because a copied simulation's would lose its alignment (8 % of the speed)."""
        n, n_surfaces = 1 if self.threads == 1 else GROUPS // 2, len(self.state.surfaces.kind)
        n_contacts = len(self.state.lists.surfaces.contacts.first)
        return Scratch(
            buffers=aligned_zeros(n * BUFFER * BLOCK, self.state.widths.number).reshape(n, -1),
            places=aligned_zeros(n * 4 * BLOCK, float).reshape(n, -1),
            used=np.zeros((STEPS_AT_ONCE, SLABS)),
            spent=np.zeros(SLABS),
            rate=np.zeros(SLABS),
            marks=np.zeros(SLABS, np.int64),
            geometry=np.zeros((STEPS_AT_ONCE, n_surfaces, RECORD)),
            force=np.zeros((SLABS, n_surfaces, 3)),
            torque=np.zeros((SLABS, n_surfaces, 3)),
            ahead=None if self.state.poses is None else no_poses(STEPS_AT_ONCE, n_surfaces),
            carried=nothing_carried(len(self.state.glued.grain)),
            pace=np.zeros(loop.PACE),
            near=None if self.state.poses is None else new_near(n_contacts, self.n_triangles),
            threads=None if self.threads == 1 else True,
        )

    def ledger(self) -> ledger.Ledger | None:
        """The energy ledger with space for notes, or None."""
        if self.state.entries is None:
            return None
        lists = self.state.lists
        notes = (np.empty((len(part.contacts.first), ledger.NOTES)) for part in (lists.pairs, lists.surfaces))
        return ledger.Ledger(self.state.entries, *notes)

    def steps(self, n_steps: int) -> np.ndarray:
        """Make n_steps; returns the mean force and torque of the grains on every body (n, 6) in N and N m.

        Raises SimulationError on blow-up.
        """
        remaining, loads = n_steps, np.zeros((len(self.state.bodies.force), 6))
        while remaining:
            reason, done, mean = self.kernels(remaining)
            loads += mean * done
            remaining -= done
            if reason == loop.BLEW_UP:
                raise SimulationError(blow_up_message(self.state, LARGEST_STEP_RATIO, self.speed_limit))
            if reason == loop.TRIANGLES_FULL:
                self.n_triangles *= 2
            elif reason != loop.FINISHED:
                self.state.lengthen(reason)
        return loads / max(n_steps, 1)

    def prepare_grid(self) -> None:
        """Have a grid in which every triangle near a grain is found."""
        largest = float(self.state.places[:, RADIUS].max(initial=0.0))
        self.state.prepare_grid(largest + self.largest_allowance + 0.5 * self.skin + self.reach_m)

    def kernels(self, n_steps: int) -> tuple[int, int, np.ndarray]:
        """Make at most n_steps; returns the reason for the end, the number of steps made, and the mean loads of `steps`."""
        self.prepare_grid()
        state, scratch = self.state, self.scratch()
        mean_force, mean_torque = (np.zeros((len(state.bodies.force), 3)) for _ in range(2))
        if scratch.threads:
            set_num_threads(self.threads)
        limits = loop.Limits(n_steps, self.skin, self.largest_allowance, self.speed_limit)
        outputs = loop.Outputs(mean_force, mean_torque, self.ledger())
        reason, done, _, _ = loop.advance(state.view(), state.scene(), state.lists, self.model, scratch, limits, outputs)
        if reason == loop.BEHIND:
            raise SimulationError(behind_message(state, int(cast(Near, scratch.near).behind[0])))
        return reason, done, np.hstack([mean_force, mean_torque])

    def sort_in_space(self) -> None:
        """Make neighbours adjacent in memory: beyond the cache this halves the cost of a step.

        The order is that of the lists, whose cells depend on how the grains move, or of common cells where there are none yet.
        """
        lists, grains = self.state.lists, self.state.grains
        if lists.age[0] < STALE:
            self.state.restructure(lists.pairs.outer.order)
        elif is_sound(grains):
            order = np.zeros(self.state.n_grains, np.int64)
            sort_into_cells(grains, self.state.period, cell_size(grains, self.skin), order)
            self.state.restructure(order)
