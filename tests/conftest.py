"""Settings for all tests."""

from pathlib import Path

import pytest
from hypothesis import settings

# Before any test file imports numba: numba's own cache misses a change in a kernel that another file's kernel calls.
import dem  # noqa: F401

# The first example compiles kernels, so a deadline per example says nothing. Examples are the same in every run.
settings.register_profile("project", deadline=None, derandomize=True)
settings.load_profile("project")

TESTS = Path(__file__).parent

#: Files that look at the one finished campaign.
CAMPAIGN = ("workflow/test_campaign.py", "workflow/test_report_page.py")
#: Files that need kernels of their own: one worker takes them all, so that none waits for a kernel that another compiles.
KERNELS = tuple(
    f"dem/test_{name}.py"
    for name in (
        "bodies",
        "simulation",
        "slow_twin",
        "checkpoint",
        "capillary",
        "clumps",
        "clump_soil",
        "compiled",
        "cut_slope",
        "wheel",
    )
)
#: Files that take minutes. They begin first, so that no processor waits at the end for the last of them. The order lets files
#: that compile run beside files that start processes.
LONG = (
    *CAMPAIGN,
    "verification/test_groups.py",
    "workflow/test_faults.py",
    *KERNELS,
    "workflow/test_apparatus_guide.py",
    "workflow/test_additions.py",
    "test_examples.py",
)


def pytest_collection_modifyitems(items):
    """Put the tests of long files first, in the order above."""
    order = {str(TESTS / name): k for k, name in enumerate(LONG)}
    items.sort(key=lambda item: order.get(str(item.path), len(LONG)))


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """Where tests run side by side, those of a file stay together, and so do the files of CAMPAIGN and those of KERNELS."""
    from xdist.scheduler import LoadFileScheduling  # xdist's own marks for groups have no effect with pytest 9.2

    config.option.loadscopereorder = False  # the files with the most tests are not those that take longest

    class BySharedFixtures(LoadFileScheduling):
        def _split_scope(self, nodeid):
            file = super()._split_scope(nodeid)
            return next((names[0] for names in (CAMPAIGN, KERNELS) if file.endswith(names)), file)

    return BySharedFixtures(config, log)
