"""Measurements on a finished simulation: the heap's angle and height, the sheared soil's strength."""
