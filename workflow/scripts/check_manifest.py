"""Adapt rule `check_manifest` to `virtual_soil.campaign.manifest`: print every file that is not as it was written; such fail."""

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
    # what it finds is for the person who asks; only errors go to the log
    sys.stderr = open(snakemake.log[0], "w", buffering=1, encoding="utf-8")  # noqa: SIM115 (open until the process ends)
    sys.exit(main(snakemake.params.folder))
