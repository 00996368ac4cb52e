"""Files for ParaView: meshio writes the grains of a moment (.vtu); the index of a time series (.pvd) is a list of those in XML.

VTK's own wheel would write the pieces too, and takes half a gigabyte. The index is what ParaView's `PVDReader` reads, a header file
that names others (https://www.paraview.org/paraview-docs/latest/python/paraview.simple.PVDReader.html): one element per file.
"""

from pathlib import Path
from xml.etree import ElementTree

import meshio
import numpy as np

from dem import Grains, Mesh


def write_grains(path: str | Path, positions_m: np.ndarray, data: dict[str, np.ndarray]) -> None:
    """Each grain a vertex at its centre (n, 3), with data of shape (n,) or (n, 3)."""
    vertices = {"vertex": np.arange(len(positions_m))[:, None]}
    meshio.Mesh(positions_m, vertices, point_data=data).write(path, file_format="vtu")


def write_series(path: str | Path, folder: str | Path, moments: list[tuple[float, Grains, np.ndarray]]) -> None:
    """A file for each moment (time in s, grains, their numbers) in a folder below that of the index, and the index."""
    Path(folder).mkdir(parents=True)
    files = []
    for k, (time_s, grains, numbers) in enumerate(moments):
        file = Path(folder) / f"{k:04d}.vtu"
        data = {"radius_m": grains.radii_m, "velocity_m_s": grains.velocities_m_s, "number": numbers}
        write_grains(file, grains.positions_m, data)
        files.append((time_s, file))
    write_index(path, files)


def write_surfaces(path: str | Path, folder: str | Path, moments: list[tuple[float, Mesh]]) -> None:
    """As `write_series`, of a mesh at each moment (time in s, mesh)."""
    Path(folder).mkdir(parents=True)
    files = [(time_s, Path(folder) / f"{k:04d}.vtu") for k, (time_s, _) in enumerate(moments)]
    for (_, file), (_, mesh) in zip(files, moments, strict=True):
        corners = mesh.corners_m.reshape(-1, 3)
        meshio.Mesh(corners, {"triangle": np.arange(len(corners)).reshape(-1, 3)}).write(file, file_format="vtu")
    write_index(path, files)


def write_index(path: str | Path, files: list[tuple[float, Path]]) -> None:
    """The index of files at their times in s; they lie below its folder."""
    index = ElementTree.Element("VTKFile", type="Collection", version="0.1")
    collection = ElementTree.SubElement(index, "Collection")
    for time_s, file in files:
        ElementTree.SubElement(collection, "DataSet", timestep=repr(time_s), file=file.relative_to(Path(path).parent).as_posix())
    ElementTree.indent(index)
    ElementTree.ElementTree(index).write(path, encoding="utf-8", xml_declaration=True)
