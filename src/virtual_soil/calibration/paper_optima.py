"""All minima of the published surrogates, beside those that the paper prints: `python -m virtual_soil.calibration.paper_optima`.

The last line printed is JSON: for each of the paper's three cases the minima, cheapest first.
"""

import json
from typing import Any

import pandas as pd

from virtual_soil.calibration import paper
from virtual_soil.calibration.optimise import calibrate, objectives, unit_of
from virtual_soil.calibration.surrogate import published

VARIABLES = ["radius_m", "static_friction", "rolling_friction"]
#: The paper's weights, equal, and with that of the angle of repose a tenth of the others.
EQUAL, LOW_REPOSE = [0.25] * 4, [1 / 31, 10 / 31, 10 / 31, 10 / 31]
CASES: list[dict[str, Any]] = [
    {"case": "sand", "soil": "silica_barco_sand", "weights": EQUAL},
    {"case": "regolith", "soil": "lunar_regolith", "weights": EQUAL},
    {"case": "regolith_low_repose_weight", "soil": "lunar_regolith", "weights": LOW_REPOSE},
]
OPTIONS = {"cases": CASES, "tolerance": 1e-3, "max_iterations": 500, "n_starts": 32, "unreachable": "as_given"}


def targets(soil: str) -> dict[str, float]:
    """The paper's targets by response."""
    return {column.rsplit("_", 1)[0]: value for column, value in paper.SOILS[soil].items()}


def printed_cost(case: dict) -> float:
    """Cost, on the published surrogates, of the optimum that the paper prints."""
    phi = objectives(published(), targets(case["soil"]), VARIABLES)
    x = [paper.OPTIMA[case["case"]][name] for name in VARIABLES] / unit_of(VARIABLES)
    return 0.5 * float(case["weights"] @ phi(x) ** 2)


def main() -> None:
    """Search, and print."""
    soils = pd.DataFrame(
        [{"soil": soil, "property": name, "value": value} for soil in paper.SOILS for name, value in targets(soil).items()]
    )
    best, _, minima = calibrate(published(), soils, OPTIONS, VARIABLES, "published")
    result: dict[str, list[dict[str, float]]] = {}
    for case, (_, optimum) in zip(CASES, best.iterrows(), strict=True):
        found = minima[minima["case"] == case["case"]]
        print(f"{case['case']}: {len(found)} minima; the global check finds nothing below {optimum['global_cost']:.6f}")
        at = paper.OPTIMA[case["case"]]
        line = "  {:>8.2f} um  mu_s {:.4f}  mu_r {:.4f}  cost {:.6f}  {}".format
        print(line(1e6 * at["radius_m"], at["static_friction"], at["rolling_friction"], printed_cost(case), "printed in the paper"))
        result[case["case"]] = []
        for _, row in found.iterrows():
            at = {"radius_um": 1e6 * row["radius_m"], **{k: row[k] for k in ("static_friction", "rolling_friction", "cost")}}
            remark = f"{row['found_by']}; condition {row['condition_number']:.0f}"
            remark += f"; at bound: {row['at_bound']}" if row["at_bound"] else ""
            print(line(*at.values(), remark))
            result[case["case"]].append({name: float(f"{value:.6g}") for name, value in at.items()})
    print(json.dumps(result))


if __name__ == "__main__":
    main()
