"""Adapt rule `uncertainty` to `calibration.sample` and the tables derived from the samples."""

import pandas as pd
from threadpoolctl import threadpool_limits

from _log import log_to
from virtual_soil.calibration.uncertainty import equivalents, identifiability, posterior_table, sample
from virtual_soil.campaign.inference import likelihoods_of, optima, read_models
from virtual_soil.campaign.tables import read_table, write_table


def main(files, params, output, provenance):
    at = optima(read_table(files.calibration, "optima"), params.design["variables"])
    tables = {"posterior": [], "equivalents": [], "identifiability": []}
    likelihoods = likelihoods_of(files, params)
    processes = read_models(files.surrogates, "gaussian_process")
    for case in params.optimise["cases"]:
        likelihood = likelihoods[case["case"]]
        posterior = posterior_table(case, likelihood, *sample(likelihood, params.uncertainty["n_samples"]))
        tables["posterior"].append(posterior)
        tables["equivalents"].append(equivalents(posterior, likelihood, params.uncertainty["n_equivalents"], processes))
        tables["identifiability"].append(identifiability(case, likelihood, at[case["case"]]))
    for name, parts in tables.items():
        write_table(pd.concat(parts, ignore_index=True), output[name], name, provenance)


if __name__ == "__main__":
    log_to(snakemake.log[0])
    with threadpool_limits(1):  # one thread: identical sums, hence identical samples, on any number of cores
        main(snakemake.input, snakemake.params, snakemake.output, {"rule": snakemake.rule, **dict(snakemake.params.items())})
