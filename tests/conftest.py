"""Settings for all tests."""

from hypothesis import settings

# The first example compiles kernels, so a deadline per example says nothing. Examples are the same in every run.
settings.register_profile("project", deadline=None, derandomize=True)
settings.load_profile("project")
