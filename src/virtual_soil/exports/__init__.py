"""What others can use of a calibration: a material card, and input for other DEM programs. Knows nothing of how they come about."""

from virtual_soil.exports.card import check_card, material_card
from virtual_soil.exports.inputs import PROGRAMS, inputs
from virtual_soil.exports.rolling import converted

__all__ = ["PROGRAMS", "check_card", "converted", "inputs", "material_card"]
