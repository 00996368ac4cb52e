"""Parquet in and out: schemas, provenance, files that are no tables."""

import pandas as pd
import pytest

from virtual_soil.calibration.checks import FidelityCheck, acceleration_table
from virtual_soil.campaign.tables import (
    SCHEMAS,
    TableError,
    check_table,
    empty_table,
    load_schema,
    read_provenance,
    read_table,
    write_table,
)

GRAINS = pd.DataFrame({"simulation": ["a"], "x_m": [0.0], "y_m": [0.0], "z_m": [1e-3], "radius_m": [1e-3], "speed_m_s": [0.0]})


def test_a_table_comes_back_with_its_provenance(tmp_path):
    path = str(tmp_path / "grains.parquet")
    write_table(GRAINS, path, "grains", {"seed": 3})
    pd.testing.assert_frame_equal(read_table(path, "grains"), GRAINS)
    assert read_provenance(path) == {"seed": 3}


def test_the_same_table_is_the_same_bytes(tmp_path):
    paths = [tmp_path / name for name in ("a.parquet", "b.parquet")]
    for path in paths:
        write_table(GRAINS, str(path), "grains", {"seed": 3})
    assert paths[0].read_bytes() == paths[1].read_bytes()


@pytest.mark.parametrize(
    ("frame", "message"),
    [
        (GRAINS.drop(columns="z_m"), "column 'z_m' is missing"),
        (GRAINS.assign(radius_m=-1.0), "column 'radius_m' holds -1.0; its minimum is 0"),
        (GRAINS.assign(x_m="left"), "column 'x_m' holds .*; allowed: number"),
        (GRAINS.assign(x_m=float("nan")), "column 'x_m' has missing values in 1 of 1 rows"),
    ],
)
def test_a_table_that_breaks_its_schema_is_refused_with_file_and_column(frame, message):
    with pytest.raises(TableError, match="some.parquet: " + message):
        check_table(frame, "grains", "some.parquet")


@pytest.mark.parametrize("content", [b"", b"not parquet", b"PAR1\x00\x00PAR1"])
def test_a_file_that_is_no_table_is_named(tmp_path, content):
    path = tmp_path / "broken.parquet"
    path.write_bytes(content)
    with pytest.raises(TableError, match=r"broken\.parquet: not a readable Parquet file"):
        read_table(str(path), "grains")


def test_every_schema_describes_its_columns():
    for path in (path for folder in SCHEMAS for path in folder.glob("*.yaml")):
        for column, rule in load_schema(path.stem).items():
            assert rule["meaning"], (path.stem, column)
            assert rule["type"] in ("string", "integer", "number", "boolean"), (path.stem, column)


def test_a_table_without_rows_obeys_its_schema(tmp_path):
    for path in (path for folder in SCHEMAS for path in folder.glob("*.yaml")):
        write_table(empty_table(path.stem), str(tmp_path / "empty.parquet"), path.stem, {})
        assert len(read_table(str(tmp_path / "empty.parquet"), path.stem)) == 0


def test_a_study_without_check_points_twins_or_further_rounds_has_tables_all_the_same(tmp_path):
    path = str(tmp_path / "empty.parquet")
    for name, frame in (
        ("acceleration", acceleration_table([FidelityCheck("repose", empty_table("repose"), "angle_of_repose_deg")])),
        ("twins", pd.DataFrame()),
    ):
        write_table(frame, path, name, {})
        assert list(read_table(path, name)) == list(load_schema(name))
    write_table(pd.DataFrame(columns=["stickiness"]), path, "design", {})
    assert "stickiness" in read_table(path, "design")
