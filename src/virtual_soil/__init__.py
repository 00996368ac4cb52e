"""Calibrates a virtual soil for discrete-element simulation: the campaign around the engine `dem`, the inference, the report.

Import rule: workflow -> report -> campaign -> calibration, exports, dem. Calibration and dem do not know each other.
"""
