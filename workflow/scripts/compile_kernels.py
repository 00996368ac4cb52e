"""Adapt rule `compile_kernels` to `dem.compiled`: compile the campaign's kernels once, before the jobs start."""

import itertools

from _log import log_to
from dem import compiled, jit
from virtual_soil.campaign.files import write_text


def main(settings, laws, clumps, turning, marker):
    chosen = {name: settings[name] for name in compiled.Variant._fields if name in settings}
    # a simulation is set up without clumps, which are added to it
    for adhesion, with_clumps in itertools.product(laws, (False, True) if clumps else (False,)):
        variant = chosen | {"adhesion": adhesion, "clumps": with_clumps}
        compiled.ensure(**variant)
        if turning:  # in periodic slices, and without a ledger, which does not book bodies that turn
            compiled.ensure(**variant | {"energy_ledger": False, "turning": True, "periodic": True})
    write_text(marker, f"kernels of source {jit.SOURCE} are compiled\n")


if __name__ == "__main__":
    log_to(snakemake.log[0])
    main(
        snakemake.params.settings,
        snakemake.params.adhesion,
        snakemake.params.clumps,
        snakemake.params.turning,
        snakemake.output.marker,
    )
