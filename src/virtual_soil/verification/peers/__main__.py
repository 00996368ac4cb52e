"""Run everything, print the tables, write results/verification/peers.parquet and peers_runs.csv; exit 1 where a check fails."""

import argparse
import sys
import time
from pathlib import Path

from virtual_soil.verification.check import table_of
from virtual_soil.verification.peers import compare, liggghts

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
    except liggghts.PeerError as error:
        print(error, file=sys.stderr)
        return 2
    table = table_of(compare.checks(runs))
    FOLDER.mkdir(parents=True, exist_ok=True)
    runs.to_csv(FOLDER / "peers_runs.csv", index=False)
    table.to_parquet(FOLDER / "peers.parquet")
    print(f"LIGGGHTS {liggghts.version()}\n")
    print(compare.summary(runs).to_string(index=False, float_format="{:.4g}".format))
    print()
    for row in table.itertuples():
        print(f"{'ok  ' if row.passed else 'FAIL'} {row.case}: {row.quantity} {row.obtained:.4g} {row.unit}", end="")
        print(f" ({row.relation} {row.expected:.4g}, tolerance {row.tolerance:.2g})\n     {row.note}")
    print(f"\n{table.passed.sum()} of {len(table)} checks hold; {time.perf_counter() - begin:.0f} s")
    return 0 if table.passed.all() else 1


if __name__ == "__main__":
    sys.exit(main())
