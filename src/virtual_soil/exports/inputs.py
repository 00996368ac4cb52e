"""Input files for other DEM programs: templates filled with the values of a material card in the program's own definitions."""

import math
from pathlib import Path

import jinja2

from virtual_soil.exports import adhesion, friction, shape
from virtual_soil.exports.rolling import converted, explanation

#: Program -> (template and file name, comment prefix).
PROGRAMS = {
    "LIGGGHTS": ("in.liggghts", "# "),
    "LAMMPS": ("in.lammps", "# "),
    "YADE": ("yade_material.py", "# "),
    "MercuryDPM": ("mercurydpm_species.h", "// "),
    "EDEM": ("edem.csv", "# "),
}
TEMPLATES = Path(__file__).with_name("templates")
#: Overlap over radius at which a rolling spring of constant stiffness is as stiff as the tangential spring.
OVERLAP_RATIO = 1e-3
#: Time step over Rayleigh time; EDEM recommends 0.2 to 0.4.
RAYLEIGH_RATIO = 0.2


def inputs(card: dict) -> dict[str, str]:
    """Return file name -> text for every program, and of a shape; card as from `exports.material_card`."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(TEMPLATES), undefined=jinja2.StrictUndefined, trim_blocks=True, keep_trailing_newline=True
    )
    environment.filters["number"] = lambda value: f"{value:.9g}"
    numbers = derived(card)
    texts = {}
    for program, (name, comment) in PROGRAMS.items():
        model = card["models"]["rolling"]["type"]
        mu_r, mu_r_wall = (card["parameters"]["rolling_friction"]["value"], card["walls"]["rolling_friction"])
        rolling = {"rolling": converted(mu_r, model, program)[0], "wall_rolling": converted(mu_r_wall, model, program)[1]}
        notes = [*heading(card, program), *explanation(model, program), *adhesion.explanation(card, program)]
        notes += [*friction.explanation(card, program), *shape.explanation(card, program)]
        context = {**numbers, **rolling, "notes": "\n".join((comment + line).rstrip() for line in notes), "card": card}
        context["adhesion"] = adhesion.adhesion(card, numbers, program)
        context["shapes"] = shape.shapes(card)
        texts[name] = environment.get_template(f"{name}.j2").render(context)
    return texts | shape.files(card)


def heading(card: dict, program: str) -> list[str]:
    """Return the header lines of a file."""
    sizes = card["parameters"]["radius_sd_ratio"]["value"]
    spread = [f"The radii scatter by {sizes:g} of their mean: give the program that distribution."] if sizes > 0 else []
    grading = card["simulated_with"]["grading"]
    if grading["sieve_passing"]:
        spread = [
            f"Sieve curve, to be scaled to the mean radius: {grading['sieve_passing']} pass {grading['sieve_diameters_m']} m."
        ]
    elif sizes > 0 and grading["distribution"] != "normal":
        spread.append(f"The distribution is {grading['distribution']}, cut off at two standard deviations.")
    return [
        f"Material {card['case']} (soil {card['soil']}, study {card['study']}) for {program}, written by virtual-soil. SI units.",
        f"Simulated with virtual-soil: prediction {card['verification']['prediction']}; wanted properties: "
        f"{card['verification']['match']}.",
        "Intervals and origin: material.json.",
        *spread,
        "",
    ]


def derived(card: dict) -> dict[str, float]:
    """Return the material values and the quantities derived from them that other programs require."""
    value = {name: entry["value"] for name, entry in card["parameters"].items()}
    nu, G, r, least = value["poisson_ratio"], value["shear_modulus_pa"], shape.contact_radius_m(card), shape.smallest_radius_m(card)
    E = 2.0 * G * (1.0 + nu)
    G_star = G / (2.0 * (2.0 - nu))
    k_t = 8.0 * G_star * r * math.sqrt(0.5 * OVERLAP_RATIO)  # S_t = 8 G* sqrt(R* d), R* = r/2
    rayleigh = math.pi * least * math.sqrt(value["density_kg_m3"] / G) / (0.1631 * nu + 0.8766)
    return {
        **value,
        "contact_radius_m": r,
        "wall_static_friction": card["walls"]["static_friction"],
        "young_modulus_pa": E,
        "effective_young_modulus_pa": E / (2.0 * (1.0 - nu**2)),
        "effective_shear_modulus_pa": G_star,
        "rolling_stiffness_n_m": k_t,
        "rolling_stiffness_nm_rad": k_t * (0.5 * r) ** 2,
        "tangential_damping_ratio": math.sqrt(2.0 * (1.0 - nu) / (2.0 - nu)),  # sqrt(S_t / S_n)
        "friction_angle_rad": math.atan(value["static_friction"]),
        "wall_friction_angle_rad": math.atan(card["walls"]["static_friction"]),
        "time_step_s": RAYLEIGH_RATIO * rayleigh,
        "overlap_ratio": OVERLAP_RATIO,
    }
