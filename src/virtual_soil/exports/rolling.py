"""Conversion of rolling friction coefficients from virtual-soil's definition to those of other programs.

Every program limits the rolling torque on a grain to mu F_n a with its own lever arm a: a = L r between equal spheres of radius r
and a = W r at a wall. L and W are the program's `ARMS`; R* = r/2 between equal spheres and r at a wall.

Two equal spheres that roll on each other without slip have opposite spins, w and -w. virtual-soil's type A applies mu_r F_n r
against each sphere's own spin. A torque against the relative spin 2w acts on both grains with the magnitude mu F_n L r. The torques
are equal for mu = mu_r / L, and so is the dissipated power: 2 mu_r F_n r w and mu F_n L r (2w). The same holds for a sphere that
rolls on a resting sphere or on a wall. The remaining differences are listed in `differences`.

Sources: EDEM and type C as in `dem.contact.rolling`; LIGGGHTS-PUBLIC documentation, rolling_friction cdt and epsd2; LAMMPS
documentation, pair_style granular (rolling sds: force mu F_n, arm R*); YADE, HertzMindlin.cpp (maxBendPl = eta times the mean
radius); MercuryDPM, MindlinRollingTorsionInteraction.cc (arm 2 R*, so W = 2). Tests run LIGGGHTS, LAMMPS and YADE.
"""

#: Model or program -> (L, W): lever arm of the rolling torque over r, between equal spheres and at a wall.
ARMS = {
    "type_a": (1.0, 1.0),
    "type_c": (0.5, 1.0),
    "EDEM": (1.0, 1.0),
    "LIGGGHTS": (0.5, 1.0),
    "LAMMPS": (0.5, 1.0),
    "YADE": (1.0, 1.0),
    "MercuryDPM": (1.0, 2.0),
}
#: Program -> its limit of the rolling torque, in words.
LAWS = {
    "EDEM": "Hertz-Mindlin's standard rolling friction brakes each grain with mu F_n R_i against its own spin.",
    "LIGGGHTS": "rolling_friction epsd2 brakes the relative rolling of two grains with at most mu F_n R*.",
    "LAMMPS": "rolling sds brakes the relative rolling of two grains with at most mu F_n R*.",
    "YADE": "MindlinPhys brakes the relative bending rotation of two grains with at most eta F_n (R_1 + R_2)/2.",
    "MercuryDPM": "MindlinRollingTorsion brakes the relative rolling of two grains with at most mu F_n 2 R*.",
}
OURS = {
    "type_a": "virtual-soil (type A, as EDEM): each grain feels the torque mu_r F_n R_i against its own spin.",
    "type_c": "virtual-soil (type C, elastic-plastic): the relative rolling of two grains is braked with at most mu_r F_n R*.",
}


def converted(coefficient: float, model: str, program: str) -> tuple[float, float]:
    """Convert the rolling friction of virtual-soil's `model` to the program's coefficients (between grains, at a wall)."""
    between, against = (ours / theirs for ours, theirs in zip(ARMS[model], ARMS[program], strict=True))
    return coefficient * between, coefficient * against


def explanation(model: str, program: str) -> list[str]:
    """Return comment lines that explain a program's coefficients and the remaining differences."""
    between, against = (times(factor) for factor in converted(1.0, model, program))
    ours, theirs = ([times(arm) for arm in ARMS[name]] for name in (model, program))
    return [
        OURS[model],
        f"{program}: {LAWS[program]}",
        "Two equal spheres of radius r that roll on each other turn with w and -w; R* = r/2. The torque on each is",
        f"{ours[0]}mu_r F_n r there and {theirs[0]}mu F_n r here: the same for mu = {between}mu_r, as is the loss.",
        f"Against a wall R* = r. It is {ours[1]}mu_r F_n r there and {theirs[1]}mu F_n r here: mu = {against}mu_r.",
        *differences(model, program),
        "THE HEAP MUST BE SIMULATED AGAIN IN THIS PROGRAM before its angle of repose is relied on.",
    ]


def times(factor: float) -> str:
    """Format a factor before a symbol."""
    return "" if factor == 1.0 else f"{factor:g} "


def differences(model: str, program: str) -> list[str]:
    """Return the remaining differences of the program's law from virtual-soil's."""
    if model == "type_a" and program == "EDEM":
        return ["The laws are the same, except that virtual-soil's torque may stop a spin but never reverse it."]
    if model == "type_a":
        return [
            "The laws differ all the same: type A also brakes grains that turn together as one rigid body or about the normal, and",
            "acts at its limit as soon as a grain turns; the other acts through a spring that first has to be wound up.",
            "Heaps come out flatter with relative laws: docs/guides/exports.md of virtual-soil has an example. A study with",
            "engine.rolling_model: type_c calibrates a law of this kind itself. Unequal spheres: a factor for each pair.",
        ]
    if program == "EDEM":
        return ["The laws differ all the same: EDEM's brakes every spin, also of grains that turn together; it has no spring."]
    return ["The laws are alike; their springs, which matter below the limit, are not equally stiff."]
