"""Contact history: carried from list to list, and between the outer list and the blocks."""

from dem.jit import lean_jit, strict_jit
from dem.layout import BLOCK
from dem.lists.blocks import in_block


@strict_jit
def carry_history(old, new, in_pairs):
    """Copy the history of every entry that has some in the old list to that entry of the new; all others start at zero.

    A pair may now be owned by its other grain: the history of (j, i) is that of (i, j) with opposite sign. Not so with surfaces
    (in_pairs False). Entries that never touched have none, and most of a list is of these.
    """
    clear_history(new)
    for i in range(old.row.shape[0]):
        for k in range(old.row[i, 0], old.row[i, 1]):
            if has_history(old, k):
                j = old.partner[k]
                found = copy_entry(old, k, new, i, j, 1)
                if in_pairs and not found:
                    copy_entry(old, k, new, j, i, -1)


@strict_jit
def clear_history(outer):
    """Set the history of all entries to zero."""
    for i in range(outer.row.shape[0]):
        for k in range(outer.row[i, 0], outer.row[i, 1]):
            for t in range(outer.history.shape[1]):
                outer.history[k, t] = 0.0


@strict_jit
def has_history(outer, k):
    """True if a value of entry k is not zero."""
    for t in range(outer.history.shape[1]):
        if outer.history[k, t] != 0.0:
            return True
    return False


@strict_jit
def copy_entry(old, k, new, i, j, sign):
    """Copy the history of entry k of the old list, times sign, to entry (i, j) of the new; True if it exists."""
    for q in range(new.row[i, 0], new.row[i, 1]):
        if new.partner[q] == j:
            for t in range(new.history.shape[1]):
                new.history[q, t] = sign * old.history[k, t]
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
