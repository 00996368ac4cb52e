"""Adhesion in a study: which kernels it needs, and what its grains have to bear."""

import pytest

from virtual_soil.calibration.errors import CalibrationError
from virtual_soil.campaign.apparatus import follow_cohesion
from virtual_soil.campaign.experiments.common import check_stiffness, softening, soil_of
from virtual_soil.campaign.experiments.plane_shear import declared as plane_shear
from virtual_soil.campaign.experiments.plane_shear.declared import STRESSES_PA
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


@pytest.mark.parametrize(
    ("weights", "adhesive_stress_pa", "stated", "stresses"),
    [
        ({"peak_cohesion": 1}, 100.0, None, [50.0, 188.0, 709.0, 2670.0]),  # from half of 100 Pa to five times 534 Pa
        ({"peak_cohesion": 1}, 0.0, None, list(STRESSES_PA)),  # grains that do not stick have no cohesion to follow
        ({"peak_friction_angle": 1}, 100.0, None, list(STRESSES_PA)),
        ({"peak_cohesion": 1}, 100.0, [1.0, 2.0, 3.0], [1.0, 2.0, 3.0]),
    ],
)
def test_normal_stresses_follow_the_cohesions_that_are_asked_for(tmp_path, weights, adhesive_stress_pa, stated, stresses):
    config = defaults(Study)
    config["experiments"], config["material"]["adhesive_stress_pa"] = ["plane_shear"], adhesive_stress_pa
    config["plane_shear"]["normal_stresses_pa"] = stated
    files = []
    for name, cohesion in (("loose", 100.0), ("dense", 534.0), ("dry", 3.0)):
        path = tmp_path / f"{name}.yaml"
        path.write_text(f"peak_cohesion_pa: {{value: {cohesion}, standard_uncertainty: 5.0, source: test}}\n")
        files.append(str(path))
        config["optimise"]["cases"].append({"case": name, "soil": name, "weights": weights})
    config |= follow_cohesion(config, files)
    assert plane_shear.loads(config, config["material"]) == stresses
