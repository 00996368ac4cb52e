"""Whatever stands in a file, the readers of tables, checkpoints and manifests take it or refuse it in one line that names it."""

import json
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

import dem
from virtual_soil.campaign import status
from virtual_soil.campaign.inference import read_models
from virtual_soil.campaign.manifest import ManifestError, read_manifest
from virtual_soil.campaign.tables import METADATA_KEY, TableError, read_runs, read_table, read_timing, write_table

NAME = "0123456789"
RUN = {
    "simulation_id": [NAME], "reason": [""], "n_particles": [5], "status": ["static"], "n_steps": [7], "n_lost": [0],
    "simulated_time_s": [0.1], "max_overlap_ratio": [0.01], "energy_dissipated_j": [np.nan], "energy_residual_ratio": [np.nan],
}  # fmt: skip
#: One value of each type that a column may have.
COLUMNS = [
    pa.array([1]), pa.array([-1.5]), pa.array([np.nan]), pa.array([None]), pa.array(["x"]), pa.array([b"x"]), pa.array([True]),
    pa.array([[1]]), pa.array([{"a": 1}]), pa.array([None], pa.float64()), pa.array([None], pa.int64()), pa.array([1, 2]),
    pa.array([0], pa.timestamp("ns")), pa.array([0], pa.duration("s")), pa.array([2**63], pa.uint64()), pa.array([NAME]),
    pa.array([1], pa.decimal128(5)), pa.array(["x"]).dictionary_encode(), pa.array([], pa.float64()), pa.array(["static"]),
    pa.array([1.0], pa.float16()),
]  # fmt: skip
METADATA = st.one_of(
    st.none(),
    st.binary(max_size=20),
    st.sampled_from([b"null", b"[]", b"{}", b'{"simulations": 1}', b'{"simulations": {"0123456789": {}}}', b"[" * 2000]),
)
TIMING = b'{"wall_time_s": {"0123456789": %s}}'
many = settings(max_examples=300, suppress_health_check=list(HealthCheck))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("files")


@pytest.fixture(scope="module")
def sound(folder):
    """The file of a run, as it is written."""
    path = folder / NAME / "sound.parquet"
    write_table(RUN, path, "repose_run", {"simulations": {NAME: {}}})
    assert read_runs(path, "repose_run")[NAME]["n_steps"] == 7
    return path.read_bytes()


@pytest.fixture(scope="module")
def saved(folder):
    """A checkpoint, as it is written."""
    sand = dem.Material(density_kg_m3=2500.0, poisson_ratio=0.2, shear_modulus_pa=1e7)
    touch = dem.Interaction(restitution=0.5, static_friction=0.3, rolling_friction=0.1)
    floor = dem.Box(name="floor", material="sand", low_m=(-1, -1, 0), high_m=(1, 1, 0))
    simulation = dem.Simulation(
        materials={"sand": sand}, interactions={("sand", "sand"): touch}, walls=[floor], smallest_radius_m=1e-3
    )
    simulation.add_grains([(0.0, 0.0, 1.1e-3), (0.0, 0.0, 3.2e-3)], 1e-3, "sand")
    simulation.advance(5)
    dem.save(simulation, folder / "saved.npz", {"stage": "fill", "places": np.zeros(3)})
    return (folder / "saved.npz").read_bytes()


@st.composite
def damages(draw):
    """A function that does to some bytes what disks and people do."""
    kind = draw(st.sampled_from(["cut", "flip", "zero", "foreign", "insert"]))
    place, length, junk = (
        draw(st.floats(0, 1, exclude_max=True)),
        draw(st.integers(1, 600)),
        draw(st.binary(min_size=1, max_size=64)),
    )

    def damage(content: bytes) -> bytes:
        at = int(place * len(content))
        if kind == "cut":
            return content[:at]
        if kind == "flip":
            return content[:at] + bytes([content[at] ^ junk[0]]) + content[at + 1 :]
        if kind == "zero":
            return content[:at] + bytes(min(length, len(content) - at)) + content[at + length :]
        return junk if kind == "foreign" else content[:at] + junk + content[at:]

    return damage


def refused(error: Exception, path) -> None:
    """The message is one line, names the file and, of a result, says what to do."""
    assert str(path) in str(error)
    assert not isinstance(error, TableError) or str(error).endswith("Delete it and run again.")
    assert "\n" not in str(error)


@many
@given(damages())
def test_a_damaged_table_is_read_or_refused(folder, sound, damage):
    path = folder / NAME / "run.parquet"
    path.write_bytes(damage(sound))
    for read in (read_runs, read_table):
        try:
            read(path, "repose_run")
        except TableError as error:
            refused(error, path)
    try:
        status.read_rows(path, ["simulation_id"])
    except SystemExit as error:
        refused(error, path)


@many
@given(st.dictionaries(st.sampled_from([*RUN, "other"]), st.sampled_from(COLUMNS), max_size=3), METADATA, st.booleans())
@example({"simulation_id": pa.array(["another"])}, b"{}", True)
@example({"n_steps": pa.array([1, 2])}, None, False)
def test_a_foreign_table_is_read_or_refused(folder, sound, columns, metadata, complete):
    path = folder / NAME / "foreign.parquet"
    table = {name: pa.array(values) for name, values in RUN.items()} if complete else {}
    table |= columns
    n = max(map(len, table.values()), default=0)
    arrays = [pa.concat_arrays([values] * n).slice(0, n) if len(values) else pa.nulls(n, values.type) for values in table.values()]
    file = pa.table(arrays, names=list(table)).replace_schema_metadata(metadata and {METADATA_KEY: metadata})
    try:
        pq.write_table(file, path)
    except pa.ArrowNotImplementedError:  # a struct without fields, say
        return
    for read in (read_runs, read_table):
        try:
            found = read(path, "repose_run")
        except TableError as error:
            refused(error, path)
        else:
            assert read is read_table or set(found) == {NAME}


def test_a_column_that_stands_twice_is_refused(folder):
    path = folder / "twice.parquet"
    names = [*RUN, "n_steps"]
    pq.write_table(pa.table([pa.array([*RUN.values(), [9]][k]) for k in range(len(names))], names=names), path)
    with pytest.raises(TableError, match="'n_steps' is there 2 times"):
        read_table(path, "repose_run")


@many
@given(
    st.one_of(
        st.binary(max_size=40),
        st.sampled_from([TIMING % b"NaN", TIMING % b"-1", TIMING % b"2.5", b'{"wall_time_s": 1}', b"[]", b"1", b"[" * 2000]),
    )
)
def test_a_wall_time_is_read_or_refused(folder, content):
    path = folder / "timing.json"
    path.write_bytes(content)
    try:
        assert 0.0 <= read_timing(path, [NAME])[NAME] < np.inf
    except TableError as error:
        refused(error, path)


@many
@given(damages())
def test_a_damaged_checkpoint_is_read_or_refused(folder, saved, damage):
    path = folder / "checkpoint.npz"
    path.write_bytes(damage(saved))
    try:
        simulation = dem.load(path)
    except dem.CheckpointError as error:
        refused(error, path)
    else:  # what is not under a checksum: times and rights of the archive's members
        assert simulation.n_steps == 5


@pytest.mark.parametrize("description", ["[]", "null", "{}", '{"engine": 1}', '{"notes": {}}', "no JSON"])
def test_a_checkpoint_that_describes_nothing_is_refused(folder, saved, description):
    path = folder / "described.npz"
    path.write_bytes(saved)
    with np.load(path) as archive:
        arrays = dict(archive)
    if description == '{"notes": {}}':  # the engine's own mark, and nothing beside it
        description = json.dumps({"engine": json.loads(str(arrays["description"]))["engine"], "notes": {}})
    np.savez(path, **arrays | {"description": np.array(description)})
    with pytest.raises(dem.CheckpointError, match=r"described\.npz"):
        dem.load(path)


class Harm:
    """An object that does something when a pickle of it is read."""

    def __reduce__(self):
        return print, ("a pickle was read",)


def test_no_object_is_made_from_a_checkpoint(folder, saved, capsys):
    path = folder / "objects.npz"
    np.savez(path, grains=np.array([Harm()], object), description=np.array("{}"))
    with pytest.raises(dem.CheckpointError, match="allow_pickle"):
        dem.load(path)
    assert "a pickle was read" not in capsys.readouterr().out


@many
@given(st.one_of(st.binary(max_size=100), st.from_regex(rb"[0-9a-f]{64}  [^\n]{0,9}\n?")))
def test_a_manifest_is_read_or_refused(folder, content):
    (folder / "manifest.sha256").write_bytes(content)
    try:
        read_manifest(folder)
    except ManifestError as error:
        refused(error, folder)


@many
@given(damages(), st.sampled_from(["chosen", "quadratic", "gaussian_process"]))
@example(lambda content: b"[]", "chosen")
@example(lambda content: b'{"cohesion": {"chosen": []}}', "chosen")
def test_damaged_surrogates_are_read_or_refused(folder, damage, kind):
    path = folder / "surrogates.json"
    sound = (Path(__file__).parents[2] / "docs/reference/surrogates.json").read_bytes()
    path.write_bytes(damage(sound))
    try:
        read_models(path, kind)
    except TableError as error:
        message = str(error)
    else:
        return
    assert "surrogates.json: not the surrogates of a study (" in message
    assert len(message.splitlines()) == 1
