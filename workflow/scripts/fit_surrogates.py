"""Adapt rule `fit_surrogates` to `calibration.fit_all`."""

from pathlib import Path

from _log import log_to
from _tables import read_table, write_table
from calibration import fit_all, to_json

if __name__ == "__main__":
    log_to(snakemake.log[0])
    repose = read_table(snakemake.input.repose, "repose")
    strength = read_table(snakemake.input.strength, "strength")
    params = snakemake.params
    surrogates, residuals = fit_all(repose, strength, params.design, params.material, params.surrogate)
    Path(snakemake.output.surrogates).write_text(to_json(surrogates, params.design["variables"]), encoding="utf-8")
    write_table(residuals, snakemake.output.residuals, "residuals", {"rule": snakemake.rule, **dict(params.items())})
