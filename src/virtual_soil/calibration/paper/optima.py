"""All minima of the published surrogates, beside those that the paper prints: `python -m virtual_soil.calibration.paper.optima`.

The last line printed is JSON: for each of the paper's three cases the minima, cheapest first.
"""

import json
from typing import Any

import pandas as pd

from virtual_soil.calibration.optimise import calibrate, objectives, relative_scale, unit_of, weights_of
from virtual_soil.calibration.paper.printed import OPTIMA, RESPONSES, SOILS, VARIABLES
from virtual_soil.calibration.paper.surrogates import published

#: The paper's weights: equal, and with that of the angle of repose a tenth of the others.
EQUAL = {"angle_of_repose": 0.25, "cohesion": 0.25, "friction_angle": 0.25, "large_grains": 0.25}
LOW_REPOSE = {"angle_of_repose": 1 / 31, "cohesion": 10 / 31, "friction_angle": 10 / 31, "large_grains": 10 / 31}
CASES: list[dict[str, Any]] = [
    {"case": "sand", "soil": "silica_barco_sand", "weights": EQUAL},
    {"case": "regolith", "soil": "lunar_regolith", "weights": EQUAL},
    {"case": "regolith_low_repose_weight", "soil": "lunar_regolith", "weights": LOW_REPOSE},
]
OPTIONS = {"cases": CASES, "tolerance": 1e-3, "max_iterations": 500, "n_starts": 32, "unreachable": "as_given"}


def targets(soil: str) -> dict[str, float]:
    """The paper's targets by response."""
    return {name: SOILS[soil][response.column] for name, response in RESPONSES.items()}


def soil_table() -> pd.DataFrame:
    """Table 1 as a soil table."""
    return pd.DataFrame(
        [{"soil": soil, "property": name, "value": value} for soil in SOILS for name, value in targets(soil).items()]
    )


def printed_cost(case: dict) -> float:
    """Cost, on the published surrogates, of the optimum that the paper prints."""
    aims, weights = targets(case["soil"]), weights_of(case, RESPONSES)
    scales = {name: relative_scale(RESPONSES[name], pd.Series({"value": aim}), None) for name, aim in aims.items()}
    phi = objectives(list(weights), published(), scales, VARIABLES, aims)
    x = [OPTIMA[case["case"]][name] for name in VARIABLES] / unit_of(VARIABLES)
    return 0.5 * float(list(weights.values()) @ phi(x) ** 2)


def main() -> None:
    """Search, and print."""
    best, _, minima = calibrate(RESPONSES, published(), soil_table(), OPTIONS, VARIABLES, "published")
    result: dict[str, list[dict[str, float]]] = {}
    for case, (_, optimum) in zip(CASES, best.iterrows(), strict=True):
        found = minima[minima["case"] == case["case"]]
        print(f"{case['case']}: {len(found)} minima; the global check finds nothing below {optimum['global_cost']:.6f}")
        at = OPTIMA[case["case"]]
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
