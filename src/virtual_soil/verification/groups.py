"""Groups of checks of the engine, in the order of the page; see `verification`."""

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
