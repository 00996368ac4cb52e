"""Adapt rule `record_lift` to the angle-of-repose test: simulate the base point's once more and keep moments of the lift."""

import numpy as np

from _log import log_to
from animate import film_lift
from virtual_soil.campaign.simulate import grain_table, provenance
from virtual_soil.campaign.tables import write_table

#: Moments that are kept.
N_FRAMES = 31


def frame_table(frames, simulation: str) -> dict[str, np.ndarray]:
    """All frames' grains of a simulation as columns of one table."""
    parts = []
    for number, frame in enumerate(frames):
        tube, n = frame.walls["tube"], len(frame.grains)
        constant = {"time_s": frame.time_s - frames[0].time_s, "tube_bottom_m": tube.bottom_m, "tube_radius_m": tube.radius_m}
        columns = {name: np.full(n, value) for name, value in constant.items()}
        parts.append({**grain_table(frame.grains, simulation), **columns, "frame": np.full(n, number), "grain": frame.numbers})
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def main(row, settings, engine, path):
    _, film = film_lift(row, settings)
    write_table(frame_table(film.shown(N_FRAMES), row["simulation_id"]), path, "lift", provenance([(row, settings)], engine))


if __name__ == "__main__":
    log_to(snakemake.log[0])
    main(snakemake.params.row, snakemake.params.settings, snakemake.params.engine, snakemake.output.lift)
