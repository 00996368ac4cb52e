"""Exports of a calibration: a material card and input files for other DEM programs. Independent of the campaign's code."""

from virtual_soil.exports.card import check_card, material_card
from virtual_soil.exports.inputs import PROGRAMS, inputs
from virtual_soil.exports.rolling import converted
from virtual_soil.exports.shape import file_names as shape_files

__all__ = ["PROGRAMS", "check_card", "converted", "inputs", "material_card", "shape_files"]
