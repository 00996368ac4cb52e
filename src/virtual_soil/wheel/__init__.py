"""A wheel, plates and a cone on the soils that a study has calibrated: targets `wheel`, `plate`, `cone`."""
