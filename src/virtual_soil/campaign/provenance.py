"""With which versions of the packages a result was made."""

from importlib.metadata import version

PACKAGES = ("numba", "numpy", "scipy", "pandas", "pyarrow", "snakemake")


def versions() -> dict[str, str]:
    """Versions of the packages that results depend on."""
    return {name: version(name) for name in PACKAGES}
