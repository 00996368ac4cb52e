"""A simulation on disk: everything that its future depends on, so that it goes on bit for bit as if never interrupted.

One NumPy archive (.npz): arrays by name, and a JSON text with definitions and the clock. No pickle. It is written under another
name first and then renamed, so that a file under its own name is whole; the archive has checksums.
"""

import io
import json
import os
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from dem import factory, walls
from dem.factory import Factory, Sizes
from dem.jit import source_hash
from dem.layout import GrainArrays
from dem.material import Material
from dem.simulation import Simulation

#: Name of each outer list: attributes of the list, its spare and its contacts.
LISTS = {"pairs": ("_pairs", "_spare", "_contacts"), "wall_pairs": ("_wall_pairs", "_wall_spare", "_wall_contacts")}
#: Arrays of an outer list that have a value per entry.
PER_ENTRY = ("owner", "partner", "history")

#: Before the names of arrays that are notes.
NOTE = "notes."


class CheckpointError(ValueError):
    """A file that is no checkpoint of this engine."""


def save(simulation: Simulation, path: str | Path, notes: dict | None = None) -> None:
    """Write a simulation to a file, whole or not at all.

    notes: what the caller wants to find again beside it (`load_with_notes`); name -> array, or a plain value that JSON can hold.
    """
    path, notes = Path(path), notes or {}
    part = path.with_name(f"{path.name}.{os.getpid()}.part")  # its own, should two processes save the same
    noted = {f"{NOTE}{name}": value for name, value in notes.items() if isinstance(value, np.ndarray)}
    plain = {name: value for name, value in notes.items() if not isinstance(value, np.ndarray)}
    description = json.dumps(description_of(simulation) | {"notes": plain})
    arrays: dict[str, Any] = {**arrays_of(simulation), **noted, "description": np.array(description)}
    try:
        with open(part, "wb") as file:
            np.savez(file, **arrays)
            file.flush()
            os.fsync(file.fileno())
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)


def load(path: str | Path) -> Simulation:
    """The simulation that was saved in a file.

    Raises
    ------
    CheckpointError : the file is damaged, is no checkpoint, or was written by other source code (it would not go on alike).
    """
    return load_with_notes(path)[0]


def load_with_notes(path: str | Path) -> tuple[Simulation, dict]:
    """The simulation that was saved in a file, and the notes beside it; raises what `load` raises."""
    content = io.BytesIO(Path(path).read_bytes())
    try:
        with np.load(content, allow_pickle=False) as archive:
            arrays = dict(archive)
            description = json.loads(str(arrays.pop("description")))
        if description["engine"] != source_hash():
            raise CheckpointError(f"{path} was written by another version of the engine; delete it to begin anew.")
        noted = {name.removeprefix(NOTE): arrays.pop(name) for name in list(arrays) if name.startswith(NOTE)}
        return restored(description, arrays), description["notes"] | noted
    except CheckpointError:
        raise
    except Exception as error:  # the readers of archives, arrays and JSON have a dozen ways to say that a file is damaged
        reason = " ".join(f"{type(error).__name__}: {error}".split())[:200]
        raise CheckpointError(f"{path} is no readable checkpoint ({reason}); delete it to begin anew.") from error


def description_of(simulation: Simulation) -> dict:
    """What is not an array, as JSON can hold it."""
    return {
        "engine": source_hash(),
        "settings": simulation._settings,
        "materials": {name: asdict(material) for name, material in simulation.materials.items()},
        "walls": [{"type": type(wall).__name__} | asdict(wall) for wall in simulation._wall_definitions],
        "factories": [
            {"region_type": type(made.region).__name__} | asdict(made) for made in simulation._factories
        ],
        "clock": {"time_s": simulation.time_s, "n_steps": simulation.n_steps, "n_left": simulation.n_left},
        "exchanged_j": simulation._exchanged_j,
        "mean_wall_forces_n": {name: force.tolist() for name, force in simulation.mean_wall_forces_n.items()},
        "rooms": {name: [len(getattr(simulation, names[0]).partner), len(getattr(simulation, names[2]).first)]
                  for name, names in LISTS.items()},
    }  # fmt: skip


def arrays_of(simulation: Simulation) -> dict[str, np.ndarray]:
    """Name -> array."""
    arrays = {name: getattr(simulation, f"_{name}") for name in ("material", "ids", "origin", "list_age", "glued", "carrier")}
    for name, values in simulation._grains._asdict().items():
        arrays[f"grains.{name}"] = values
    arrays["pair_table"] = simulation._pair_table
    for name, value in simulation._walls._asdict().items():
        arrays[f"walls.{name}"] = value
    for name, (outer_name, _, contacts_name) in LISTS.items():
        outer = getattr(simulation, outer_name)
        arrays[f"{name}.begin"] = getattr(simulation, contacts_name).begin
        used = int(outer.row.max(initial=0))
        arrays |= {f"{name}.row": outer.row, f"{name}.order": outer.order, f"{name}.slab": outer.slab}
        arrays |= {f"{name}.{field}": getattr(outer, field)[:used] for field in PER_ENTRY}
    if simulation._entries is not None:
        arrays["entries"] = simulation._entries
    return arrays


def restored(description: dict, arrays: dict[str, np.ndarray]) -> Simulation:
    """The simulation of a description and its arrays."""
    materials = {name: Material(**values) for name, values in description["materials"].items()}
    simulation = Simulation(materials=materials, interactions={}, **description["settings"])
    simulation._pair_table[:] = arrays["pair_table"]
    simulation._wall_definitions = [wall_of(dict(values)) for values in description["walls"]]
    simulation._walls = walls.WallArrays(*(arrays[f"walls.{name}"] for name in walls.WallArrays._fields))
    simulation._factories = [factory_of(dict(values)) for values in description["factories"]]
    simulation.time_s, simulation.n_steps, simulation.n_left = description["clock"].values()
    simulation._exchanged_j = description["exchanged_j"]
    simulation.mean_wall_forces_n = {name: np.array(force) for name, force in description["mean_wall_forces_n"].items()}
    grains = GrainArrays(*(arrays[f"grains.{name}"] for name in GrainArrays._fields))
    simulation._allocate(grains, arrays["material"], arrays["ids"])
    for name, names in LISTS.items():
        begin, (capacity, room) = arrays[f"{name}.begin"], description["rooms"][name]
        lists = simulation._new_lists(simulation.n_grains, capacity, room, len(begin) - 1)
        for attribute, value in zip(names, lists, strict=True):
            setattr(simulation, attribute, value)
        lists[2].begin[:] = begin
        outer, used = lists[0], len(arrays[f"{name}.partner"])
        for field in ("row", "order", "slab"):
            getattr(outer, field)[:] = arrays[f"{name}.{field}"]
        for field in PER_ENTRY:
            getattr(outer, field)[:used] = arrays[f"{name}.{field}"]
    simulation._origin, simulation._list_age = arrays["origin"], arrays["list_age"]
    simulation._glued, simulation._carrier = arrays["glued"], arrays["carrier"]
    if simulation._entries is not None:
        simulation._entries[:] = arrays["entries"]
    return simulation


def wall_of(values: dict) -> walls.Wall:
    """A wall's definition from JSON."""
    kind = {"Box": walls.Box, "Tube": walls.Tube}[values.pop("type")]
    drive = values.pop("drive")
    tuples = {key: tuple(value) if isinstance(value, list) else value for key, value in values.items()}
    return kind(**tuples, drive=None if drive is None else walls.Drive(**drive))


def factory_of(values: dict) -> Factory:
    """A factory from JSON."""
    kind = {"TubeRegion": factory.TubeRegion, "BoxRegion": factory.BoxRegion}[values.pop("region_type")]
    region = {key: tuple(value) if isinstance(value, list) else value for key, value in values.pop("region").items()}
    sizes, velocity = Sizes(**values.pop("sizes")), tuple(values.pop("velocity_m_s"))
    return Factory(**values, region=kind(**region), sizes=sizes, velocity_m_s=velocity)
