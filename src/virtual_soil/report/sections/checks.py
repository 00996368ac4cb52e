"""Checks and sources: bias of the acceleration, failed simulations, and assumptions."""

from collections.abc import Mapping

import pandas as pd

from virtual_soil.campaign.experiments.common import LARGEST_OVERLAP_RATIO
from virtual_soil.campaign.variables import PRINTED
from virtual_soil.report.experiments import of_study, runs
from virtual_soil.report.items import Entry, Item
from virtual_soil.report.study import Study
from virtual_soil.report.text import number, with_error

NAME, TITLE, HEADING = "checks", "Checks", "Checks and sources"
LINKS = {"checks": "Checks and sources"}
FIGURES: dict[str, Entry] = {}
TABLES = {"acceleration": "Bias of the acceleration"}

#: Assumptions beside those of the experiments.
SPHERES = "Equal spheres unless a spread of radii is configured; the paper does not say."
CLUMPS = "Grains are clumps, rigid unions of spheres ({}); their radii are those of the spheres of equal volume."
ASSUMPTIONS = ("In the radius sweep the geometry grows with the grains unless configured otherwise; the lift speed stays.",)
#: Assumption of studies that stand beside what the paper prints.
READING = (
    "The paper's Equation 3 is read with c in kPa and r0 = 200 µm for the shear test: only then does it give the printed values."
)
#: What identifies a failed simulation, and the reason.
FAILED = ["simulation_id", "experiment", *PRINTED, "normal_stress_pa", "seed", "reason"]


def figures(_study: Study) -> dict[str, Item]:
    """No figures."""
    return {}


def tables(study: Study) -> dict[str, pd.DataFrame]:
    """Bias of the acceleration."""
    return {"acceleration": acceleration_table(study.tables["acceleration"])}


def words(study: Study) -> dict:
    """Remarks on the acceleration, failed simulations and assumptions."""
    return {
        "remarks": [*acceleration_remarks(study.tables["acceleration"]), *overlap_remarks(study)],
        "failed": failed_table(runs(study)),
        "assumptions": assumptions(study),
    }


def assumptions(study: Study) -> list[str]:
    """Assumptions of the study's experiments, and of all studies."""
    own = [text for experiment in of_study(study.config) for text in experiment.ASSUMPTIONS]
    shape = study.config.get("shape")
    grains = SPHERES if shape is None else CLUMPS.format(shape["name"])
    return [*own, grains, *ASSUMPTIONS, *([READING] if study.as_printed else [])]


def acceleration_table(table: pd.DataFrame) -> pd.DataFrame:
    """Bias of the acceleration."""
    columns = ["test", "µs, µr", "quantity", "accelerated", "reference", "runs", "bias", "beyond noise", "time of a run (s)"]
    return pd.DataFrame([acceleration_row(row) for _, row in table.iterrows()], columns=columns)


def acceleration_row(row: Mapping) -> tuple:
    """One measured quantity, accelerated and at the paper's fidelity."""
    digits = 1 if row["quantity"].endswith("deg") else 3
    return (
        row["experiment"],
        f"{row['static_friction']:g}, {row['rolling_friction']:g}",
        row["quantity"],
        number(row["campaign_mean"], digits),
        number(row["reference_mean"], digits),
        f"{row['campaign_n']} / {row['reference_n']}",
        with_error(row["bias"], row["bias_se"], digits),
        "yes" if row["exceeds_noise"] else "no",
        f"{number(row['campaign_wall_time_s'])} / {number(row['reference_wall_time_s'])}",
    )


def acceleration_remarks(table: pd.DataFrame) -> list[str]:
    """Test points at which the bias exceeds the noise."""
    if table.empty:
        return ["This study has no check points."]
    beyond = table[table["exceeds_noise"]]
    if beyond.empty:
        return ["No bias exceeds two standard errors of the scatter between seeds."]
    return [
        f"{row['experiment']} at ({row['static_friction']:g}, {row['rolling_friction']:g}): the bias exceeds the noise."
        for _, row in beyond.iterrows()
    ]


def overlap_remarks(study: Study) -> list[str]:
    """Number of simulations of every experiment in which grains overlap too much."""
    sentences = []
    for experiment in of_study(study.config):
        table = study.every[experiment.NAME].drop_duplicates("simulation_id")
        if "overlaps_too_much" not in table:
            continue
        beyond = table[table["overlaps_too_much"].astype(bool)]
        if len(beyond):
            sentences.append(
                f"{experiment.TITLE}: in {len(beyond)} of {len(table)} simulations grains overlap by more than "
                f"{LARGEST_OVERLAP_RATIO:.0%} of r, by up to {beyond['max_overlap_ratio'].max():.0%}."
            )
    return sentences


def failed_table(simulated: pd.DataFrame) -> pd.DataFrame | None:
    """Failed simulations with their reasons; None if there are none."""
    failed = simulated.loc[simulated["status"] == "failed", FAILED]
    return None if failed.empty else failed
