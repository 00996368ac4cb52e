"""The paper: Briend, Radziszewski, Pasini 2011, "Virtual soil calibration for wheel-soil interaction simulations".

The only part of the inference that names responses: the paper's three, their printed values and surrogates, its fourth objective.
"""

from virtual_soil.calibration.paper.printed import (
    OPTIMA,
    POWERS,
    RESPONSES,
    SCREENING,
    SOILS,
    SURROGATES,
    VARIABLES,
    printed_screening,
)
from virtual_soil.calibration.paper.surrogates import published

__all__ = [
    "OPTIMA",
    "POWERS",
    "RESPONSES",
    "SCREENING",
    "SOILS",
    "SURROGATES",
    "VARIABLES",
    "printed_screening",
    "published",
]
