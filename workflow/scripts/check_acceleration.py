"""Adapt rule `check_acceleration` to `virtual_soil.calibration.checks`."""

from importlib import import_module

from _log import log_to
from virtual_soil.calibration.checks import FidelityCheck, acceleration_table
from virtual_soil.campaign.experiments import module_of
from virtual_soil.campaign.experiments.registry import BY_NAME
from virtual_soil.campaign.inference import read_tables
from virtual_soil.campaign.tables import write_table


def check(name, runs):
    experiment = BY_NAME[name]
    compared = import_module(module_of(name, "measure")).compared(runs)
    return FidelityCheck(name, runs.assign(**{experiment.COMPARED: compared}), experiment.COMPARED, experiment.LOAD)


if __name__ == "__main__":
    log_to(snakemake.log[0])
    table = acceleration_table([check(name, runs) for name, runs in read_tables(snakemake.input.tables).items()])
    write_table(table, snakemake.output.table, "acceleration", {"rule": snakemake.rule, **dict(snakemake.params.items())})
