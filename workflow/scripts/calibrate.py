"""Adapt rule `calibrate` to `calibration.calibrate`."""

from _log import log_to
from virtual_soil.calibration.optimise import calibrate
from virtual_soil.campaign.experiments.registry import responses_of
from virtual_soil.campaign.inference import read_models, scale_of
from virtual_soil.campaign.tables import read_table, write_table

if __name__ == "__main__":
    log_to(snakemake.log[0])
    for _, row in read_table(snakemake.input.reachability, "reachability").query("not reachable").iterrows():
        print(f"{row['response']} of {row['soil']} is out of reach: {row['target']:g}; nearest is {row['nearest_reachable']:.4g}.")
    soils = read_table(snakemake.input.soils, "soil")
    models = read_models(snakemake.input.surrogates)
    params = snakemake.params
    scale = scale_of(params.optimise["errors"], params.uncertainty["target_uncertainty_ratio"], params.floors)
    variables = params.design["variables"]
    results = calibrate(responses_of(params.experiments), models, soils, params.optimise, variables, "ours", scale)
    provenance = {"rule": snakemake.rule, **dict(params.items())}
    for table, name in zip(results, ("optima", "iterations", "minima"), strict=True):
        table = table.assign(**params.design.get("fixed", {}))
        write_table(table, snakemake.output["calibration" if name == "optima" else name], name, provenance)
