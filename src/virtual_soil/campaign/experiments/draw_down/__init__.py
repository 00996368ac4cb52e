"""The draw-down test in a campaign."""
