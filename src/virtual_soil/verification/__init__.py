"""Verification of the engine: published and closed-form results, each a case that uses the public API of `dem`.

GROUPS maps the name of a group to the function that runs it and returns its checks.
"""

from virtual_soil.verification import (
    adhesion,
    bodies,
    clumps,
    conservation,
    energy,
    friction,
    invariance,
    normal_impact,
    oblique_impact,
    rest,
    strength,
)
from virtual_soil.verification.check import Check, table_of

#: Groups of checks with run times of seconds to minutes, in the order of the page.
GROUPS = {
    "normal_impact": normal_impact.checks,
    "oblique_impact": oblique_impact.checks,
    "friction": friction.checks,
    "conservation": conservation.checks,
    "invariance": invariance.checks,
    "rest": rest.checks,
    "energy": energy.checks,
    "adhesion": adhesion.checks,
    "clumps": clumps.checks,
    "bodies": bodies.checks,
    "strength": strength.checks,
}

__all__ = ["GROUPS", "Check", "table_of"]
