"""Figures and tables of the report: name -> (section of the method, title). Captions: captions/<name>.rst."""

from pathlib import Path

from snakemake.io import report

CAPTIONS = Path(__file__).resolve().with_name("captions")

ANSWER, SOILS, SCREENING, SURROGATES = "The answer", "1. Real soils", "2. Screening", "3. Virtual tests and surrogates"
OPTIMUM, UNCERTAINTY, VERIFICATION, CHECKS = "4. Optimisation", "5. Uncertainty", "6. Simulating the answer", "Checks"

FIGURES = {
    "lift": (SURROGATES, "Figure 2: the tube is lifted"),
    "heap": (SURROGATES, "Figure 2: tube and heap"),
    "shear_box": (SURROGATES, "Figure 3: shear box"),
    "shear_curves": (SURROGATES, "Figure 4: shear curves"),
    "strength_line": (SURROGATES, "Equation 1: strength line"),
    "angle_of_repose": (SURROGATES, "Figure 5: angle of repose"),
    "friction_angle": (SURROGATES, "Friction angle"),
    "cohesion": (SURROGATES, "Cohesion"),
    "surfaces": (SURROGATES, "Response surfaces"),
    "radius_sweep": (SURROGATES, "Radius sweep"),
    "residuals": (SURROGATES, "Errors at left-out points"),
    "iterations": (OPTIMUM, "Iterations"),
    "iso": (UNCERTAINTY, "Curves of equal response"),
}
#: Figures of a design whose grid is static and rolling friction.
OF_FRICTION_GRID = ("angle_of_repose", "friction_angle", "cohesion", "surfaces", "radius_sweep", "residuals", "iso")

TABLES = {
    "answer": (ANSWER, "Calibrated grain parameters"),
    "properties": (ANSWER, "Properties at the optima"),
    "soils": (SOILS, "Table 1: targets"),
    "reachability": (SOILS, "Targets within reach"),
    "screening": (SCREENING, "Table 2: one parameter changed"),
    "equation": (SURROGATES, "Equation 3: coefficients"),
    "quality": (SURROGATES, "Errors of the surrogates"),
    "sensitivity": (SURROGATES, "Sobol indices"),
    "optimisation": (OPTIMUM, "Optima beside the paper's"),
    "minima": (OPTIMUM, "Distinct minima"),
    "identifiability": (UNCERTAINTY, "Determined combinations"),
    "verification": (VERIFICATION, "Optima simulated"),
    "acceleration": (CHECKS, "Bias of the acceleration"),
}


def has_friction_grid(config: dict) -> bool:
    """Whether the design's grid is static and rolling friction, as the surfaces need."""
    return set(config["design"]["grid"]) == {"static_friction", "rolling_friction"}


def figure_names(config: dict) -> list[str]:
    """The figures of a study."""
    return [name for name in FIGURES if has_friction_grid(config) or name not in OF_FRICTION_GRID]


def caption(name: str) -> str:
    """The caption of a figure or table, on one line."""
    return " ".join((CAPTIONS / f"{name}.rst").read_text(encoding="utf-8").split())


def marked(path: str, section: str, title: str):
    """A file of the report that `snakemake --report` shows too, with its caption, under its section and title."""
    return report(path, caption=str(CAPTIONS / f"{Path(path).stem}.rst"), category=section, labels={"shows": title})
