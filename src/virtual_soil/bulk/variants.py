"""Names of codes, cases, their variants and packings; light, because planning a study reads them."""

OURS, LIGGGHTS = "virtual_soil", "liggghts"
CODES = (OURS, LIGGGHTS)
#: Places of the ball in m, at most 0.1 grain diameters from the centre, for the scatter of the impact.
SHIFTS_M = ((0.0, 0.0), (2e-4, 0.0), (0.0, 2e-4), (-2e-4, 0.0), (0.0, -2e-4), (1e-4, 1e-4))
#: Starts of the drum, for its scatter.
DRUM_STARTS = 3
#: The beginning of the drum at full stiffness, for its speed.
DRUM_BEGINNING = "hard_beginning"
ORIFICES = ("small", "large")
CASES = ("impact", "drum", "silo")


def variants(settings: dict) -> dict[str, list[str]]:
    """Case -> its variants, from the section `bulk` of a configuration."""
    return {
        "impact": [f"{n_grains}_{start}" for n_grains in settings["impact_grains"] for start in range(len(SHIFTS_M))],
        "drum": [f"{settings['drum']}_{start}" for start in range(DRUM_STARTS)] + [DRUM_BEGINNING],
        "silo": [orifice if settings["silo"] == "scaled" else f"{orifice}_full" for orifice in ORIFICES],
    }


def packing_name(case: str, variant: str) -> str:
    """Name of the packing from which a variant starts."""
    return {"impact": f"penetration_{variant.split('_')[0]}", "drum": "drum_38000", "silo": f"silo_{variant}"}[case]
