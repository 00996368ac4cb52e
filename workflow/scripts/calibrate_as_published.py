"""Adapt rule `calibrate_as_published` to `calibration.calibrate`, with our polynomials and with the published ones."""

import pandas as pd

from _log import log_to
from virtual_soil.calibration import paper
from virtual_soil.calibration.optimise import calibrate, cases_about
from virtual_soil.calibration.paper import published
from virtual_soil.campaign.experiments.registry import responses_of
from virtual_soil.campaign.inference import read_models
from virtual_soil.campaign.tables import read_table, write_table

if __name__ == "__main__":
    log_to(snakemake.log[0])
    soils = read_table(snakemake.input.soils, "soil")
    polynomials = read_models(snakemake.input.surrogates, "quadratic")
    options = {**snakemake.params.optimise, "unreachable": "as_given"}
    responses = responses_of(snakemake.params.experiments)
    printed = {name: response for name, response in responses.items() if name in paper.RESPONSES}
    its_options = {**options, "cases": cases_about(printed, options["cases"])}
    design, results = snakemake.params.design, []
    if polynomials:  # a design without a grid has none
        of_ours = calibrate(responses, polynomials, soils, options, design["variables"], "polynomial")
        results.append(tuple(table.assign(**design.get("fixed", {})) for table in of_ours))
    if set(printed) == set(paper.RESPONSES) and set(snakemake.params.printed) == set(snakemake.params.experiments):
        results.append(calibrate(printed, published(), soils, its_options, paper.VARIABLES, "published"))
    provenance = {"rule": snakemake.rule, **dict(snakemake.params.items())}
    for k, name in enumerate(("optima", "iterations", "minima")):
        parts = [result[k] for result in results]
        table = pd.concat(parts, ignore_index=True) if parts else pd.DataFrame()
        write_table(table, snakemake.output["calibration" if name == "optima" else name], name, provenance)
