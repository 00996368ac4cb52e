"""What several of these tests share."""

import pytest
from campaign import copy_project, snakemake


@pytest.fixture(scope="session")
def finished(tmp_path_factory):
    """A finished smoke campaign."""
    project = copy_project(tmp_path_factory.mktemp("campaign"))
    result = snakemake(project, "-c2", "all")
    assert result.returncode == 0, result.stdout[-5000:] + result.stderr[-5000:]
    return project
