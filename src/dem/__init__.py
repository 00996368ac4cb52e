"""A discrete-element engine for spheres and clumps of them: Hertz-Mindlin contacts, rolling resistance, bodies of any shape.

>>> import dem
>>> glass = dem.Material(density_kg_m3=2500, poisson_ratio=0.2, shear_modulus_pa=5e6)
>>> touch = dem.Interaction(restitution=0.5, static_friction=0.3, rolling_friction=0.1)
>>> floor = dem.Box(name="floor", material="glass", low_m=(-1, -1, 0), high_m=(1, 1, 0))
>>> simulation = dem.Simulation(
...     materials={"glass": glass}, interactions={("glass", "glass"): touch}, walls=[floor], smallest_radius_m=1e-3
... )
>>> simulation.add_grains([(0, 0, 1.5e-3)], 1e-3, "glass")
>>> simulation.run(0.1)
True
>>> simulation.is_static()
True
"""

from dem.checkpoint import CheckpointError, load, load_with_notes, packed, save, unpacked
from dem.clumps.mix import Mix
from dem.clumps.records import ClumpStates
from dem.clumps.shape import Clump
from dem.contact.model import work_of_adhesion
from dem.factory import BoxRegion, Factory, Sizes, TubeRegion, drawn_kinds
from dem.html import Rich
from dem.material import Interaction, Material
from dem.meshes.files import read_mesh, write_mesh
from dem.readings import WallContacts
from dem.shapes import ENDLESS_M, Body, Box, Drive, FreeTurn, Mesh, Motion, Tube, TurnDrive, Wall
from dem.simulation import Grains, Simulation, SimulationError
from dem.timestep import rayleigh_time, stable_time_step

__all__ = [
    "ENDLESS_M",
    "Body",
    "Box",
    "BoxRegion",
    "CheckpointError",
    "Clump",
    "ClumpStates",
    "Drive",
    "Factory",
    "FreeTurn",
    "Grains",
    "Interaction",
    "Material",
    "Mesh",
    "Mix",
    "Motion",
    "Rich",
    "Simulation",
    "SimulationError",
    "Sizes",
    "Tube",
    "TubeRegion",
    "TurnDrive",
    "Wall",
    "WallContacts",
    "drawn_kinds",
    "load",
    "load_with_notes",
    "packed",
    "rayleigh_time",
    "read_mesh",
    "save",
    "stable_time_step",
    "unpacked",
    "work_of_adhesion",
    "write_mesh",
]
