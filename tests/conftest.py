"""Settings for all tests."""

import pytest
from hypothesis import settings

# Before any test file imports numba: numba's own cache misses a change in a kernel that another file's kernel calls.
import dem  # noqa: F401

# The first example compiles kernels, so a deadline per example says nothing. Examples are the same in every run.
settings.register_profile("project", deadline=None, derandomize=True)
settings.load_profile("project")


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """Where tests run side by side, those of a file stay together, and so do the files that look at the one finished campaign."""
    from xdist.scheduler import LoadFileScheduling  # xdist's own marks for groups have no effect with pytest 9.2

    class BySharedFixtures(LoadFileScheduling):
        def _split_scope(self, nodeid):
            file = super()._split_scope(nodeid)
            return "campaign" if file.endswith(("test_campaign.py", "test_report_page.py")) else file

    return BySharedFixtures(config, log)
