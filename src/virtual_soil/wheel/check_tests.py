"""The calibration's own tests with the wheel's grains: the same tests, but for radius, stiffness, gravity and normal stress.

Rigid grains that do not stick have no scale of their own. A test whose lengths grow as the radius r, and whose times grow as
sqrt(r / g), is therefore the same test, and has the same angles, strengths over normal stress and densities: unless the wheel's
grains are too soft, or their stress level matters. Grains that stick have a scale: the angles that their weight drives go with the
size. Then only the shear tests are repeated.
"""

import copy
from collections.abc import Collection

import pandas as pd

from virtual_soil.calibration.errors import CalibrationError, demand
from virtual_soil.calibration.optimise import RADIUS
from virtual_soil.calibration.response import Response, Responses
from virtual_soil.calibration.verify import simulated
from virtual_soil.campaign.apparatus import may_stick
from virtual_soil.campaign.design import campaign_loads, further
from virtual_soil.campaign.experiments.apparatus import gravity_m_s2, gravity_of
from virtual_soil.campaign.experiments.registry import BY_NAME, BY_RESPONSE, REDUCED, RESPONSES
from virtual_soil.campaign.measure import reduced_table, responses_by_seed
from virtual_soil.campaign.study import experiment_settings, plain_rows, simulations
from virtual_soil.campaign.tables import read_table
from virtual_soil.campaign.variables import SEED_KEYS
from virtual_soil.wheel.soil import grain_settings, values_of

#: Units of the responses that are compared: others go with the size of the test.
COMPARED_UNITS = ("deg", "Pa", "kg/m3")
#: Unit at the end of a key -> powers of the ratios of radii and of gravities by which the value follows; the first that fits.
POWERS = {"_m_s": (0.5, 0.5), "_rpm": (-0.5, 0.5), "_kg": (3.0, 0.0), "_s": (0.5, -0.5), "_m": (1.0, 0.0)}
#: Normal stresses of the shear tests over the mean pressure under the wheel.
STRESS_RATIOS = (0.75, 1.0, 1.5)
#: Length of the contact patch over the wheel's radius, as in the engine's warning of soft grains.
PATCH_RATIO = 1.2
#: Purpose of the tests in their design table.
PURPOSE = "wheel_check"


def asked(config: dict, case: str) -> Responses:
    """Responses that a case has a weight for and that can be compared, by name."""
    weights = next(entry["weights"] for entry in config["optimise"]["cases"] if entry["case"] == case)
    named = {name: RESPONSES[name] for name, weight in weights.items() if weight and name in RESPONSES}
    sized = may_stick(config)
    return {
        name: response
        for name, response in named.items()
        if response.unit in COMPARED_UNITS and (BY_RESPONSE[name].LOAD is not None or not sized)
    }


def tests_of(config: dict, case: str) -> list[str]:
    """Names of the experiments that are repeated for a case."""
    return list(dict.fromkeys(BY_RESPONSE[name].NAME for name in asked(config, case)))


def stresses_pa(wheel: dict, check: dict) -> list[float]:
    """Normal stresses in Pa of the shear tests, to four digits: those stated, else about load / (1.2 radius width)."""
    if check["normal_stresses_pa"] is not None:
        return check["normal_stresses_pa"]
    pressure = wheel["load_n"] / (PATCH_RATIO * wheel["shape"]["radius_m"] * wheel["shape"]["width_m"])
    return [float(f"{ratio * pressure:.4g}") for ratio in STRESS_RATIOS]


def scaled(section: dict, radius_ratio: float, gravity_ratio: float) -> dict:
    """Copy of a section whose values follow the radius and gravity, each by the unit in its key."""
    found = dict(section)
    for key, value in section.items():
        powers = next((powers for unit, powers in POWERS.items() if key.endswith(unit)), None)
        if powers is not None and isinstance(value, int | float):
            found[key] = value * radius_ratio ** powers[0] * gravity_ratio ** powers[1]
    return found


def study_of(config: dict, wheel: dict, check: dict, engine: dict, radius_m: float, experiment: str) -> dict:
    """The study of one experiment with the wheel's grains.

    config : the study. engine : the wheel's, of `soil.engine_settings`. radius_m : of the calibrated grains.
    """
    declared, grains = BY_NAME[experiment], grain_settings(wheel)
    section, gravity = declared.APPARATUS, engine["gravity_m_s2"]
    of_test = config["engine"] if "gravity_m_s2" not in config[section] else {"gravity_m_s2": gravity_of(config, section)}
    ratios = grains[RADIUS] / radius_m, gravity / gravity_m_s2(of_test["gravity_m_s2"])
    found = copy.deepcopy(config) | {"experiments": [experiment]}
    for name in (experiment, section):
        found[name] = scaled(found[name], *ratios)
    fidelity = scaled(found["fidelity"]["campaign"], *ratios)
    found["fidelity"]["campaign"] = {key: of_wheel(key, value, engine) for key, value in fidelity.items()}
    if "gravity_m_s2" in found[section]:
        found[section]["gravity_m_s2"] = None
    found["shear_test"]["normal_stresses_pa"] = stresses_pa(wheel, check)
    found["engine"]["gravity_m_s2"] = gravity
    found["material"] |= {RADIUS: ratios[0] * config["material"][RADIUS]}
    return found


def of_wheel(key: str, value, engine: dict):
    """A setting of the fidelity for the wheel's grains: as stiff as they are under the wheel, and with its time step."""
    if key.endswith("_stiffness_number"):
        return None
    return engine["time_step_rayleigh_ratio"] if key.endswith("_time_step_rayleigh_ratio") else value


def tests(config: dict, wheel: dict, check: dict, engine: dict, calibration: str, case: str, experiment: str) -> tuple[dict, list]:
    """The study and the design rows of an experiment on the wheel's grains of a case; as `study_of`. calibration : the table.

    Raises CalibrationError if the soil is not calibrated yet.
    """
    answer, variables = values_of(calibration, case), config["design"]["variables"]
    values = {name: float(answer[name]) for name in variables}
    radius = values.get(RADIUS, config["material"][RADIUS])
    study = study_of(config, wheel, check, engine, radius, experiment)
    seeds = {SEED_KEYS[experiment]: check["test_seeds"]}
    return study, plain_rows(further(study, PURPOSE, [values | grain_settings(wheel)], seeds))


def members(job: tuple, seed: int, insist: Collection[str] = ()) -> list[tuple[dict, dict]]:
    """Pairs of design row and settings of the tests of one seed; job : of `tests`. insist : as `study.simulations`.

    Raises InputError if a test cannot be run with such grains.
    """
    study, rows = job
    mine = simulations(study, [row for row in rows if row["seed"] == seed], insist)
    return [(row, experiment_settings(study, row)) for row in mine.values()]


def check_tests(job: tuple, insist: Collection[str] = ()) -> None:
    """Refuse tests that cannot be run with such grains, in words of the check; arguments of `members`."""
    study, rows = job
    try:
        simulations(study, rows, insist)
    except ValueError as error:
        raise CalibrationError(f"wheel_check, with the wheel's grains: {error}") from None


def tests_in(paths: Collection[str], names: Collection[tuple[str, str]]) -> dict[str, dict[str, pd.DataFrame]]:
    """Case -> experiment -> table of its measured tests; names : pairs of case and experiment, one by one with the files."""
    found: dict[str, dict[str, pd.DataFrame]] = {}
    for path, (case, experiment) in zip(paths, names, strict=True):
        found.setdefault(case, {})[experiment] = read_table(path, experiment)
    return found


def found_in(responses: Responses, tables: dict[str, pd.DataFrame], settings: dict) -> dict[str, tuple[float, float, int]]:
    """Response -> mean over seeds, its standard error, and number of values.

    tables : of the measured tests, by experiment, of one case. settings : sections of the experiments.
    """
    reduced = {
        name: reduced_table(name, tables[experiment.NAME], settings[experiment.NAME])
        for name, experiment in REDUCED.items()
        if experiment.NAME in tables
    }
    by_seed, found = responses_by_seed(responses, tables, settings), {}
    for name, response in responses.items():
        point = tables[BY_RESPONSE[name].NAME]["point_id"].iloc[0]
        mean, _, error, n = simulated(response, point, (tables | reduced)[response.table], by_seed[name], float("nan"))
        found[name] = mean, error, n
    return found


def reference_of(verification: str, case: str, response: Response, limit: float) -> dict:
    """What the calibration says of a response at the optimum of a case: its simulated mean, else the prediction.

    Plain values, a rule's parameter. Raises CalibrationError if the study has no such verification.
    """
    allowed = "the verification of a finished calibration: run the target `all` of this study first"
    try:
        table = read_table(verification, "verification")
    except (ValueError, OSError) as error:
        raise CalibrationError(f"{verification}: {error}; allowed: {allowed}") from None
    rows = table[(table["case"] == case) & (table["response"] == response.name)]
    demand(len(rows) == 1, f"{verification}: {response.name} of case {case}", f"there {len(rows)} times", allowed)
    row = rows.iloc[0]
    known = "simulated" if row["n_seeds"] > 0 else "predicted"
    value = {"value": float(row[known]), "error": float(row[f"{known}_se"]), "n": int(row["n_seeds"]), "known": known}
    return {"response": response.name, "column": response.column, "unit": response.unit, "limit": limit, **value}


def said(config: dict, job: tuple, experiment: str) -> tuple[str, str]:
    """Mean radius of the grains of a test in the calibration, and with the wheel's grains, in words; job : of `tests`."""
    study, rows = job
    calibrated = rows[0][RADIUS] * config["material"][RADIUS] / study["material"][RADIUS]
    stresses = campaign_loads(study, study["material"])[experiment] if BY_NAME[experiment].LOAD else []
    under = " under " + ", ".join(f"{1e-3 * stress:.3g}" for stress in stresses) + " kPa" if stresses else ""
    before, after = (f"{experiment.replace('_', ' ')}, grains of {1e3 * radius:.3g} mm" for radius in (calibrated, rows[0][RADIUS]))
    return before, after + under
