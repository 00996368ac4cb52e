"""Grains that are clumps in other programs: the spheres of a grain of mean size, its mass and moments, and what is not the same.

Of a mix all that for every shape, with its share of the number of grains.

The values are those of the union, overlaps counted once; programs that integrate them themselves are told them. Axes are principal,
the origin is the centre of mass.

Sources: LIGGGHTS-PUBLIC documentation, fix particletemplate/multisphere, fix particletemplate/sphere, fix
particledistribution/discrete and fix multisphere; LAMMPS documentation, molecule, fix pour and fix rigid/small; YADE's manual,
BodyContainer.appendClumped. Tests run LIGGGHTS and LAMMPS.
"""

import itertools
import math
from collections.abc import Iterator

from dem import Clump, Mix
from dem.clumps.mix import Shape

#: File of a card with a shape -> what it holds. A line x y z r for every sphere is what `dem.Clump.read` and other programs take.
FILES = {"clump.txt": "spheres", "lammps_grain.mol": "molecule"}
#: Seed of LIGGGHTS' first template: seeds are primes, one for each template.
SEED = 15485863
#: Of programs that were not run.
UNKNOWN_MASS = [
    "Whether its dashpots take the mass of the grain, as virtual-soil's do, or of the sphere decides about rebounds: let two",
    "grains collide first.",
]
#: Program -> what to know of its clumps.
NOTES = {
    "LIGGGHTS": [
        "LIGGGHTS: fix vs_shape is the template, with mass and moments. Insert it by fix particledistribution/discrete and",
        "fix insert/pack; integrate by fix multisphere, not by nve/sphere. Dashpots take the grain's mass, as virtual-soil's do.",
    ],
    "LAMMPS": [
        "LAMMPS: molecule vs_grain, file lammps_grain.mol, with mass, centre and moments of the union; pour it (fix pour ... mol",
        "vs_grain rigid vs_bodies) for fix vs_bodies all rigid/small molecule mol vs_grain. Leave out fix nve/sphere, exclude",
        "contacts within a grain (neigh_modify exclude molecule/intra all), have molecule numbers (fix property/atom mol).",
        "Of grains made otherwise LAMMPS adds up the moments of the spheres, which overlap: they are then not these.",
        "Dashpots take the grain's mass, as virtual-soil's do.",
    ],
    "YADE": [
        "YADE: add_grain(centre) makes a clump. YADE integrates mass and moments itself, on a grid (discretization), and turns the",
        "clump's axes as it finds them. This part of the file follows the manual and was not run.",
        *UNKNOWN_MASS,
    ],
    "EDEM": [
        "EDEM: type the spheres in as a multi-sphere particle; compare EDEM's own mass and moments with those below, or type",
        "these in.",
        *UNKNOWN_MASS,
    ],
}
#: The same of mixes.
MIX_NOTES = {
    "LIGGGHTS": [
        "Mix: fix vs_mix is the distribution of the templates vs_shape_1, vs_shape_2, ... by number.",
    ],
    "LAMMPS": [
        "Mix: molecule vs_grain is the set of the files lammps_grain_1.mol, lammps_grain_2.mol, ...; pour it with molfrac",
        "${vs_shares}. A sphere is a rigid body of one atom.",
    ],
    "YADE": ["Mix: add_grain(centre, kind) with kind drawn from SHARES, random.choices(range(len(SHARES)), SHARES)[0]."],
    "EDEM": ["Mix: one particle for each shape, in the shares of the number of grains below; all have the same mass."],
}
#: The same of mixes with spheres.
SPHERE_NOTES = {
    "LIGGGHTS": [
        "The mix's spheres are no bodies of fix multisphere, which refuses them: inserted, they join the group vs_spheres.",
        "Integrate that group by nve/sphere, or they stand still.",
    ],
}
CONTACTS = "Contacts act between spheres with their own radii, here and there."
ROLLING = (
    "Rolling friction acts between the spheres there. virtual-soil's type A brakes the whole grain, by the sum of mu_r F_n r of "
    "its spheres."
)


def of_grain(clump: Clump, radius_m: float, density_kg_m3: float) -> dict:
    """Shape of a grain of mean radius as the card has it."""
    volume = 4.0 / 3.0 * math.pi * radius_m**3
    mass = density_kg_m3 * volume
    return {
        "name": clump.name,
        "spheres": [dict(zip(("x_m", "y_m", "z_m", "radius_m"), (radius_m * v for v in s), strict=True)) for s in clump.spheres],
        "volume_m3": volume,
        "mass_kg": mass,
        "moments_kg_m2": [mass * radius_m**2 * moment for moment in clump.moments],
    }


def of_soil(shape: Shape | None, radius_m: float, density_kg_m3: float) -> dict:
    """Section of the card: `shape` of clumps, `shapes` of a mix, none of spheres."""
    if shape is None:
        return {}
    if isinstance(shape, Mix):
        kinds = zip(shape.fractions, shape.shapes, strict=True)
        return {"shapes": [{"share": float(share), **of_grain(clump, radius_m, density_kg_m3)} for share, clump in kinds]}
    return {"shape": of_grain(shape, radius_m, density_kg_m3)}


def shapes(card: dict) -> list[dict]:
    """Shapes of a card's grains with their shares: one for clumps, none for spheres.

    suffix : end of their names in files. seed, number : of LIGGGHTS' template, number among those of clumps.
    """
    if "shape" in card:
        return [{"share": 1.0, "suffix": "", "seed": SEED, "number": 1, **card["shape"]}]
    mix = card.get("shapes", [])
    numbers = itertools.accumulate(len(shape["spheres"]) > 1 for shape in mix)
    return [
        {"suffix": f"_{k}", "seed": seed, "number": int(number), **shape}
        for k, (shape, number, seed) in enumerate(zip(mix, numbers, primes(SEED), strict=False), 1)
    ]


def primes(first: int) -> Iterator[int]:
    """Primes from an odd number on."""
    return (n for n in itertools.count(first, 2) if all(n % k for k in range(3, math.isqrt(n) + 1, 2)))


def contact_radius_m(card: dict) -> float:
    """Mean radius of the spheres that touch: of clumps their members, else the grains."""
    radii = [(shape["share"], sphere["radius_m"]) for shape in shapes(card) for sphere in shape["spheres"]]
    total = sum(share for share, _ in radii)
    return sum(share * radius for share, radius in radii) / total if radii else card["parameters"]["radius_m"]["value"]


def smallest_radius_m(card: dict) -> float:
    """Radius of the smallest sphere of a mean grain, which sets the time step."""
    radii = (sphere["radius_m"] for shape in shapes(card) for sphere in shape["spheres"])
    return min(radii, default=card["parameters"]["radius_m"]["value"])


def explanation(card: dict, program: str) -> list[str]:
    """Return comment lines about the shape, for grains that have one: what the file carries, and what is not the same."""
    said = shapes(card)
    if not said:
        return []
    lines = []
    if "shapes" in card:
        names = ", ".join(f"{shape['share']:.6g} {shape['name']}" for shape in said)
        lines += [f"Grains: a mix of {len(said)} shapes, {names}, as shares of the number of grains; all have the same volume."]
    for shape in said:
        lines += [*of_shape(shape)]
    if program not in NOTES:
        return [*lines, f"{program}: THE SHAPE IS NOT CARRIED: the soil written here has spheres, whose heaps are others."]
    lines += NOTES[program]
    if "shapes" in card:
        spheres = any(len(shape["spheres"]) == 1 for shape in said)
        lines += [*MIX_NOTES[program], *(SPHERE_NOTES.get(program, []) if spheres else [])]
    rolls = card["parameters"]["rolling_friction"]["value"] > 0.0
    return [*lines, CONTACTS, *([ROLLING] if rolls else [])]


def of_shape(shape: dict) -> list[str]:
    """Return comment lines about one shape."""
    n, moments = len(shape["spheres"]), ", ".join(f"{moment:.6g}" for moment in shape["moments_kg_m2"])
    clumps = f"clumps of {n} spheres, {shape['name']}" if n > 1 else "spheres"
    return [
        f"Grains: {clumps}; their radius is that of the sphere of equal volume.",
        f"A grain of mean size has a mass of {shape['mass_kg']:.6g} kg and moments of {moments} kg m2, overlaps counted once.",
    ]


def file_names(n_shapes: int) -> list[str]:
    """Names of the files of a card with that number of shapes, one shape's as in FILES."""
    return list(FILES) if n_shapes == 1 else [numbered(name, f"_{k + 1}") for k in range(n_shapes) for name in FILES]


def numbered(name: str, suffix: str) -> str:
    """File name with a suffix before its extension."""
    stem, _, extension = name.partition(".")
    return f"{stem}{suffix}.{extension}"


def files(card: dict) -> dict[str, str]:
    """Return file name -> text of the files of a card with shapes; none without."""
    return {numbered(name, shape["suffix"]): TEXTS[kind](shape) for shape in shapes(card) for name, kind in FILES.items()}


def rows(shape: dict) -> list[str]:
    """Return the spheres as lines `x y z r` in m."""
    return [" ".join(f"{sphere[key]:.9g}" for key in ("x_m", "y_m", "z_m", "radius_m")) for sphere in shape["spheres"]]


def spheres_text(shape: dict) -> str:
    """Text of clump.txt."""
    return "\n".join([f"# {shape['name']}: x y z r of every sphere in m", *rows(shape)]) + "\n"


def molecule_text(shape: dict) -> str:
    """Text of LAMMPS' molecule file: atoms of type 1, whose masses add up to the grain's."""
    spheres, cubes = shape["spheres"], sum(sphere["radius_m"] ** 3 for sphere in shape["spheres"])
    sections = {
        "Coords": [f"{s['x_m']:.9g} {s['y_m']:.9g} {s['z_m']:.9g}" for s in spheres],
        "Types": ["1" for _ in spheres],
        "Diameters": [f"{2.0 * s['radius_m']:.9g}" for s in spheres],
        "Masses": [f"{shape['mass_kg'] * s['radius_m'] ** 3 / cubes:.9g}" for s in spheres],
    }
    head = [
        f"# {shape['name']}, written by virtual-soil; SI units",
        "",
        f"{len(spheres)} atoms",
        f"{shape['mass_kg']:.9g} mass",
        "0 0 0 com",
        f"{' '.join(f'{moment:.9g}' for moment in shape['moments_kg_m2'])} 0 0 0 inertia",
    ]
    for name, values in sections.items():
        head += ["", name, "", *(f"{k} {value}" for k, value in enumerate(values, 1))]
    return "\n".join(head) + "\n"


TEXTS = {"spheres": spheres_text, "molecule": molecule_text}
