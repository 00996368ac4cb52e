"""The cut slope in a campaign."""
