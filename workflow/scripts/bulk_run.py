"""Adapt rule `bulk_run` to `virtual_soil.bulk.cases.run`."""

import tempfile
from pathlib import Path

from _log import log_to
from virtual_soil.bulk import cases
from virtual_soil.bulk.packings import of_table
from virtual_soil.bulk.peer import processor
from virtual_soil.campaign.tables import read_table, write_table
from virtual_soil.errors import InputError
from virtual_soil.verification.peers.liggghts import PeerError


def main(case: str, code: str, variant: str, path: str, output, source: dict):
    packing, setup = of_table(read_table(path, "bulk_packing"), path), cases.module_of(case).SETUPS[variant]
    print(f"{setup.duration_s / setup.time_step_s * len(packing):.2g} grain-steps to make")
    with tempfile.TemporaryDirectory(prefix="bulk-") as folder:
        try:
            done = cases.run(case, code, packing, variant, Path(folder))
        except PeerError as error:
            raise InputError(str(error)) from None
    print(f"{done.n_steps} steps of {done.n_grains} grains in {done.wall_s:.1f} s")
    write_table(cases.curve_table(done), output.curve, "bulk_curve", source)
    write_table(cases.cost_table(done, case, code, variant, processor()), output.cost, "bulk_cost", source)


if __name__ == "__main__":
    log_to(snakemake.log[0])
    wildcards = snakemake.wildcards
    source = {"rule": snakemake.rule, **dict(snakemake.params.items())}
    main(wildcards.bulk_case, wildcards.code, wildcards.variant, snakemake.input.packing, snakemake.output, source)
