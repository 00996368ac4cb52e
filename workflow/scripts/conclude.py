"""Adapt rule `conclude` to `calibration.conclusion`."""

import shutil

import pandas as pd

from _log import log_to
from virtual_soil.calibration.verify import QUESTIONS, conclusion
from virtual_soil.campaign.files import whole
from virtual_soil.campaign.inference import likelihoods_of, read_models
from virtual_soil.campaign.tables import read_table, write_table


def joined(parts: list[pd.DataFrame]) -> pd.DataFrame:
    """The tables one below the other; a table without rows would make whole numbers of others floating."""
    return pd.concat([part for part in parts if len(part)], ignore_index=True)


def main(files, params, output, provenance):
    answer = conclusion(
        read_table(files.calibration, "optima"),
        read_table(files.posterior, "posterior"),
        read_table(files.verification, "verification"),
        likelihoods_of(files, params),
        read_models(files.surrogates, "gaussian_process"),
    )
    table = joined([answer, read_table(files.published_calibration, "optima")])
    text = ["missed", "extrapolated", *QUESTIONS]
    write_table(table.fillna(dict.fromkeys(text, "")), output.calibration, "calibration", provenance)
    for name in ("iterations", "minima"):
        parts = [read_table(path, name) for path in (files[name], files[f"published_{name}"])]
        write_table(joined(parts), output[name], name, provenance)
    with whole(output.surrogates) as part:
        shutil.copyfile(files.surrogates, part)


if __name__ == "__main__":
    log_to(snakemake.log[0])
    main(snakemake.input, snakemake.params, snakemake.output, {"rule": snakemake.rule, **dict(snakemake.params.items())})
