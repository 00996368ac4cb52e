#!/usr/bin/env bash
# cluster.sh start|stop FOLDER: a SLURM of two virtual nodes on this machine, as root; all its files lie in FOLDER.
# Needs Debian's slurmctld, slurmd, slurm-client and munge.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
action=$1
mkdir -p "$2"
folder=$(cd "$2" && pwd)
# Where SLURM looks without SLURM_CONF: inside a job, Snakemake drops all SLURM_ variables before it starts the job's step.
link=/etc/slurm/slurm.conf

start() {
    if [ -e "$link" ] || [ -L "$link" ]; then
        echo "$link exists: this machine has a SLURM of its own, or a test did not end." >&2
        exit 2
    fi
    mkdir -p "$folder"/{munge,state,spool/n1,spool/n2} "$(dirname "$link")"
    chmod 755 "$folder"
    chmod 700 "$folder/munge"
    sed -e "s#@FOLDER@#$folder#g" -e "s#@HOST@#$(hostname -s)#g" "$here/slurm.conf.in" >"$folder/slurm.conf"
    ln -s "$folder/slurm.conf" "$link"
    dd if=/dev/urandom of="$folder/munge/key" bs=1024 count=1 status=none
    chmod 600 "$folder/munge/key"
    munged --force --key-file="$folder/munge/key" --socket="$folder/munge/socket" --pid-file="$folder/munge/munged.pid" \
        --log-file="$folder/munge/munged.log" --seed-file="$folder/munge/seed" 2>"$folder/munge/start.log"
    slurmctld -c -f "$folder/slurm.conf"
    for node in n1 n2; do
        slurmd -N "$node" -f "$folder/slurm.conf"
    done
    for _ in $(seq 120); do
        if [ "$(sinfo --noheader --Node --format %t 2>/dev/null | grep -c idle)" = 2 ]; then
            return
        fi
        sleep 0.25
    done
    tail -n 20 "$folder"/*.log >&2
    echo "SLURM did not start." >&2
    exit 1
}

# Ends what start began, by its process ids, jobs first; does nothing where nothing runs.
stop() {
    if [ "$(readlink "$link" || true)" = "$folder/slurm.conf" ]; then
        timeout 10 scancel --user=root --full --signal=KILL 2>/dev/null || true
        sleep 1
    fi
    for file in "$folder"/slurmd-n1.pid "$folder"/slurmd-n2.pid "$folder"/slurmctld.pid "$folder"/munge/munged.pid; do
        [ -s "$file" ] || continue
        pid=$(cat "$file")
        kill "$pid" 2>/dev/null || continue
        for _ in $(seq 100); do
            kill -0 "$pid" 2>/dev/null || break
            sleep 0.1
        done
        kill -9 "$pid" 2>/dev/null || true
    done
    if [ "$(readlink "$link" || true)" = "$folder/slurm.conf" ]; then
        rm "$link"
    fi
}

"$action"
