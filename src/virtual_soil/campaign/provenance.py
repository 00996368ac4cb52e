"""Versions of the packages with which a result was computed."""

from importlib.metadata import version

PACKAGES = ("numba", "numpy", "scipy", "pandas", "pyarrow", "snakemake")


def versions() -> dict[str, str]:
    """Versions of the packages on which results depend."""
    return {name: version(name) for name in PACKAGES}
