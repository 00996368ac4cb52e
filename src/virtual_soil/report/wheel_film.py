"""Film of a wheel's travel, as a GIF and for ParaView."""

from pathlib import Path
from typing import cast

import numpy as np

from dem import Grains, Mesh
from virtual_soil.campaign.recording import Frame
from virtual_soil.report.film import write_gif
from virtual_soil.report.paraview import write_series, write_surfaces


def layers(grains: Grains) -> np.ndarray:
    """Colours (n,) of layers by the height in the first frame, so that a film shows how the soil flows."""
    height = grains.positions_m[:, 2] / (8.0 * grains.radii_m.mean())
    return np.floor(height) % 2.0 + 0.1


def write_film(frames: list[Frame], title: str, gif: str, series: str, moments: str, surfaces: str) -> None:
    """Write the GIF, seen from the side, the half in front of the wheel's middle plane cut away; and files for ParaView.

    series, surfaces : indices (.pvd) of grains and wheel. moments : folder of their files.
    """
    start = frames[0].time_s
    write_gif(
        gif, frames, layers(frames[0].grains), lambda frame: f"{title}, {frame.time_s - start:.3f} s", cut=True, bodies=["wheel"]
    )
    write_series(series, moments, [(frame.time_s - start, frame.grains, frame.numbers) for frame in frames])
    wheels = [(frame.time_s - start, cast(Mesh, frame.walls["wheel"])) for frame in frames]
    write_surfaces(surfaces, Path(moments) / "wheel", wheels)
