"""The default profile's logger: bars on a terminal, Snakemake's own lines in a log."""

import os
import pty
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parents[2]
PANEL = "Workflow Progress"  # the title over the bars
LINES = "2 of 2 steps (100%) done"

SNAKEFILE = """
rule all:
    input: "made.txt"

rule make_it:
    output: "made.txt"
    shell: "echo made > {output}"
"""


def run(folder, terminal, *options):
    """Run a workflow of one job, its output a pseudo terminal or a pipe: everything that it wrote there."""
    (folder / "Snakefile").write_text(SNAKEFILE)
    profile = ROOT / "profiles" / "default"
    command = [sys.executable, "-m", "snakemake", "-c1", "--workflow-profile", str(profile), *options]
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "src"), "TERM": "xterm"}
    if not terminal:
        both = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
        return subprocess.run(command, cwd=folder, env=environment, **both, text=True, check=True).stdout
    ours, theirs = pty.openpty()
    process = subprocess.Popen(command, cwd=folder, env=environment, stdout=theirs, stderr=theirs)
    os.close(theirs)
    written = b""
    while True:
        try:
            block = os.read(ours, 65536)
        except OSError:  # how Linux says that the other end was closed
            break
        if not block:
            break
        written += block
    os.close(ours)
    assert process.wait() == 0
    return written.decode()


@pytest.mark.parametrize(
    ("terminal", "options", "bars"),
    [(True, (), True), (False, (), False), (True, ("--quiet", "progress"), False), (True, ("--dry-run",), False)],
)
def test_bars_are_drawn_on_a_terminal_unless_less_is_asked_for(tmp_path, terminal, options, bars):
    written = run(tmp_path, terminal, *options)
    assert (PANEL in written) == bars
    assert ("rule make_it:" in written) == (not bars)
    if not bars and not options:
        assert LINES in written
    assert (tmp_path / "made.txt").exists() == ("--dry-run" not in options)


def test_every_profile_has_the_bars():
    """The workflow's own profile, default, goes with any other: none of these replaces its logger."""
    loggers = {path.parent.name: yaml.safe_load(path.read_text()).get("logger") for path in ROOT.glob("profiles/*/config.yaml")}
    assert loggers == {"default": ["bars"], "generic": None, "slurm": None}
