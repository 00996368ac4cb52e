"""Adapt rule `check_acceleration` to `calibration.acceleration_table`."""

from _log import log_to
from virtual_soil.calibration import FidelityCheck, acceleration_table
from virtual_soil.campaign.tables import read_table, write_table

if __name__ == "__main__":
    log_to(snakemake.log[0])
    repose, shear = read_table(snakemake.input.repose, "repose"), read_table(snakemake.input.shear, "shear")
    shear = shear.assign(shear_stress_ratio=shear["plateau_shear_stress_pa"] / shear["plane_normal_stress_pa"])
    table = acceleration_table(
        [
            FidelityCheck("repose", repose, "angle_of_repose_deg"),
            FidelityCheck("shear", shear, "shear_stress_ratio", load="normal_stress_pa"),
        ]
    )
    write_table(table, snakemake.output.table, "acceleration", {"rule": snakemake.rule, **dict(snakemake.params.items())})
