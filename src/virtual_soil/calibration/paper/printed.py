"""Values that the paper prints.

Equation 3 is given as decoded: with cohesion in kPa, r0 = 200 um for the shear test's g and 50 um for the angle of repose's, the
printed surrogates give the values that the paper prints at its optima. The scan's "0.1151n" is 0.115 ln.
"""

from typing import Any

import numpy as np
import pandas as pd

from virtual_soil.calibration.response import Response

#: Variables that the paper's surrogates depend on.
VARIABLES = ["radius_m", "static_friction", "rolling_friction"]
#: Responses that the paper calibrates on. It prints no tables of runs.
RESPONSES = {
    response.name: response
    for response in (
        Response(name="cohesion", column="cohesion_pa", unit="Pa", symbol="c", table="", signed=True),
        Response(name="friction_angle", column="friction_angle_deg", unit="deg", symbol="φ", table="", maximum=90.0),
        Response(name="angle_of_repose", column="angle_of_repose_deg", unit="deg", symbol="A", table="", maximum=90.0),
    )
}

#: Table 1.
SOILS: dict[str, dict[str, float]] = {
    "silica_barco_sand": {"cohesion_pa": 24.0, "friction_angle_deg": 26.6, "angle_of_repose_deg": 30.0},
    "lunar_regolith": {"cohesion_pa": 300.0, "friction_angle_deg": 40.0, "angle_of_repose_deg": 65.0},
}

#: Response of the screening.
SCREENED = "angle_of_repose"
#: Table 2: parameter -> (angle of repose in deg, standard deviation in deg, sensitivity derivative in percent).
SCREENING = {
    "base": (27.47, 0.52, None),
    "radius_m": (26.37, 0.53, 4.0),
    "density_kg_m3": (27.67, 0.34, 2.2),
    "poisson_ratio": (27.95, 0.28, 1.7),
    "shear_modulus_pa": (27.06, 0.44, 3.7),
    "static_friction": (31.48, 0.64, 21.9),
    "rolling_friction": (36.57, 0.76, 33.1),
    "restitution": (27.63, 0.61, 0.8),
}

#: Equation 3: powers (of mu_s, mu_r), coefficients, and g with its reference radius; cohesion in kPa, angles in degrees.
POWERS = [[0, 0], [0, 1], [1, 0], [0, 2], [2, 0], [1, 1]]
SURROGATES: dict[str, dict[str, Any]] = {
    "cohesion": {
        "unit_factor": 1000.0,
        "f": [4.17, 39.30, -18.04, 30.14, 2.38, 52.55],
        "g": {"form": "quadratic", "reference": 200e-6, "coefficients": [0.27, 1.0, -0.27]},
    },
    "friction_angle": {
        "unit_factor": 1.0,
        "f": [14.61, -76.10, 57.15, -25.30, -25.57, 24.79],
        "g": {"form": "quadratic", "reference": 200e-6, "coefficients": [0.71, 0.44, -0.15]},
    },
    "angle_of_repose": {
        "unit_factor": 1.0,
        "f": [5.05, 95.55, 36.69, -181.1, -18.98, 42.09],
        "g": {"form": "log", "reference": 50e-6, "coefficients": [0.115]},
    },
}

#: Results section: optimum and the properties printed for it.
OPTIMA: dict[str, dict[str, Any]] = {
    "sand": {
        "radius_m": 70.85e-6, "static_friction": 0.609, "rolling_friction": 0.0811,
        "cohesion_pa": 23.9, "friction_angle_deg": 29.5, "angle_of_repose_deg": 27.8, "iterations": 81, "converged": True,
    },
    "regolith": {
        "radius_m": 66.21e-6, "static_friction": 1.44, "rolling_friction": 0.150,
        "cohesion_pa": 621.0, "friction_angle_deg": 31.2, "angle_of_repose_deg": 36.7, "iterations": None, "converged": False,
    },
    "regolith_low_repose_weight": {
        "radius_m": 172.7e-6, "static_friction": 1.21, "rolling_friction": 0.136,
        "cohesion_pa": 359.0, "friction_angle_deg": 38.7, "angle_of_repose_deg": 32.9, "iterations": None, "converged": None,
    },
}  # fmt: skip


def printed_screening(response: str, parameters) -> pd.DataFrame:
    """Table 2 for these parameters, a row each; NaN where the paper prints nothing, as for other responses."""
    table = SCREENING if response == SCREENED else {}
    rows = [table.get(name, (np.nan, np.nan, np.nan)) for name in parameters]
    return pd.DataFrame(rows, columns=["paper_angle_deg", "paper_sd_deg", "paper_sensitivity_percent"]).astype(float)
