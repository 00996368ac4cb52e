"""Definitions that a shear strength rests on, one for simulated and for laboratory tests."""

#: The plateau is the mean over this last fraction of the displacement.
PLATEAU_WINDOW = 0.3
