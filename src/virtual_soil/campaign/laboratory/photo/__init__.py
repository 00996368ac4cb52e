"""Angle of repose from photographs: `image` reads a file, `segment` finds the heap, `outline` its flanks, `heap` the answer."""
