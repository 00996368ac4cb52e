"""Numbers in titles: "Normal stress: 25 kPa", "Normal stress (kPa) = 25", and above tables side by side "Specimen 2 - 25 kPa"."""

import re
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

from virtual_soil.calibration.errors import CalibrationError
from virtual_soil.campaign.laboratory.quantities import QUANTITIES, UNITS, normal, unit_key

NUMBER = re.compile(r"[+-]?(\d+([.,]\d*)?|[.,]\d+)([eE][+-]?\d{1,3})?")
#: Ambiguous comma: decimal mark or thousands separator.
AMBIGUOUS = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}")
#: Separates what stands in different cells, and in different rows, above a table.
BETWEEN, BELOW = " | ", "; "
VALUE, UNIT = r"(?P<value>[+-]?\d[\d.,]*)", r"(?P<unit>[^\W\d_][\w./²^]*)"
#: A quantity in a title, its unit behind the number or behind the name.
NAMED = (rf"{{name}}\W*?{VALUE}\s*\W?\s*{UNIT}", rf"{{name}}\s*[\[(/,]\s*{UNIT}\s*[\])]?[\s:=|]*{VALUE}(?![\d\s.,;/-]*\d)")
#: A number with a unit that no other number stands before: "1 250 kPa" may be one number or two.
BARE = re.compile(rf"(?<![\w.,])(?<!\d\s){VALUE}\s*{UNIT}")
#: Words beside which a stress in a title can only be the normal stress.
BESIDE_A_LOAD = frozenset(
    "test specimen sample stage run box no nr number load normal vertical stress pressure sigma at under".split()
)


@dataclass(frozen=True)
class Title:
    """Text above a table: its file, the line of the table's header, and the decimal mark if the soil file names it."""

    path: Path
    line: int
    text: str
    decimal: str | None = None

    def stated(self, name: str, words: Collection[str] = (), *, bare: bool = False) -> float | None:
        """Value of a quantity in SI units, None if the title does not state it.

        words : further spellings of its name. bare : accept a stress without a name. Raises CalibrationError if the title states
        several values, or a number that may be read in two ways.
        """
        kind = QUANTITIES[name].kind
        assert kind is not None  # labels are no numbers
        names = sorted({*QUANTITIES[name].names, *words}, key=len, reverse=True)
        patterns = [re.compile(form.format(name=rf"\b{re.escape(word)}"), re.IGNORECASE) for word in names for form in NAMED]
        found = [match for pattern in patterns for match in pattern.finditer(self.text)]
        if bare and not found:
            found = [match for piece in re.split(r" \| |; ", self.text) for match in self.bare(piece, kind)]
        values = {self.number(m["value"]) * UNITS[kind][unit_key(m["unit"])] for m in found if unit_key(m["unit"]) in UNITS[kind]}
        if len(values) > 1:
            raise self.fault(self.text, f"one {name.replace('_', ' ')}")
        return values.pop() if values else None

    def bare(self, piece: str, kind: str) -> list[re.Match]:
        """A number with a unit of this kind in a piece of a title that says nothing else."""
        found = [match for match in BARE.finditer(piece) if unit_key(match["unit"]) in UNITS[kind]]
        rest = normal(BARE.sub(" ", piece)).split()
        alone = all(word in BESIDE_A_LOAD or len(word) == 1 or any(c.isdigit() for c in word) for word in rest)
        return found if alone else []

    def number(self, text: str) -> float:
        """Number in a title."""
        text = text.rstrip(".,")
        mark = self.decimal or ("," if "," in text else ".")
        other = "." if mark == "," else ","
        if NUMBER.fullmatch(text) is None or other in text or (self.decimal is None and AMBIGUOUS.fullmatch(text)):
            raise self.fault(text, 'a number whose comma cannot separate thousands, or `decimal: ","` in the soil file')
        return float(text.replace(",", "."))

    def fault(self, text: str, allowed: str) -> CalibrationError:
        """Error that names file, line, text and what is allowed."""
        return CalibrationError(f"{self.path}, title of the table in line {self.line}: {text!r}; allowed: {allowed}.")
