"""The angle-of-repose test in a campaign."""
