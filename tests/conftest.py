"""Settings for all tests."""

from hypothesis import settings

# Before any test file imports numba: numba's own cache misses a change in a kernel that another file's kernel calls.
import dem  # noqa: F401

# The first example compiles kernels, so a deadline per example says nothing. Examples are the same in every run.
settings.register_profile("project", deadline=None, derandomize=True)
settings.load_profile("project")
