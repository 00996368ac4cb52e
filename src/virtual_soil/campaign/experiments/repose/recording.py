"""The recorded lift of a heap as a table."""

import numpy as np

from dem.experiments.soil import Soil
from virtual_soil.campaign.grains import grain_table


def frame_table(frames: list, simulation: str, soil: Soil | None = None) -> dict[str, np.ndarray]:
    """Return grains and tube of all frames of a film as columns of one table; soil : the grains', if they are clumps."""
    parts = []
    for number, frame in enumerate(frames):
        tube, n = frame.walls["tube"], len(frame.grains)
        constant = {"time_s": frame.time_s - frames[0].time_s, "tube_bottom_m": tube.bottom_m, "tube_radius_m": tube.radius_m}
        columns = {name: np.full(n, value) for name, value in constant.items()}
        columns |= {"frame": np.full(n, number), "grain": frame.numbers}
        parts.append({**grain_table(frame.grains, simulation, soil), **columns})
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
