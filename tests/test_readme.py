"""The README's numbers are those of docs/reference, and its example runs as printed."""

import re
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text()
REFERENCE = ROOT / "docs/reference"
#: Number of decimals that the README prints, with the factor to its unit.
PARAMETERS = {
    "radius_m": ("radius (mm)", 1e3, 3),
    "static_friction": ("static friction", 1.0, 2),
    "rolling_friction": ("rolling friction", 1.0, 3),
}
PROPERTIES = {
    "angle_of_repose": ("angle of repose (°)", 1),
    "steady_friction_angle": ("steady friction angle (°)", 1),
    "steady_cohesion": ("steady cohesion (Pa)", 0),
}


def cells(first: str) -> list[str]:
    """Other cells of the only table row with this first cell."""
    (row,) = re.findall(rf"^\| {re.escape(first)} \| (.*) \|$", README, flags=re.MULTILINE)
    return row.split(" | ")


def printed(value: float, decimals: int) -> str:
    """The number as the README writes it, with a proper minus sign."""
    return f"{value:.{decimals}f}".replace("-", "−")


@pytest.mark.parametrize("name", PARAMETERS)
def test_the_sands_optimum_is_the_references(name):
    first, factor, decimals = PARAMETERS[name]
    answer = pd.read_parquet(REFERENCE / "calibration.parquet").query("case == 'sand' and surrogate == 'ours'").iloc[0]
    value, low, high = (printed(factor * answer[column], decimals) for column in (name, f"{name}_low_95", f"{name}_high_95"))
    assert cells(first) == [value, f"{low} to {high}"]


@pytest.mark.parametrize("name", PROPERTIES)
def test_the_sands_properties_are_the_references(name):
    first, decimals = PROPERTIES[name]
    row = pd.read_parquet(REFERENCE / "verification.parquet").query("case == 'sand'").set_index("response").loc[name]
    predicted, simulated = (
        f"{printed(row[k], decimals)} ± {printed(row[f'{k}_se'], decimals)}" for k in ("predicted", "simulated")
    )
    assert cells(first)[1:] == [predicted, simulated, row["prediction"], row["match"]]
    assert float(cells(first)[0]) == row["target"]


@pytest.mark.parametrize(
    ("parameter", "first"),
    {
        "base": "none (base set)",
        "radius_m": "radius 50 → 100 µm",
        "density_kg_m3": "density 3000 → 4000 kg/m³",
        "poisson_ratio": "Poisson's ratio 0.2 → 0.4",
        "shear_modulus_pa": "shear modulus 50 → 70 MPa",
        "static_friction": "static friction 0.3 → 0.5",
        "rolling_friction": "rolling friction 0.1 → 0.2",
        "restitution": "restitution 0.5 → 0.3",
    }.items(),
)
def test_the_screening_is_the_references(parameter, first):
    row = pd.read_parquet(REFERENCE / "screening.parquet").set_index("parameter").loc[parameter]
    ours, paper = (
        f"{row[angle]:.2f} ± {row[sd]:.2f}"
        for angle, sd in (("angle_of_repose_deg", "sd_deg"), ("paper_angle_deg", "paper_sd_deg"))
    )
    assert cells(first) == [ours, paper]


def test_the_example_gives_the_heap_that_is_shown():
    (code,) = re.findall(r"```python\n(.*?)```", README, flags=re.DOTALL)
    ((status, angle),) = re.findall(r"^    (\w+): ([\d.]+) deg", README, flags=re.MULTILINE)
    result = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    ((status_now, angle_now),) = re.findall(r"^(\w+): ([\d.]+) deg", result.stdout)
    assert status_now == status
    assert float(angle_now) == pytest.approx(float(angle), abs=3.0)  # other processors round otherwise: as another seed
