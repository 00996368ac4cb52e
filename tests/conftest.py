"""Settings for all tests."""

import pytest
from hypothesis import settings

# Before any test file imports numba: numba's own cache misses a change in a kernel that another file's kernel calls.
import dem  # noqa: F401

# The first example compiles kernels, so a deadline per example says nothing. Examples are the same in every run.
settings.register_profile("project", deadline=None, derandomize=True)
settings.load_profile("project")


#: Files that take minutes. They begin first, so that no processor waits at the end for the last of them.
LONG = (
    "test_campaign.py",
    "test_report_page.py",
    "test_groups.py",
    "test_faults.py",
    "test_apparatus_guide.py",
    "test_additions.py",
    "test_examples.py",
    "test_bodies.py",
)


def pytest_collection_modifyitems(items):
    """Put the tests of long files first, in the order above."""
    items.sort(key=lambda item: LONG.index(item.path.name) if item.path.name in LONG else len(LONG))


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """Where tests run side by side, those of a file stay together, and so do the files that look at the one finished campaign."""
    from xdist.scheduler import LoadFileScheduling  # xdist's own marks for groups have no effect with pytest 9.2

    config.option.loadscopereorder = False  # the files with the most tests are not those that take longest

    class BySharedFixtures(LoadFileScheduling):
        def _split_scope(self, nodeid):
            file = super()._split_scope(nodeid)
            return "campaign" if file.endswith(("test_campaign.py", "test_report_page.py")) else file

    return BySharedFixtures(config, log)
