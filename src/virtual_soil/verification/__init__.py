"""Verification of the engine: published and closed-form results, each a case that uses the public API of `dem`.

`groups` maps the name of a group to the function that runs it and returns its checks.
"""

from virtual_soil.verification.check import Check, table_of

__all__ = ["Check", "table_of"]
