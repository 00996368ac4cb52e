"""Adapt rule `export` to `exports.material_card` and `exports.inputs`."""

import json
from pathlib import Path

from _log import log_to
from virtual_soil import exports
from virtual_soil.campaign.experiments.registry import responses_of
from virtual_soil.campaign.experiments.shapes import clump_of
from virtual_soil.campaign.files import write_text
from virtual_soil.campaign.tables import read_table


def main(case, files, params, folder):
    calibration, verification = read_table(files.calibration, "calibration"), read_table(files.verification, "verification")
    (optimum,) = calibration[(calibration["case"] == case) & (calibration["surrogate"] == "ours")].to_dict("records")
    simulated = verification[verification["case"] == case].to_dict("records")
    known = responses_of(params.config["experiments"]).values()
    responses = {response.column: response.unit for response in known if response.column in calibration}
    clump = clump_of({**params.config["material"], **optimum}, params.config)
    card = exports.material_card(optimum, simulated, params.config, params.provenance, responses, clump)
    folder = Path(folder)
    write_text(folder / "material.json", json.dumps(card, indent=2) + "\n")
    for name, text in exports.inputs(card).items():
        write_text(folder / name, text)


if __name__ == "__main__":
    log_to(snakemake.log[0])
    main(snakemake.wildcards.case, snakemake.input, snakemake.params, Path(snakemake.output.card).parent)
