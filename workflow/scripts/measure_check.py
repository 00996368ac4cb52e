"""Adapt rule `measure_check` to `virtual_soil.wheel.check.check_table`."""

from _log import log_to
from virtual_soil.campaign.tables import write_table
from virtual_soil.wheel.check import check_table
from virtual_soil.wheel.check_runs import runs_of
from virtual_soil.wheel.check_tests import tests_in

if __name__ == "__main__":
    log_to(snakemake.log[0])
    files, params = dict(snakemake.input.items()), dict(snakemake.params.items())
    runs, tests = runs_of(files, params["changes"]), tests_in(files["tests"], params["tests"])
    said = {"runs": params["changes"], **params["grains"]}
    table = check_table(runs, tests, params["references"], said, params["settings"], params["limits"])
    write_table(table, snakemake.output.table, "wheel_check", {"rule": snakemake.rule, **params})
