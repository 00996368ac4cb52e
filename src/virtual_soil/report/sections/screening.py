"""The screening: effect of one changed grain parameter on a response."""

import numpy as np
import pandas as pd

from virtual_soil.calibration.response import Responses
from virtual_soil.report import experiments
from virtual_soil.report.items import Entry, Item
from virtual_soil.report.quantities import header, printed_unit
from virtual_soil.report.study import Study
from virtual_soil.report.text import number, with_error

NAME, TITLE, HEADING = "screening", "2. Screening", "2. Which grain parameters matter"
LINKS = {"screening": "2. Screening"}
FIGURES: dict[str, Entry] = {}
TABLES = {"screening": "Table 2: one parameter changed"}


def figures(_study: Study) -> dict[str, Item]:
    """No figures."""
    return {}


def tables(study: Study) -> dict[str, pd.DataFrame]:
    """Table 2."""
    return {"screening": screening_table(study.tables["screening"], study.responses)}


def words(study: Study) -> dict:
    """Remarks on single experiments, and the parameters with an effect."""
    table = study.tables["screening"]
    beyond = table.loc[table["exceeds_noise"], "parameter"].tolist()
    effect = f"Changes beyond the noise between seeds: {', '.join(beyond) or 'none'}."
    return {"remarks": [*experiments.remarks(NAME, study), effect]}


def screening_table(table: pd.DataFrame, responses: Responses) -> pd.DataFrame:
    """Table 2, ours beside the paper's."""
    response = next(response for response in responses.values() if response.column in table)
    ours, theirs = table[response.column], table["paper_angle_deg"]
    found = pd.DataFrame(
        {
            "parameter": table["parameter"],
            "changed to": ["base set" if pd.isna(v) else f"{v:g}" for v in table["changed_value"]],
            header(response): [with_error(v, sd, 2) for v, sd in zip(ours, table[f"sd_{response.suffix}"], strict=True)],
            "runs": table["n_runs"],
            f"paper's {header(response)}": [with_error(v, sd, 2) for v, sd in zip(theirs, table["paper_sd_deg"], strict=True)],
            f"ours − paper ({printed_unit(response)})": [number(v, 2) for v in ours - theirs],
            "sensitivity (%)": [number(v) for v in table["sensitivity_percent"]],
            "paper's (%)": [number(v) for v in table["paper_sensitivity_percent"]],
            "beyond noise": np.where(table["exceeds_noise"], "yes", "no"),
        }
    )
    return found if theirs.notna().any() else found.drop(columns=[name for name in found if "paper" in name])
