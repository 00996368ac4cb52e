"""Clumps: rigid unions of spheres. `shape` has the prototypes, `union` their volume and inertia, `bodies` their motion."""
