"""A simulation on disk: its settings and state (`dem.state`), so that it continues bit for bit as if never interrupted.

One NumPy archive (.npz): arrays by name, and a JSON text with definitions and the clock. No pickle. It is written under another
name first and then renamed, so that a file under its final name is complete; the archive has checksums.
"""

import io
import json
import os
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from dem import factory, shapes
from dem.bodies import Bodies, Glued, Surfaces
from dem.clumps.mix import shape_of
from dem.clumps.records import Clumps
from dem.factory import Factory, Sizes
from dem.jit import source_hash
from dem.layout import GrainArrays
from dem.lists.storage import Lists
from dem.material import Material
from dem.poses import Poses
from dem.simulation import Simulation
from dem.state import SimulationState

#: Fields of the state that are plain values, and that are tuples of arrays.
PLAIN = ("exchanged_j", "time_s", "n_steps", "n_left", "n_wholes_left")
TUPLES: dict[str, Any] = {"grains": GrainArrays, "bodies": Bodies, "surfaces": Surfaces, "glued": Glued}
#: Arrays of an outer list with a value per entry, and per grain or slab.
PER_ENTRY, PER_GRAIN = ("owner", "partner", "history"), ("row", "order", "slab")
#: Arrays of the lists that are neither pairs nor surfaces.
NOTED = ("origin", "allowance", "place", "within", "age")

#: Attributes of a mesh that are stored as arrays.
MESH_ARRAYS = ("vertices_m", "triangles")

#: Before the names of arrays that are notes.
NOTE = "notes."


class CheckpointError(ValueError):
    """A file that is no checkpoint of this engine."""


def save(simulation: Simulation, path: str | Path, notes: dict | None = None) -> None:
    """Write a simulation to a file, whole or not at all.

    notes : data of the caller to be stored with it (`load_with_notes`); name -> array, or a plain value that JSON can hold.
    """
    path = Path(path)
    part = path.with_name(f"{path.name}.{os.getpid()}.part")  # unique: two processes may save the same simulation
    try:
        with open(part, "wb") as file:
            write(simulation, file, notes or {})
            file.flush()
            os.fsync(file.fileno())
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)


def write(simulation: Simulation, file: BinaryIO, notes: dict) -> None:
    """Write the archive of a simulation and of notes into an open file."""
    noted = {f"{NOTE}{name}": value for name, value in notes.items() if isinstance(value, np.ndarray)}
    plain = {name: value for name, value in notes.items() if not isinstance(value, np.ndarray)}
    description = json.dumps(description_of(simulation) | {"notes": plain})
    arrays: dict[str, Any] = {**arrays_of(simulation._state), **noted, "description": np.array(description)}
    np.savez(file, **arrays)


def packed(simulation: Simulation) -> np.ndarray:
    """The archive of a simulation as an array of bytes, which another checkpoint can hold among its notes."""
    content = io.BytesIO()
    write(simulation, content, {})
    return np.frombuffer(content.getvalue(), np.uint8)


def unpacked(archive: np.ndarray, threads: int | None = None) -> Simulation:
    """The simulation of an array of `packed`; the checkpoint that may have held it is of this engine.

    threads : number of threads from now on, by default as before; results do not depend on it.
    """
    return read(archive.tobytes(), "a packed simulation", None, threads)[0]


def load(path: str | Path) -> Simulation:
    """The simulation that was saved in a file.

    Raises
    ------
    CheckpointError : the file is damaged, is no checkpoint, or was written by other source code (it would continue differently).
    """
    return load_with_notes(path)[0]


def load_with_notes(path: str | Path) -> tuple[Simulation, dict]:
    """The simulation that was saved in a file, and the notes beside it; raises what `load` raises."""
    return read(Path(path).read_bytes(), path, source_hash())


def read(content: bytes, path: str | Path, engine: str | None, threads: int | None = None) -> tuple[Simulation, dict]:
    """The simulation and the notes of an archive's bytes; path : its name in messages, engine : hash that it must have.

    threads : as in `unpacked`.
    """
    try:
        with np.load(io.BytesIO(content), allow_pickle=False) as archive:
            arrays = dict(archive)
            description = json.loads(str(arrays.pop("description")))
        if engine is not None and description["engine"] != engine:
            raise CheckpointError(f"{path} was written by another version of the engine; delete it to begin anew.")
        noted = {name.removeprefix(NOTE): arrays.pop(name) for name in list(arrays) if name.startswith(NOTE)}
        description["settings"] |= {} if threads is None else {"threads": threads}
        return restored(description, arrays), description["notes"] | noted
    except CheckpointError:
        raise
    except Exception as error:  # readers of archives, arrays and JSON raise a dozen types for a damaged file
        reason = " ".join(f"{type(error).__name__}: {error}".split())[:200]
        raise CheckpointError(f"{path} is no readable checkpoint ({reason}); delete it to begin anew.") from error


def description_of(simulation: Simulation) -> dict:
    """All that is not an array, as JSON can hold it."""
    state = simulation._state
    lists = {"pairs": state.lists.pairs, "surfaces": state.lists.surfaces}
    return {
        "engine": source_hash(),
        "settings": simulation._settings,
        "materials": {name: asdict(material) for name, material in simulation.materials.items()},
        "state": {name: getattr(state, name) for name in PLAIN},
        "walls": [definition_of(wall) for wall in state.walls],
        "factories": [{"region_type": type(made.region).__name__} | asdict(made) for made in state.factories],
        "mean_wall_forces_n": {name: force.tolist() for name, force in state.mean_wall_forces_n.items()},
        "mean_wall_torques_n_m": {name: torque.tolist() for name, torque in state.mean_wall_torques_n_m.items()},
        "capacities": {name: [len(part.outer.partner), len(part.contacts.first)] for name, part in lists.items()},
    }


def arrays_of(state: SimulationState) -> dict[str, np.ndarray]:
    """Name -> array."""
    arrays = {name: getattr(state, name) for name in ("material", "ids", "wholes", "kinds", "pair_table")}
    arrays |= {f"lists.{name}": getattr(state.lists, name) for name in NOTED}
    for name in TUPLES:
        arrays |= {f"{name}.{key}": value for key, value in getattr(state, name)._asdict().items()}
    for w, wall in enumerate(state.walls):
        if isinstance(wall, shapes.Mesh):
            arrays |= {f"walls.{w}.{key}": getattr(wall, key) for key in MESH_ARRAYS}
    if state.poses is not None:
        arrays |= {f"poses.{key}": value for key, value in state.poses._asdict().items()}
    if state.clumps is not None:
        arrays |= {f"clumps.{key}": value for key, value in state.clumps._asdict().items()}
    for name in ("pairs", "surfaces"):
        part = getattr(state.lists, name)
        used = int(part.outer.row.max(initial=0))
        arrays[f"{name}.begin"] = part.contacts.begin
        arrays |= {f"{name}.{key}": getattr(part.outer, key) for key in PER_GRAIN}
        arrays |= {f"{name}.{key}": getattr(part.outer, key)[:used] for key in PER_ENTRY}
    if state.entries is not None:
        arrays["entries"] = state.entries
    return arrays


def restored(description: dict, arrays: dict[str, np.ndarray]) -> Simulation:
    """The simulation of a description and its arrays."""
    materials = {name: Material(**values) for name, values in description["materials"].items()}
    walls = [wall_of(dict(values), w, arrays) for w, values in enumerate(description["walls"])]
    simulation = Simulation(materials=materials, interactions={}, walls=walls, **description["settings"])
    state = simulation._state
    for name in PLAIN:
        setattr(state, name, description["state"][name])
    state.walls = walls
    state.factories = [factory_of(dict(values)) for values in description["factories"]]
    for name in ("mean_wall_forces_n", "mean_wall_torques_n_m"):
        setattr(state, name, {wall: np.array(values) for wall, values in description[name].items()})
    state.pair_table[:] = arrays["pair_table"]
    if state.entries is not None:
        state.entries[:] = arrays["entries"]
    tuples = {name: kind(*(arrays[f"{name}.{key}"] for key in kind._fields)) for name, kind in TUPLES.items()}
    state.bodies, state.surfaces, state.glued = tuples["bodies"], tuples["surfaces"], tuples["glued"]
    state.allocate(tuples["grains"], *(arrays[name] for name in ("material", "ids", "wholes", "kinds")))
    if "poses.position" in arrays:
        simulation._ensure_compiled(turning=True)
        state.poses = Poses(*(arrays[f"poses.{key}"] for key in Poses._fields))
    if "clumps.begin" in arrays:
        simulation._ensure_compiled(clumps=True)
        state.clumps = Clumps(*(arrays[f"clumps.{key}"] for key in Clumps._fields))
    restore_lists(state, description["capacities"], arrays)
    return simulation


def restore_lists(state: SimulationState, capacities: dict[str, list[int]], arrays: dict[str, np.ndarray]) -> None:
    """Fill the lists, at the capacities that they had."""
    pairs, surfaces = state.new_pairs(*capacities["pairs"]), state.new_surface_pairs(*capacities["surfaces"])
    for name, part in (("pairs", pairs), ("surfaces", surfaces)):
        part.contacts.begin[:] = arrays[f"{name}.begin"]
        for key in PER_GRAIN:
            getattr(part.outer, key)[:] = arrays[f"{name}.{key}"]
        for key in PER_ENTRY:
            getattr(part.outer, key)[: len(arrays[f"{name}.partner"])] = arrays[f"{name}.{key}"]
    state.lists = Lists(pairs, surfaces, *(arrays[f"lists.{name}"] for name in NOTED))


def definition_of(wall: shapes.Wall) -> dict:
    """A wall's definition as JSON can hold it, without the arrays of a mesh."""
    values = {field.name: getattr(wall, field.name) for field in fields(wall) if field.name not in MESH_ARRAYS}
    turn = None if wall.turn is None else {"type": type(wall.turn).__name__} | asdict(wall.turn)
    return {"type": type(wall).__name__} | values | {"drive": [asdict(drive) for drive in wall.drives], "turn": turn}


def wall_of(values: dict, w: int, arrays: dict[str, np.ndarray]) -> shapes.Wall:
    """Wall w from its definition and the arrays of a mesh."""
    kind = shapes.by_name(values.pop("type"))
    drives, turn = tuple(shapes.Drive(**drive) for drive in values.pop("drive")), values.pop("turn")
    tuples = {key: tuple(value) if isinstance(value, list) else value for key, value in values.items()}
    tuples |= {key: arrays[f"walls.{w}.{key}"] for key in MESH_ARRAYS if f"walls.{w}.{key}" in arrays}
    drive = drives[0] if len(drives) == 1 else drives or None
    return kind(**tuples, drive=drive, turn=None if turn is None else turn_of(turn))


def turn_of(values: dict) -> shapes.TurnDrive | shapes.FreeTurn:
    """The drive of a rotation from JSON."""
    kind = {"TurnDrive": shapes.TurnDrive, "FreeTurn": shapes.FreeTurn}[values.pop("type")]
    return kind(**{key: tuple(value) if isinstance(value, list) else value for key, value in values.items()})


def factory_of(values: dict) -> Factory:
    """A factory from JSON."""
    kind = {"TubeRegion": factory.TubeRegion, "BoxRegion": factory.BoxRegion}[values.pop("region_type")]
    region = {key: tuple(value) if isinstance(value, list) else value for key, value in values.pop("region").items()}
    sizes, velocity = Sizes(**values.pop("sizes")), tuple(values.pop("velocity_m_s"))
    shape = values.pop("shape")
    made = None if shape is None else shape_of(shape)
    return Factory(**values, region=kind(**region), sizes=sizes, velocity_m_s=velocity, shape=made)
