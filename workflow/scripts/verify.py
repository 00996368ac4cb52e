"""Adapt rules `compare_round` and `verify` to `calibration.comparison_table`."""

from _log import log_to
from virtual_soil.calibration import comparison_table
from virtual_soil.calibration.noise import pooled_line_scatter, pooled_scatter
from virtual_soil.campaign.inference import read_models
from virtual_soil.campaign.tables import read_table, write_table

if __name__ == "__main__":
    log_to(snakemake.log[0])
    files, params = snakemake.input, snakemake.params
    tables = {name: read_table(files[name], name) for name in ("repose", "shear", "strength")}
    heaps, strength = read_table(files.campaign_repose, "repose"), read_table(files.campaign_strength, "strength")
    scatter = {
        "heap": pooled_scatter(heaps[heaps["angle_of_repose_deg"].notna()], "angle_of_repose_deg"),
        "line": pooled_line_scatter(strength[strength["fidelity"] == "campaign"]),
    }
    kind = {"strength": params.strength, "normal_stress": params.normal_stress}
    table = comparison_table(
        read_table(files.calibration, "optima"), read_models(files.surrogates), tables, params.material, kind, scatter
    )
    write_table(table, snakemake.output.table, "verification", {"rule": snakemake.rule, **dict(params.items())})
