"""Clumps: rigid unions of spheres.

`shape` has the prototypes, `mix` several of them, `union` their volume and inertia, `records` the arrays, `motion` how they move.
"""
