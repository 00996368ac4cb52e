"""Adapt rule `estimate_from_reference` to `calibration.first_answer`."""

from threadpoolctl import threadpool_limits

from _log import log_to
from virtual_soil.calibration.first_answer import cases_of, first_answer, first_answer_text
from virtual_soil.calibration.scaling import scaling_of
from virtual_soil.campaign.experiments.registry import BY_RESPONSE, RESPONSES
from virtual_soil.campaign.files import write_text
from virtual_soil.campaign.inference import read_models, read_tables, scale_of
from virtual_soil.campaign.sections import Study
from virtual_soil.campaign.settings import defaults
from virtual_soil.campaign.soils import measure_soil
from virtual_soil.campaign.tables import read_provenance, write_table


def main(files, params, output, provenance):
    # design and material of the reference: those of the study may differ
    design, material = read_provenance(files.calibration)["design"], read_provenance(files.verification)["material"]
    tables = read_tables(files.tables)
    soils = measure_soil(files.soil)
    scaling = scaling_of(params.asked, params.simulated, design)
    models, processes = (read_models(files.surrogates, kind) for kind in ("chosen", "gaussian_process"))
    responses = scaling.answered({name: RESPONSES[name] for name in models})
    models, processes = (scaling.surrogates(found, responses) for found in (models, processes))
    design, material = scaling.design(design), {**material, **scaling.grains}
    cases = cases_of(soils, params.optimise["cases"], responses)
    scale = scale_of(params.optimise["errors"], params.uncertainty["target_uncertainty_ratio"], params.floors)
    settings = {"design": design, "cases": cases, "optimise": params.optimise, "uncertainty": params.uncertainty, "scale": scale}
    table, reach = first_answer(responses, models, processes, tables, soils, settings)
    write_table(table, output.table, "first_answer", {**provenance, "design": design, "material": material})
    measured = read_provenance(files.verification).get("settings", defaults(Study))  # tables made before they named them
    strengths = {name: BY_RESPONSE[name].strength(measured, name) for name in responses}
    write_text(output.text, first_answer_text(responses, table, reach, soils, design, material, strengths, scaling))


if __name__ == "__main__":
    log_to(snakemake.log[0])
    with threadpool_limits(1):  # one thread: identical sums, hence identical samples, on any number of cores
        main(snakemake.input, snakemake.params, snakemake.output, {"rule": snakemake.rule, **dict(snakemake.params.items())})
