"""What shear boxes export: delimiters, decimal marks, units, encodings; what cannot be read is refused with one clear message."""

import warnings

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from virtual_soil.calibration.errors import CalibrationError
from virtual_soil.campaign.laboratory.quantities import UNITS
from virtual_soil.campaign.laboratory.table import read_laboratory
from virtual_soil.campaign.soils import measure_soil

SHEAR = ("test", "normal_stress", "displacement", "force")
PLAIN = "test,normal_stress_pa,displacement_m,force_n\n1,10000,0.001,36.5\n2,20000,0.002,72.25\n"


def read(folder, content, quantities=SHEAR, **options):
    path = folder / "box.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return read_laboratory(path, quantities, **options)


@pytest.fixture
def plain(tmp_path):
    return read(tmp_path, PLAIN).table


@pytest.mark.parametrize(
    "text",
    [
        "Test;Normal stress [kPa];Displacement (mm);Force / N\n1;10,0;1,0;36,5\n2;20,0;2,0;72,25\n",
        "Test\tNormal stress, kN/m²\tDisplacement, cm\tShear force in kN\n1\t10\t0.1\t0.0365\n2\t20\t0.2\t0.07225\n",
        "Test;Normal stress;Horizontal displacement;Shear force;Temperature\n;kPa;mm;N;°C\n1;10;1;36.5;20\n2;20;2;72.25;20\n",
        'Force [N],Displacement [mm],"Vertical stress, kPa",Specimen\n"36,5","1,0","10,0",1\n"72,25","2,0","20,0",2\n',
        "# exported by a logger\nOperator: N. N.\nDate;2020-01-02\n\n" + PLAIN,
        PLAIN.replace("\n1,", "\n// first test\n1,"),
    ],
)
def test_every_common_export_gives_the_same_numbers(tmp_path, plain, text):
    found = read(tmp_path, text)
    for column in plain:
        if column == "test":
            assert found.table[column].tolist() == plain[column].tolist()
        else:
            np.testing.assert_allclose(found.table[column], plain[column], rtol=1e-12)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "latin-1", "utf-16"])
def test_every_common_encoding_is_understood(tmp_path, encoding):
    text = "Test;Normal stress [kN/m²];Displacement [µm];Force [N]\nprüfung;1,5;2,0;3,0\n"
    table = read(tmp_path, text.encode(encoding), columns={"test": "Test"}).table
    assert table.iloc[0].tolist() == ["prüfung", 1500.0, pytest.approx(2e-6), 3.0]


def test_units_are_converted_to_si():
    known = {"stress": {"psi": 6894.757, "kgf/cm2": 98066.5, "n/mm2": 1e6}, "length": {"inch": 0.0254}, "force": {"lbf": 4.448222}}
    for kind, values in known.items():
        for unit, factor in values.items():
            assert UNITS[kind][unit] == pytest.approx(factor, rel=1e-6)
    assert UNITS["angle"]["rad"] == pytest.approx(57.29577951)
    assert UNITS["stress"]["psf"] * 144 == pytest.approx(UNITS["stress"]["psi"], rel=1e-6)


def test_empty_rows_are_skipped_and_counted_comments_are_not(tmp_path):
    found = read(tmp_path, PLAIN + "\n,,,\n3,NaN,-,\n# end\n3,40000,0.001,144\n")
    assert found.n_skipped == 3
    assert found.table["test"].tolist() == ["1", "2", "3"]


def test_a_user_names_headers_and_units_of_their_own(tmp_path):
    text = "Versuch;Auflast;Weg [mm];F [mV];Kraft\nA;50;1,5;7;12,5\n"
    columns = {
        "test": "Versuch", "normal_stress": {"header": "auflast", "unit": "kPa"}, "displacement": "Weg",
        "force": {"header": "Kraft", "unit": "N"},
    }  # fmt: skip
    assert read(tmp_path, text, columns=columns).table.iloc[0].tolist() == ["A", 50e3, 1.5e-3, 12.5]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (PLAIN.replace("36.5", "36.5x"), r"box.csv, line 2, column 'force_n': '36.5x'; allowed: a number with a decimal point"),
        (PLAIN.replace("36.5", ""), r"line 2, column 'force_n': empty; allowed: a value"),
        (PLAIN.replace("36.5", "inf"), r"line 2, column 'force_n': 'inf'"),
        (PLAIN.replace("36.5", "1e999"), r"line 2, column 'force_n': '1e999'"),
        (PLAIN.replace("36.5", "36,5"), r"line 2: 5 cells; allowed: the header's 4, separated by commas"),
        (PLAIN.replace(",", ";").replace("36.5", "36,5"), r"line 2, column 'force_n': '36,5'; allowed: one decimal mark"),
        (
            PLAIN.replace(",", "\t").replace("36.5", "1,234").replace("72.25", "2,345").replace("0.00", ""),
            "cannot separate thousands",
        ),
        (PLAIN.replace("_n\n", "\n"), r"column 'force' has no unit; allowed: n, kn"),
        (PLAIN.replace("_n\n", " [lx]\n"), r"column 'force \[lx\]' has the unit 'lx'; allowed: n, kn"),
        (PLAIN.replace("normal_stress_pa", "normal stress [mPa]"), "has the unit 'mPa'"),
        (
            PLAIN.replace("test", "Force (N)"),
            r"line 1: 'Force \(N\)' \(column 1\) and 'force_n' \(column 4\) are both read as force",
        ),
        (
            PLAIN.replace("force_n", "load_n"),
            r"no line is a header with a column for force \(nearest to it: line 1\); allowed: .*shear",
        ),
        (PLAIN.splitlines()[0], "number of rows with values below the header in line 1 is 0"),
        ("", "no line is a header with a column for test, normal_stress, displacement, force; allowed"),
        (b"PK\x03\x04\x00\x00", "not a text file"),
        (b"\xff\xfeab\x00", "not a text file"),
        (PLAIN + '"' + "x" * 200000, "line 4: not a row of a table"),
    ],
)
def test_what_cannot_be_read_is_refused_with_place_value_and_what_is_allowed(tmp_path, text, message):
    with pytest.raises(CalibrationError, match=message):
        read(tmp_path, text)


def test_a_comma_that_may_separate_thousands_is_read_as_the_user_says(tmp_path):
    text = "Angle [deg]\n31,250\n29,500\n"
    with pytest.raises(CalibrationError, match="line 2, column 'Angle \\[deg\\]': '31,250'"):
        read(tmp_path, text, ("angle_of_repose",))
    assert read(tmp_path, text, ("angle_of_repose",), decimal=",").table["angle_of_repose_deg"].tolist() == [31.25, 29.5]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"columns": ["force"]}, "columns is .*allowed: a mapping"),
        ({"columns": {"colour": "x"}}, "columns.colour is unknown"),
        ({"columns": {"force": 3}}, "columns.force is 3"),
        ({"columns": {"force": {"header": "F", "unit": "kPa"}}}, "columns.force.unit is 'kPa'; allowed: one of n, kn"),
        ({"decimal": ";"}, "decimal is ';'"),
    ],
)
def test_an_impossible_mapping_is_refused(tmp_path, options, message):
    with pytest.raises(CalibrationError, match=message):
        read(tmp_path, PLAIN, **options)


def test_missing_files_and_folders_are_named(tmp_path):
    for path in (tmp_path / "none.csv", tmp_path):
        with pytest.raises(CalibrationError, match="cannot be read"):
            read_laboratory(path, SHEAR)


CELL = st.one_of(
    st.sampled_from(
        ["test", "Normal stress [kPa]", "displacement_m", "Force / N", "force_n", "1", "2,5", "1e3", "-4.5", "NaN", '"', "kPa"]
    ),
    st.floats(allow_nan=False).map(str),
    st.text(max_size=6),
)
TABLE = st.builds(
    lambda rows, mark, end: end.join(mark.join(row) for row in rows).encode("utf-8", "surrogatepass"),
    st.lists(st.lists(CELL, max_size=6), max_size=8),
    st.sampled_from([",", ";", "\t"]),
    st.sampled_from(["\n", "\r\n", "\r"]),
)
VALUE = st.one_of(st.floats(allow_nan=False), st.floats(1.0, 1e6)).map(lambda x: f"{x:.3g}")
NUMBERS = st.builds(
    lambda rows: ("test,normal_stress_pa,displacement_m,force_n\n" + "\n".join(",".join(row) for row in rows)).encode(),
    st.lists(st.tuples(st.sampled_from("1234"), VALUE, VALUE, VALUE), min_size=3, max_size=9),
)


@settings(max_examples=400, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.one_of(st.binary(max_size=200), TABLE, NUMBERS))
@example(b"test,normal_stress_pa,displacement_m,force_n\n1,1e5,0,1e300\n2,1e5,0,1\n3,1e-300,0,1\n")
def test_any_bytes_are_a_table_of_finite_numbers_or_a_calibration_error(tmp_path, content):
    try:
        table = read(tmp_path, content).table
    except CalibrationError:
        return
    assert len(table) > 0
    assert np.isfinite(table[["normal_stress_pa", "displacement_m", "force_n"]].to_numpy()).all()


@settings(max_examples=300, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.one_of(NUMBERS, TABLE))
def test_any_shear_tests_are_a_soil_within_its_bounds_or_a_calibration_error(tmp_path, content):
    (tmp_path / "box.csv").write_bytes(content)
    soil = tmp_path / "soil.yaml"
    soil.write_text(
        "direct_shear_csv: {file: box.csv, shear_area_m2: 0.01}\nangle_of_repose_deg: {value: 30.0, source: book}\n",
        encoding="utf-8",
    )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            values = measure_soil(soil).set_index("property")["value"]
        except CalibrationError:
            return
    assert 0 < values["friction_angle"] < 90
    assert np.isfinite(values["cohesion"])


@settings(max_examples=200, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.one_of(
        st.binary(max_size=100),
        st.builds(
            lambda key, value: f"{key}: {value}\n".encode("utf-8", "surrogatepass"),
            st.sampled_from(["cohesion_pa", "direct_shear_csv", "repose_csv"]),
            st.one_of(
                st.text(max_size=20),
                st.sampled_from(
                    [
                        "{value: .inf, source: a}",
                        "{value: true, source: a}",
                        "{file: 3}",
                        '{file: "a\\0b"}',
                        "{file: soil.yaml, columns: 1}",
                    ]
                ),
            ),
        ),
    )
)
def test_any_soil_file_is_a_table_or_a_calibration_error(tmp_path, content):
    path = tmp_path / "soil.yaml"
    path.write_bytes(content)
    with pytest.raises(CalibrationError):  # none of them gives all three properties
        measure_soil(path)
