"""The virtual tests of a campaign: the only list of them, and of the responses that they measure."""

from virtual_soil.calibration.response import Response, Responses

RESPONSES: Responses = {
    response.name: response
    for response in (
        Response(
            name="cohesion", column="cohesion_pa", unit="Pa", symbol="c", table="strength", error_column="cohesion_se_pa",
            signed=True, smallest_scale=10.0,
        ),
        Response(
            name="friction_angle", column="friction_angle_deg", unit="deg", symbol="φ", table="strength",
            error_column="friction_angle_se_deg", maximum=90.0,
        ),
        Response(
            name="angle_of_repose", column="angle_of_repose_deg", unit="deg", symbol="A", table="repose", maximum=90.0,
            sweep_form="log",
        ),
    )
}  # fmt: skip
