"""The direct-shear test in a campaign."""
