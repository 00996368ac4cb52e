"""Files as other laboratories would write them: languages, encodings, units, instruments, labels, repeats, spikes, statistics."""

import numpy as np
import pytest

from virtual_soil.calibration.errors import CalibrationError
from virtual_soil.campaign.laboratory.quantities import UNITS, is_statistic, unit_key
from virtual_soil.campaign.soils import measure_soil

AREA_M2, COHESION_KPA, PHI_DEG = 0.01, 3.0, 33.0
LOADS_KPA = (30.0, 75.0, 150.0)
WAY = ((0.0, 0.0), (0.3, 0.5), (0.8, 0.85), (1.6, 1.0), (2.8, 0.92), (4.2, 0.85), (5.6, 0.83))


def tau_kpa(load_kpa, part=1.0):
    return part * (COHESION_KPA + load_kpa * np.tan(np.radians(PHI_DEG)))


def table(header, row, mark=",", loads=LOADS_KPA):
    """Lines of a table of all tests; row(number, load in kPa, displacement in mm, shear stress in kPa) gives the cells."""
    rows = [row(k, p, x, tau_kpa(p, part)) for k, p in enumerate(loads, 1) for x, part in WAY]
    return "\n".join(
        [header, *(mark.join(f"{cell:.7g}" if isinstance(cell, float) else str(cell) for cell in some) for some in rows)]
    )


def measured(folder, text, encoding="utf-8", name="box.csv", **entry):
    (folder / name).write_bytes(text.encode(encoding))
    more = "".join(f", {key}: {value}" for key, value in entry.items())
    content = f"direct_shear_csv: {{file: {name}, shear_area_m2: {AREA_M2}{more}}}\n"
    (folder / "soil.yaml").write_text(content, encoding="utf-8")
    return measure_soil(folder / "soil.yaml").set_index("property")


def check(found, n=3, c_pa=1e3 * COHESION_KPA, phi_deg=PHI_DEG):
    assert found.loc["friction_angle", "value"] == pytest.approx(phi_deg, abs=0.01)
    assert found.loc["cohesion", "value"] == pytest.approx(c_pa, abs=10.0)
    assert f"direct shear, {n} tests" in found.loc["cohesion", "method"]


JAPANESE = {
    "encoding": "cp932",
    "columns": "{test: 供試体番号, normal_stress: 垂直応力, displacement: せん断変位, shear_stress: せん断応力}",
}


@pytest.mark.parametrize("header", [
    "供試体番号,垂直応力（kN/m2）,せん断変位（㎜）,せん断応力（ｋＰａ）",
    "供試体番号,垂直応力(kPa),せん断変位(mm),せん断応力(kPa)\n(記号),σ,δ,τ",
])  # fmt: skip
def test_a_japanese_sheet_names_its_encoding_and_columns(tmp_path, header):
    text = "一面せん断試験,,,\n試料,豊浦砂,,\n" + table(header, lambda k, p, x, tau: [f"No.{k}", p, x, tau])
    if "記号" in header:  # symbols in place of units between header and readings
        with pytest.raises(CalibrationError, match="line 4, column '垂直応力.*': 'σ'; allowed: a number: readings follow below"):
            measured(tmp_path, text, **JAPANESE)
        return
    check(measured(tmp_path, text, "cp932", **JAPANESE))
    with pytest.raises(CalibrationError, match="no line is a header .*, or as `columns`, and `encoding`, in the soil file say"):
        measured(tmp_path, text, "cp932", columns=JAPANESE["columns"])
