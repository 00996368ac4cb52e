"""Adapt rule `animate` to `virtual_soil.report.film`."""

from _log import log_to
from virtual_soil.report.experiments import EXPERIMENTS
from virtual_soil.report.film import animate
from virtual_soil.report.paraview import write_series


def main(name, row, settings, output):
    (experiment,) = (experiment for experiment in EXPERIMENTS if experiment.NAME == name)
    frames = animate(experiment, row, settings, output.film)
    write_series(output.series, output.moments, [(frame.time_s, frame.grains, frame.numbers) for frame in frames])


if __name__ == "__main__":
    log_to(snakemake.log[0])
    main(snakemake.wildcards.experiment, snakemake.params.row, snakemake.params.settings, snakemake.output)
