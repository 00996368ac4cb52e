"""The plane shear test in a campaign."""
