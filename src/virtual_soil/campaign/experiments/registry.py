"""Registry of the experiments and of the responses that they measure."""

from types import ModuleType

from virtual_soil.calibration.response import Responses
from virtual_soil.campaign.experiments.repose import declared as repose
from virtual_soil.campaign.experiments.shear import declared as shear

#: Every experiment, as its `declared` module; tables over all responses are in this order.
EXPERIMENTS: tuple[ModuleType, ...] = (shear, repose)

BY_NAME = {experiment.NAME: experiment for experiment in EXPERIMENTS}
RESPONSES: Responses = {response.name: response for experiment in EXPERIMENTS for response in experiment.RESPONSES}
#: Load columns of the design table.
LOADS = tuple(dict.fromkeys(experiment.LOAD for experiment in EXPERIMENTS if experiment.LOAD))
#: Reduced table -> experiment whose runs it summarises.
REDUCED = {table: experiment for experiment in EXPERIMENTS for table in experiment.REDUCED}
