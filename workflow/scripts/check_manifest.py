"""Adapt rule `check_manifest` to `virtual_soil.campaign.manifest`: print every file that differs from the manifest; fail if any."""

import sys

from virtual_soil.campaign.manifest import ManifestError, differences


def main(folder):
    try:
        lines = differences(folder)
    except ManifestError as error:
        lines = [str(error)]
    for line in lines:
        print(line, flush=True)
    if not lines:
        print(f"{folder}: all files are as they were written", flush=True)
    return int(bool(lines))


if __name__ == "__main__":
    # differences are printed on the terminal; only errors go to the log
    sys.stderr = open(snakemake.log[0], "w", buffering=1, encoding="utf-8")  # noqa: SIM115 (open until the process ends)
    sys.exit(main(snakemake.params.folder))
