"""The arrays of the lists: what they hold, their allocation, and what happens to them when grains are renumbered."""

from typing import NamedTuple

import numpy as np

from dem.jit import jit
from dem.layout import BLOCK, aligned_zeros
from dem.lists.slabs import GRAINS_PER_SLAB, SLABS

#: Value of `age` that stands for lists that must be rebuilt (m; finite, because kernels may assume that no value is infinite).
STALE = 1e30


class Outer(NamedTuple):
    """Rows of partners with their contact history: row (n, 2) begin and end; owner, partner (capacity,), history (capacity, rows).

    order (n,) and slab (SLABS + 1,): the grains in cell order and the first rank of each slab (pairs only).
    """

    row: np.ndarray
    owner: np.ndarray
    partner: np.ndarray
    history: np.ndarray
    order: np.ndarray
    slab: np.ndarray


class Contacts(NamedTuple):
    """The inner list: grain i, grain or surface j, entry of the outer list, and the blocks of constants and history (see `layout`).

    Slab s has count[s] contacts from begin[s] on; of surfaces, slab s has count[p] with surface w, p = s x surfaces + w.
    alike (1,): 1 if all contacts have the constants in `common` (1, rows x BLOCK), and `constants` are not used.
    """

    first: np.ndarray
    second: np.ndarray
    slot: np.ndarray
    constants: np.ndarray
    history: np.ndarray
    begin: np.ndarray
    count: np.ndarray  # type: ignore[assignment]  # hides a tuple's own count(), which is not used here
    common: np.ndarray
    alike: np.ndarray


class Neighbours(NamedTuple):
    """Outer list, a spare one of the same capacity to build the next in, and the contacts."""

    outer: Outer
    spare: Outer
    contacts: Contacts


class Lists(NamedTuple):
    """Neighbours among grains and at surfaces.

    origin (n PLACE,), allowance (n,): place records and allowances in m at the last rebuild; place (n PLACE,), within (n,): records
    where grains got their inner allowances, and these (see `dem.lists.allowance`). age (2,): STALE if the lists must be rebuilt,
    else 0; displacement of bodies in m since the surfaces' outer list was.
    """

    pairs: Neighbours
    surfaces: Neighbours
    origin: np.ndarray
    allowance: np.ndarray
    place: np.ndarray
    within: np.ndarray
    age: np.ndarray


class Widths(NamedTuple):
    """Contact precision, and number of rows of constants and history (see `dem.contact.model`)."""

    number: type
    n_constants: int
    n_history: int


def contact_capacity(n_grains: int, n_contacts: float) -> int:
    """Entries of whole blocks that hold n_contacts, cut into slabs."""
    return (int(n_contacts) // BLOCK + 2 + min(SLABS, n_grains // GRAINS_PER_SLAB)) * BLOCK


def new_outer(n: int, capacity: int, widths: Widths) -> Outer:
    """Empty outer list for n grains."""
    return Outer(
        row=np.zeros((n, 2), np.int64),
        owner=np.zeros(capacity, np.int32),
        partner=np.zeros(capacity, np.int32),
        history=np.zeros((capacity, widths.n_history), widths.number),
        order=np.zeros(n, np.int64),
        slab=np.zeros(SLABS + 1, np.int64),
    )


def new_contacts(capacity: int, n_parts: int, widths: Widths) -> Contacts:
    """Empty contact blocks, in n_parts slabs or parts."""
    contacts = Contacts(
        first=np.zeros(capacity, np.int32),
        second=np.zeros(capacity, np.int32),
        slot=np.zeros(capacity, np.int32),
        constants=aligned_zeros(capacity * widths.n_constants, widths.number).reshape(-1, widths.n_constants * BLOCK),
        history=aligned_zeros(capacity * widths.n_history, widths.number).reshape(-1, widths.n_history * BLOCK),
        begin=np.zeros(n_parts + 1, np.int64),
        count=np.zeros(n_parts, np.int64),
        common=aligned_zeros(widths.n_constants * BLOCK, widths.number).reshape(1, -1),
        alike=np.zeros(1, np.int64),
    )
    contacts.begin[n_parts] = capacity
    return contacts


def new_neighbours(n: int, capacity: int, contacts: Contacts, widths: Widths) -> Neighbours:
    """Empty outer lists for n grains beside some contacts."""
    return Neighbours(new_outer(n, capacity, widths), new_outer(n, capacity, widths), contacts)


@jit
def copy_list(source, target):
    """Copy an outer list into another of at least its capacity.

    By loops: an assignment of slices compiles the message of unequal shapes, too, which takes longer than all of this function.
    """
    m = 0
    for i in range(source.row.shape[0]):
        target.row[i, 0], target.row[i, 1] = source.row[i, 0], source.row[i, 1]
        m = max(m, source.row[i, 1])
        target.order[i] = source.order[i]
    for s in range(source.slab.shape[0]):
        target.slab[s] = source.slab[s]
    for k in range(m):
        target.owner[k] = source.owner[k]
        target.partner[k] = source.partner[k]
        for t in range(source.history.shape[1]):
            target.history[k, t] = source.history[k, t]


def owners_and_entries(outer: Outer) -> tuple[np.ndarray, np.ndarray]:
    """Owner and position of every entry of an outer list, row by row."""
    lengths = outer.row[:, 1] - outer.row[:, 0]
    owner = np.repeat(np.arange(len(lengths)), lengths)
    entry = np.arange(len(owner)) - np.repeat(np.cumsum(lengths) - lengths, lengths) + np.repeat(outer.row[:, 0], lengths)
    return owner, entry


def renumbered(outer: Outer, number: np.ndarray, partner_number: np.ndarray | None, n_grains: int):
    """Rows, partners and history of an outer list after grain k became number[k] (-1: removed) among n_grains.

    partner_number does the same for the partners; None keeps them (surfaces).
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
