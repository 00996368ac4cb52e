"""Registry of the experiments and of the responses that they measure."""

from collections.abc import Collection
from types import ModuleType

from virtual_soil.calibration.response import Responses
from virtual_soil.campaign.experiments.draw_down import declared as draw_down
from virtual_soil.campaign.experiments.plane_shear import declared as plane_shear
from virtual_soil.campaign.experiments.repose import declared as repose
from virtual_soil.campaign.experiments.rotating_drum import declared as rotating_drum
from virtual_soil.campaign.experiments.shear import declared as shear
from virtual_soil.campaign.experiments.slope import declared as slope

#: Every experiment, as its `declared` module; tables over all responses are in this order.
EXPERIMENTS: tuple[ModuleType, ...] = (shear, plane_shear, slope, draw_down, rotating_drum, repose)

BY_NAME = {experiment.NAME: experiment for experiment in EXPERIMENTS}
RESPONSES: Responses = {response.name: response for experiment in EXPERIMENTS for response in experiment.RESPONSES}
BY_RESPONSE = {response.name: experiment for experiment in EXPERIMENTS for response in experiment.RESPONSES}
#: Names of the experiments of a study that names none, in the order in which they are run.
BY_DEFAULT = [experiment.NAME for experiment in reversed(EXPERIMENTS) if experiment.BY_DEFAULT]
#: Those of the paper, for soils whose strength the paper's box has to meet.
PAPERS = [repose.NAME, shear.NAME]
#: Load columns of the design table.
LOADS = tuple(dict.fromkeys(experiment.LOAD for experiment in EXPERIMENTS if experiment.LOAD))
#: Reduced table -> experiment whose runs it summarises.
REDUCED = {table: experiment for experiment in EXPERIMENTS for table in experiment.REDUCED}


def chosen(names: Collection[str]) -> tuple[ModuleType, ...]:
    """Experiments of a study, as `declared` modules in the order of the registry."""
    return tuple(experiment for experiment in EXPERIMENTS if experiment.NAME in names)


def responses_of(names: Collection[str]) -> Responses:
    """Responses that a study's experiments measure, by name; names : of experiments, and of optional responses asked for."""
    every = (response for experiment in chosen(names) for response in experiment.RESPONSES)
    return {response.name: response for response in every if not response.optional or response.name in names}


def with_optional(config: dict) -> list[str]:
    """A study's experiments, and the optional responses that its cases have a weight for."""
    weighted = {name for case in config["optimise"]["cases"] for name, weight in case["weights"].items() if weight}
    return [*config["experiments"], *(name for name, response in RESPONSES.items() if response.optional and name in weighted)]
