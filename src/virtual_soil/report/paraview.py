"""Files for ParaView: meshio writes the grains of a moment (.vtu); the index of a time series (.pvd) is a list of those in XML.

VTK's own wheel would write the pieces too, and takes half a gigabyte. The index is what ParaView's `PVDReader` reads, a header file
that names others (https://www.paraview.org/paraview-docs/latest/python/paraview.simple.PVDReader.html): one element per file.
"""

from pathlib import Path
from xml.etree import ElementTree

import meshio
import numpy as np

from dem import Grains


def write_grains(path: str | Path, positions_m: np.ndarray, data: dict[str, np.ndarray]) -> None:
    """Each grain a vertex at its centre (n, 3), with data of shape (n,) or (n, 3)."""
    vertices = {"vertex": np.arange(len(positions_m))[:, None]}
    meshio.Mesh(positions_m, vertices, point_data=data).write(path, file_format="vtu")


def write_series(path: str | Path, folder: str | Path, moments: list[tuple[float, Grains, np.ndarray]]) -> None:
    """A file for each moment (time in s, grains, their numbers) in a folder below that of the index, and the index."""
    index = ElementTree.Element("VTKFile", type="Collection", version="0.1")
    collection = ElementTree.SubElement(index, "Collection")
    Path(folder).mkdir(parents=True)
    for k, (time_s, grains, numbers) in enumerate(moments):
        file = Path(folder) / f"{k:04d}.vtu"
        data = {"radius_m": grains.radii_m, "velocity_m_s": grains.velocities_m_s, "number": numbers}
        write_grains(file, grains.positions_m, data)
        ElementTree.SubElement(collection, "DataSet", timestep=repr(time_s), file=file.relative_to(Path(path).parent).as_posix())
    ElementTree.indent(index)
    ElementTree.ElementTree(index).write(path, encoding="utf-8", xml_declaration=True)
