"""What is understood of a laboratory's files: `make read-lab FILE=...` prints it and draws it, before any study exists.

FILE is a soil file, or a file of shear tests alone, a table or AGS4; the area of a table's box is then AREA, in m2.
"""

import argparse
from pathlib import Path

import numpy as np

from virtual_soil.calibration.errors import CalibrationError
from virtual_soil.campaign.experiments.shear.laboratory import ENTRY, ShearTests, understood
from virtual_soil.campaign.soils import measure_soil, soil_content
from virtual_soil.report.laboratory import draw_tests
from virtual_soil.report.plots import svg

FOLDER = Path("results") / "read_lab"


def described(tests: ShearTests) -> list[str]:
    """Lines on shear tests: one each, and the line through them."""
    lines = [tests.method, "", f"{'test':<24}{'readings':>9}{'used':>6}{'normal stress (kPa)':>21}{'strength (kPa)':>16}"]
    curves = {curve.label: curve for curve in tests.curves}
    for label, (stress, strength) in tests.points.items():
        n = int((tests.readings["test"].astype(str) == label).sum()) if label in curves else 0
        used = f"{n:>9}{len(curves[label].shear):>6}" if label in curves else f"{'-':>9}{'-':>6}"
        lines.append(f"{label[:24]:<24}{used}{1e-3 * stress:>21.4g}{1e-3 * strength:>16.4g}")
    line = tests.line
    return [
        *lines,
        "",
        f"{tests.kind}: c = {line.cohesion_pa:.4g} +- {line.cohesion_se_pa:.2g} Pa, phi = {line.friction_angle_deg:.2f} +- "
        f"{line.friction_angle_se_deg:.2g} deg",
    ]


def read_lab(path: Path, area_m2: float | None, folder: Path = FOLDER) -> list[str]:
    """Lines on what a file holds; draws its shear tests into a folder. Raises CalibrationError if it cannot be read."""
    entry: dict | None = {"file": path.name, **({} if area_m2 is None else {"shear_area_m2": area_m2})}
    lines: list[str] = []
    if path.suffix in (".yaml", ".yml"):
        entry = soil_content(path).get(ENTRY)
        for _, row in measure_soil(path).iterrows():
            error = f" +- {row['standard_uncertainty']:.2g}" if np.isfinite(row["standard_uncertainty"]) else ""
            lines.append(f"{row['property']:<22}{row['value']:>10.5g}{error} {row['unit']}   {row['method']}")
    if entry is not None:
        tests = understood(path, entry)
        lines += ["", *described(tests)]
        folder.mkdir(parents=True, exist_ok=True)
        picture = folder / f"{path.stem}.svg"
        picture.write_text(svg(draw_tests({path.stem: tests})), encoding="utf-8")
        lines += ["", f"Drawn: {picture}"]
    return lines


def main(arguments: list[str] | None = None) -> None:
    """Print what is understood of a file."""
    parser = argparse.ArgumentParser(description="Show what is understood of a laboratory file.")
    parser.add_argument("file", type=Path, help="a soil file (.yaml), or a file of shear tests")
    parser.add_argument("--area", type=float, help="cross-section of the shear box in m2, if the file has forces")
    given = parser.parse_args(arguments)
    try:
        print("\n".join(read_lab(given.file, given.area)))
    except CalibrationError as error:
        raise SystemExit(str(error)) from None


if __name__ == "__main__":
    main()
