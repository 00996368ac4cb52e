"""Snakemake waits for running jobs without looking at all others again and again."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
N_JOBS = 3
SNAKEFILE = f"""
include: "{ROOT}/workflow/rules/scheduling.smk"

rule all:
    input: expand("{{number}}.txt", number=range({N_JOBS}))

rule wait:
    output: "{{number}}.txt"
    shell: "sleep 3; touch {{output}}"
"""


def test_jobs_are_looked_at_only_when_one_has_ended(tmp_path):
    (tmp_path / "Snakefile").write_text(SNAKEFILE)
    command = [sys.executable, "-m", "snakemake", "-c1", "--verbose"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    looks = done.stderr.count("Resources before job selection")
    assert N_JOBS <= looks <= N_JOBS + 1  # once at the start, then after each job; `all` is one more
