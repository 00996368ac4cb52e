"""`snakemake --lint` without its hint about conda environments and containers, which CONTRIBUTING.md explains."""

import sys

from snakemake.cli import main
from snakemake.linting.rules import RuleLinter

del RuleLinter.lint_missing_software_definition
main(["--lint", *sys.argv[1:]])
