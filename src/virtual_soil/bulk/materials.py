"""The benchmark's solids and how they interact, for both codes."""

from typing import NamedTuple

import dem


class Solid(NamedTuple):
    """Young's modulus in Pa and density in kg/m3."""

    young_modulus_pa: float
    density_kg_m3: float


POISSON_RATIO = 0.2
GRAVITY_M_S2 = 9.8
STEEL = "steel"
#: Our law of friction here, that of the peer.
TANGENTIAL_MODEL = "liggghts"
SOLIDS = {"M1": Solid(1e9, 2500.0), "M2": Solid(0.5e9, 2000.0), STEEL: Solid(210e9, 7200.0)}
#: Pair -> coefficients of restitution and of sliding friction; no rolling friction, no cohesion.
PAIRS = {
    ("M1", "M1"): (0.5, 0.3),
    ("M1", "M2"): (0.45, 0.2),
    ("M2", "M2"): (0.4, 0.4),
    ("M1", STEEL): (0.4, 0.2),
    ("M2", STEEL): (0.4, 0.2),
    (STEEL, STEEL): (0.6, 0.5),
}


def young_modulus(name: str, softening: float) -> float:
    """Young's modulus in Pa of a solid; that of grains is divided by `softening`, steel stays as it is."""
    E = SOLIDS[name].young_modulus_pa
    return E if name == STEEL else E / softening


def pair(a: str, b: str) -> tuple[float, float]:
    """Coefficients of restitution and of sliding friction of two solids, in either order."""
    return PAIRS[(a, b) if (a, b) in PAIRS else (b, a)]


def materials(names: tuple[str, ...], softening: float) -> dict[str, dem.Material]:
    """Solids of these names for `dem.Simulation`."""
    return {
        name: dem.Material(
            density_kg_m3=SOLIDS[name].density_kg_m3,
            poisson_ratio=POISSON_RATIO,
            shear_modulus_pa=young_modulus(name, softening) / (2.0 * (1.0 + POISSON_RATIO)),
        )
        for name in names
    }


def interactions(names: tuple[str, ...]) -> dict[tuple[str, str], dem.Interaction]:
    """Interactions of all pairs of these names for `dem.Simulation`."""
    found = {}
    for k, a in enumerate(names):
        for b in names[k:]:
            restitution, friction = pair(a, b)
            found[a, b] = dem.Interaction(restitution=restitution, static_friction=friction, rolling_friction=0.0)
    return found
