"""The paper's surrogates, as decoded in `paper.printed`."""

from virtual_soil.calibration.paper.printed import POWERS, RESPONSES, SURROGATES
from virtual_soil.calibration.surrogate import Factor, Surrogate

#: The paper's design.
RANGES = {"radius_m": (25e-6, 500e-6), "static_friction": (0.0, 1.7), "rolling_friction": (0.0, 0.3)}


def published() -> dict[str, Surrogate]:
    """The published surrogates by response, in Pa and degrees."""
    return {
        response: Surrogate(
            response=response,
            unit=RESPONSES[response].unit,
            grid_variables=("static_friction", "rolling_friction"),
            powers=tuple(map(tuple, POWERS)),
            coefficients=tuple(entry["unit_factor"] * value for value in entry["f"]),
            g={"radius_m": Factor(entry["g"]["form"], entry["g"]["reference"], tuple(entry["g"]["coefficients"]))},
            ranges=RANGES,
        )
        for response, entry in SURROGATES.items()
    }
