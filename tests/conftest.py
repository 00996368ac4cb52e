"""Settings for all tests."""

import pytest
from hypothesis import settings

# Before any test file imports numba: numba's own cache misses a change in a kernel that another file's kernel calls.
import dem  # noqa: F401

# The first example compiles kernels, so a deadline per example says nothing. Examples are the same in every run.
settings.register_profile("project", deadline=None, derandomize=True)
settings.load_profile("project")


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """Where tests run side by side, those of a file stay together, and so do all that look at the one finished campaign."""
    for item in items:
        group = "campaign" if "finished" in item.fixturenames else str(item.path)
        item.add_marker(pytest.mark.xdist_group(group))
