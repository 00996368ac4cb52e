"""Contact history: carried from list to list, and between the outer list and the blocks."""

from dem.jit import lean_jit, strict_jit
from dem.layout import BLOCK
from dem.lists.blocks import in_block


@strict_jit
def carry_history(old, new, in_pairs):
    """Copy the history of every entry that was in the old list; new entries start at zero.

    A pair may now be owned by its other grain: the history of (j, i) is that of (i, j) with opposite sign. Not so with surfaces
    (in_pairs False).
    """
    for i in range(new.row.shape[0]):
        for k in range(new.row[i, 0], new.row[i, 1]):
            j = new.partner[k]
            new.history[k] = 0.0
            found = copy_entry(old, i, j, new, k, 1)
            if in_pairs and not found:
                copy_entry(old, j, i, new, k, -1)


@strict_jit
def copy_entry(old, i, j, new, k, sign):
    """Copy the history of entry (i, j) of the old list, times sign, to entry k of the new; True if it existed."""
    for q in range(old.row[i, 0], old.row[i, 1]):
        if old.partner[q] == j:
            for t in range(new.history.shape[1]):
                new.history[k, t] = sign * old.history[q, t]
            return True
    return False


@lean_jit
def load_history(s, contacts, history):
    """Copy the contact history of part s of the contacts from the outer list to the blocks."""
    k, end = contacts.begin[s], contacts.begin[s] + contacts.count[s]
    while k < end:
        n = in_block(k, end)
        slot, h = contacts.slot[k : k + n], contacts.history[k // BLOCK, k % BLOCK :]
        for t in range(history.shape[1]):
            for q in range(n):
                h[t * BLOCK + q] = history[slot[q], t]
        k += n


@lean_jit
def save_history(s, contacts, history):
    """Copy the contact history of part s of the contacts from the blocks back to the outer list, and forget the contacts."""
    k, end = contacts.begin[s], contacts.begin[s] + contacts.count[s]
    while k < end:
        n = in_block(k, end)
        slot, h = contacts.slot[k : k + n], contacts.history[k // BLOCK, k % BLOCK :]
        for t in range(history.shape[1]):
            for q in range(n):
                history[slot[q], t] = h[t * BLOCK + q]
        k += n
    contacts.count[s] = 0
