"""Adapt rule `compile_kernels` to `dem.compiled`: compile the campaign's kernels once, before the jobs start."""

from _log import log_to
from dem import compiled, jit
from virtual_soil.campaign.files import write_text


def main(settings, laws, marker):
    chosen = {name: settings[name] for name in compiled.Variant._fields if name in settings}
    for adhesion in laws:
        compiled.ensure(**chosen | {"adhesion": adhesion})
    write_text(marker, f"kernels of source {jit.source_hash()} are compiled\n")


if __name__ == "__main__":
    log_to(snakemake.log[0])
    main(snakemake.params.settings, snakemake.params.adhesion, snakemake.output.marker)
