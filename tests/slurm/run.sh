#!/usr/bin/env bash
# The smoke campaign on a real SLURM, started here for it and stopped afterwards. Only as root on Debian; elsewhere it says so and passes.
set -euo pipefail
cd "$(dirname "$0")/../.."
skip() {
    echo "test-slurm SKIPPED, nothing was tested: $1."
    exit 0
}
[ "$(id -u)" = 0 ] || skip "it needs root, to start SLURM's daemons"
command -v apt-get >/dev/null && [ -e /etc/debian_version ] || skip "it installs Debian's packages, and this is no Debian"
[ ! -e /etc/slurm/slurm.conf ] || skip "this machine has a SLURM already (/etc/slurm/slurm.conf)"
if ! command -v slurmctld slurmd sbatch munged >/dev/null; then
    packages="slurmctld slurmd slurm-client munge"
    (apt-get update && DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends $packages) >/dev/null 2>&1 ||
        skip "apt-get could not install $packages"
fi
folder=$(mktemp -d)
stop() {
    tests/slurm/cluster.sh stop "$folder/slurm"
    rm -rf "$folder"
}
trap stop EXIT
tests/slurm/cluster.sh start "$folder/slurm"
SLURM_CONF="$folder/slurm/slurm.conf" TMPDIR="$folder" .venv/bin/pytest -v --durations=0 tests/slurm/on_slurm.py
