"""Meshes from files: STL, OBJ and PLY, and STEP where `cascadio` is installed (`pip install virtual-soil[step]`)."""

from pathlib import Path

import numpy as np

from dem.material import require
from dem.meshes.topology import welded
from dem.shapes.mesh import Mesh

#: Unit of a file's coordinates -> metres.
UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "in": 0.0254}

SURFACES, SOLIDS = (".stl", ".obj", ".ply"), (".step", ".stp")

#: Vertices closer than this share of the mesh's size are one.
WELD = 1e-7


def read_mesh(path: str | Path, unit: str, **wall) -> Mesh:
    """The surface of a file, as the shape of a `dem.Body`.

    Parameters
    ----------
    path : STL, OBJ, PLY, or STEP. unit : of its coordinates, one of UNITS (STL files do not tell), or "m" for STEP.
    wall : attributes of `dem.Mesh`.

    Raises
    ------
    ValueError : the file cannot be read, or is no surface that grains could touch; the message names file and fault.
    """
    path = Path(path)
    require(unit in UNITS, f"unit of {path.name}", repr(unit), f"one of {list(UNITS)}")
    require(path.is_file(), "mesh file", path, "a file that exists")
    known = SURFACES + SOLIDS
    require(path.suffix.lower() in known, f"kind of {path.name}", repr(path.suffix), f"one of {list(known)}")
    if path.suffix.lower() in SOLIDS:
        require(unit == "m", f"unit of {path.name}", repr(unit), "'m', in which STEP files are read: they tell their own")
    vertices, triangles = content_of(path)
    require(len(triangles) > 0, f"number of triangles of {path.name}", 0, "at least one")
    return Mesh(**{"source": path.name} | wall, vertices_m=UNITS[unit] * joined(vertices), triangles=triangles)


def content_of(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (n, 3) in the file's unit (STEP: in m) and triangles (m, 3)."""
    import trimesh  # imported here: it takes a second

    if path.suffix.lower() in SOLIDS:
        try:
            import cascadio  # noqa: F401  # trimesh calls it
        except ImportError:
            raise ValueError(f"{path.name}: STEP files need cascadio; install it with `pip install virtual-soil[step]`.") from None
    try:
        mesh = trimesh.load_mesh(path, process=False)
        return np.asarray(mesh.vertices, float), np.asarray(mesh.faces, np.int64)
    except Exception as error:  # its readers raise many types for a damaged file
        reason = " ".join(f"{type(error).__name__}: {error}".split())[:200]
        raise ValueError(f"{path.name} is no readable mesh ({reason}).") from error


def write_mesh(mesh: Mesh, path: str | Path) -> None:
    """Write a mesh where it is now, in metres, as STL, OBJ or PLY; ParaView opens numbered files as a series."""
    import trimesh  # see `content_of`

    require(Path(path).suffix.lower() in SURFACES, "mesh file", path, f"a name that ends in one of {list(SURFACES)}")
    corners = mesh.corners_m.reshape(-1, 3)
    vertices, triangles = welded(corners, np.arange(len(corners)).reshape(-1, 3))
    trimesh.Trimesh(vertices, triangles, process=False).export(path)


def joined(vertices: np.ndarray) -> np.ndarray:
    """Vertices (n, 3), those that are nearly one at the coordinates of the first."""
    size = np.ptp(vertices, axis=0).max()
    if not np.isfinite(size) or size == 0.0:
        return vertices
    _, first, number = np.unique(np.round(vertices / (WELD * size)), axis=0, return_index=True, return_inverse=True)
    return vertices[first[number.ravel()]]
