"""Adhesion in a study: which kernels it needs, and what its grains have to bear."""

import pytest

from virtual_soil.calibration.errors import CalibrationError
from virtual_soil.campaign.experiments.common import check_stiffness, soil_of, softening
from virtual_soil.campaign.sections import Study
from virtual_soil.campaign.settings import defaults
from virtual_soil.campaign.variables import adhesion_laws

CONFIG = defaults(Study)


def soil(stress_pa):
    return soil_of({**CONFIG["material"], "adhesive_stress_pa": stress_pa}, CONFIG)


@pytest.mark.parametrize(
    ("stress_pa", "variables", "laws"),
    [
        (0.0, ["static_friction"], ["none"]),
        (10.0, ["static_friction"], ["constant"]),
        (10.0, ["adhesive_stress_pa"], ["none", "constant"]),  # a range may begin at zero
    ],
)
def test_kernels_are_those_of_the_grains_that_there_are(stress_pa, variables, laws):
    config = CONFIG | {"material": CONFIG["material"] | {"adhesive_stress_pa": stress_pa}, "design": {"variables": variables}}
    assert adhesion_laws(config) == laws


def test_grains_must_be_stiff_enough_for_what_adhesion_presses():
    limit = 5e7 / (1.0 - 0.2) / 1000.0  # stress at which E*/p is 1000
    check_stiffness(soil(0.0), 0.9 * limit, None, "key")
    with pytest.raises(CalibrationError, match="shear_modulus_pa"):
        check_stiffness(soil(0.2 * limit), 0.9 * limit, None, "key")
    assert softening(soil(100.0), 500.0, 2e4) < softening(soil(0.0), 500.0, 2e4)
