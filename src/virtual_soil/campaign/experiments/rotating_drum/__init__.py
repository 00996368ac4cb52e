"""The rotating drum in a campaign."""
