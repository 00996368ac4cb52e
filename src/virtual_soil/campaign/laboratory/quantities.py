"""What laboratory tables hold: quantities with their names in headers, units with their factors to SI, words of statistics."""

import re
import unicodedata
from dataclasses import dataclass

import numpy as np

KGF, LBF = 9.80665, 4.4482216152605
#: Kind -> unit as `unit_key` spells it -> factor to Pa, m, N or degrees (NIST SP 811). ton: of 2000 lbf; kg: kilogram-force.
UNITS = {
    "stress": {
        "pa": 1.0, "hpa": 1e2, "kpa": 1e3, "mpa": 1e6, "n/m2": 1.0, "kn/m2": 1e3, "n/cm2": 1e4, "n/mm2": 1e6,
        "mbar": 1e2, "bar": 1e5, "kgf/cm2": 1e4 * KGF, "kg/cm2": 1e4 * KGF, "t/m2": 1e3 * KGF,
        "psi": 6894.757, "lb/in2": 6894.757, "psf": 47.88026, "lb/ft2": 47.88026, "ksf": 47880.26, "tsf": 95760.52,
        "lbf/in2": 6894.757, "lbf/ft2": 47.88026, "lbs/in2": 6894.757, "lbs/ft2": 47.88026, "ksi": 6894757.0,
        "kip/ft2": 47880.26, "kips/ft2": 47880.26, "ton/ft2": 95760.52, "tons/ft2": 95760.52,
    },
    "length": {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "inch": 0.0254, "inches": 0.0254, "in": 0.0254, "ft": 0.3048},
    "force": {"n": 1.0, "kn": 1e3, "kgf": KGF, "kg": KGF, "lbf": LBF, "lb": LBF, "lbs": LBF, "kip": 1e3 * LBF, "kips": 1e3 * LBF},
    "angle": {"deg": 1.0, "degree": 1.0, "degrees": 1.0, "°": 1.0, "rad": 180.0 / np.pi},
}  # fmt: skip
#: Cyrillic spellings of units.
CYRILLIC = {
    "па": "pa", "кпа": "kpa", "мпа": "mpa", "н/мм2": "n/mm2", "кн/м2": "kn/m2", "кгс/см2": "kgf/cm2", "м": "m", "см": "cm",
    "мм": "mm", "мкм": "um", "н": "n", "кн": "kn", "кгс": "kgf", "град": "deg",
}  # fmt: skip


@dataclass(frozen=True)
class Quantity:
    """A quantity of a table: column in SI units or degrees, kind of its unit (None for a label), its names in headers.

    inherited : True if a cell may be left empty where the one above it holds on, as merged cells do.
    """

    column: str
    kind: str | None
    names: frozenset[str]
    inherited: bool = False


QUANTITIES = {
    "test": Quantity(
        "test", None, frozenset({"test", "test no", "test number", "specimen", "specimen no", "sample", "sample no"}), True
    ),
    "normal_stress": Quantity(
        "normal_stress_pa", "stress",
        frozenset({"normal stress", "vertical stress", "normal pressure", "applied normal stress", "sigma n", "σn", "σ n"}), True,
    ),
    "normal_force": Quantity(
        "normal_force_n", "force", frozenset({"normal force", "vertical force", "normal load", "vertical load"}), True
    ),
    "displacement": Quantity(
        "displacement_m", "length",
        frozenset({
            "displacement", "shear displacement", "horizontal displacement", "horiz displacement", "horizontal movement",
            "horizontal deformation", "shear deformation", "lateral displacement", "lateral deformation", "disp", "horizontal disp",
            "horiz disp", "shear disp", "displ", "horizontal displ", "horiz displ", "shear displ",
        }),
    ),
    "force": Quantity(
        "force_n", "force",
        frozenset({"force", "shear force", "horizontal force", "horiz force", "shear load", "horizontal load", "horiz load"}),
    ),
    "shear_stress": Quantity("shear_stress_pa", "stress", frozenset({"shear stress", "tau", "τ", "horizontal stress"})),
    "peak_strength": Quantity(
        "peak_strength_pa", "stress",
        frozenset({"peak shear stress", "peak shear strength", "peak strength", "maximum shear stress", "max shear stress"}),
    ),
    "steady_strength": Quantity(
        "steady_strength_pa", "stress",
        frozenset({
            "residual shear stress", "residual shear strength", "ultimate shear stress", "steady shear stress",
            "critical state shear stress",
        }),
    ),
    "soil": Quantity("soil", None, frozenset({"soil", "material", "condition", "sand", "type", "name"}), True),
    "left_angle": Quantity("left_angle_deg", "angle", frozenset({"left", "left angle", "left flank", "angle left"})),
    "right_angle": Quantity("right_angle_deg", "angle", frozenset({"right", "right angle", "right flank", "angle right"})),
    "heap_height": Quantity("heap_height_m", "length", frozenset({"height", "heap height"})),
    "base_diameter": Quantity("base_diameter_m", "length", frozenset({"diameter", "base diameter", "heap diameter"})),
    "angle_of_repose": Quantity("angle_of_repose_deg", "angle", frozenset({"angle of repose", "repose angle", "angle"})),
}  # fmt: skip

#: First words of rows that summarise others, and words that say it at the end: "Arithmetic mean".
STATISTICS = frozenset(
    "mean average avg ave median std sd stdev stddev sdev deviation cov cv rsd variance min minimum max maximum range sum total "
    "count sem se mittelwert mittel standardabweichung stabw moyenne moy ecart écart media promedio desviacion desviación "
    "deviazione среднее ско 平均 平均値 標準偏差".split()
)
LAST_WORDS = frozenset("mean average avg median deviation variance mittelwert".split())
#: Spellings of a missing measurement, in lower case.
MISSING = frozenset({"", "nan", "na", "n/a", "-", "--", "null", "none"})


def normal(name: str) -> str:
    """Normalise a header: words in lower case, separated by one space."""
    return " ".join(re.findall(r"[^\W_]+", name.casefold()))


def unit_key(unit: str) -> str:
    """Convert a unit to the spelling of `UNITS`. "mPa" is kept as millipascal: it may be a typing error for MPa."""
    text = plain(unit).replace("^", "").replace("μ", "u").replace(" ", "").rstrip(".")
    if text in ("mPa", "мПа"):
        return "millipascal"
    key = re.sub(r"/sq\.?([a-z]+)", r"/\g<1>2", text.lower())
    return CYRILLIC.get(key, key)


def plain(text: str) -> str:
    """Text with letters, brackets and powers as a European keyboard writes them: full-width forms, "㎪" and "²" are replaced."""
    return unicodedata.normalize("NFKC", text).strip()


def is_statistic(cell: str) -> bool:
    """True if a cell says that its row summarises others: "Mean", "S.D.", "Std. dev. (%)", "average of 3", "arithmetic mean"."""
    words = normal(plain(cell)).split()
    whole = "".join(words)  # of "S.D." and "St. dev."
    first = words[:1] and (words[0] in STATISTICS or words[:2] in (["standard", "deviation"], ["standard", "error"]))
    return bool(first) or whole in STATISTICS or bool(words and words[-1] in LAST_WORDS)


def label_key(label: str) -> str:
    """Label of a test without what spreadsheets add: "1.0" and "1" are one."""
    text = label.strip()
    return text.rstrip("0").rstrip(".") if re.fullmatch(r"\d+\.0+", text) else text
