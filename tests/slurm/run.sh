#!/usr/bin/env bash
# A one-node Slurm in this container, and a small study as an array of jobs on it: the same results
# as without Slurm, byte for byte.
#
#   apt-get install -y slurm-wlm munge
#   cargo build --release
#   tests/slurm/run.sh target/release/coadapt
#
# Runs as root in a plain container (no cgroups, no systemd). Everything that it starts or writes
# is in a folder of its own, and is gone at its end.
set -euo pipefail

coadapt="$(realpath "${1:?give the path of coadapt}")"
for program in munged slurmctld slurmd sbatch squeue; do
    command -v "$program" >/dev/null || { echo "no $program: apt-get install slurm-wlm munge" >&2; exit 2; }
done
[ "$(id -u)" = 0 ] || { echo "munged and slurmd want to be started by root" >&2; exit 2; }

desk="$(mktemp -d)"
chmod 755 "$desk"
pids=()
finish() {
    # Only what was started here.
    for pid in "${pids[@]}"; do kill "$pid" 2>/dev/null || true; done
    wait 2>/dev/null || true
    rm -rf "$desk"
}
trap finish EXIT

echo "== munge on a socket of its own"
install -d -o munge -g munge -m 755 "$desk/munge"
head -c 1024 /dev/urandom >"$desk/munge/munge.key"
chown munge:munge "$desk/munge/munge.key"
chmod 400 "$desk/munge/munge.key"
setpriv --reuid munge --regid munge --clear-groups munged --foreground --force \
    --socket "$desk/munge/socket" --key-file "$desk/munge/munge.key" \
    --log-file "$desk/munge/log" --pid-file "$desk/munge/pid" --seed-file "$desk/munge/seed" &
pids+=($!)

echo "== slurmctld and slurmd on 127.0.0.1"
cores="$(nproc)"
install -d -m 755 "$desk/slurm" "$desk/slurm/state" "$desk/slurm/spool"
cat >"$desk/slurm/slurm.conf" <<CONF
ClusterName=coadapt
SlurmctldHost=$(hostname -s)(127.0.0.1)
SlurmctldPort=26817
SlurmdPort=26818
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket=$desk/munge/socket
CredType=cred/munge
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core_Memory
StateSaveLocation=$desk/slurm/state
SlurmdSpoolDir=$desk/slurm/spool
SlurmctldPidFile=$desk/slurm/slurmctld.pid
SlurmdPidFile=$desk/slurm/slurmd.pid
SlurmctldLogFile=$desk/slurm/slurmctld.log
SlurmdLogFile=$desk/slurm/slurmd.log
ReturnToService=2
MpiDefault=none
NodeName=$(hostname -s) NodeAddr=127.0.0.1 CPUs=$cores RealMemory=1024 State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
CONF
export SLURM_CONF="$desk/slurm/slurm.conf"
touch "$desk/slurm/cgroup.conf"
slurmctld -D -f "$SLURM_CONF" >"$desk/slurm/ctld.out" 2>&1 &
pids+=($!)
slurmd -D -f "$SLURM_CONF" -N "$(hostname -s)" >"$desk/slurm/d.out" 2>&1 &
pids+=($!)
for _ in $(seq 60); do
    state="$(sinfo --noheader --format=%t 2>/dev/null || true)"
    [ "$state" = idle ] && break
    sleep 1
done
sinfo
if [ "$state" != idle ]; then
    tail -n 20 "$desk"/slurm/*.log "$desk"/slurm/*.out "$desk/munge/log" >&2
    exit 1
fi

echo "== a small study: on its own, then as an array of four jobs"
cd "$desk"
cat >small.ron <<'RON'
(
    profile: "balance",
    sets: { "session.introduction_rollouts": 2, "session.main_rollouts": 10 },
    arms: [(name: "sequential", mode: sequential), (name: "simultaneous", mode: simultaneous)],
    operators: ["simulated:naive", "simulated:expert"],
    seeds: (first: 1, count: 3),
    starts: [(name: "grid", count: 10)],
    references: [zero],
)
RON
"$coadapt" study ./small.ron --out whole >/dev/null
"$coadapt" study ./small.ron --out small --slurm=4
cat small/slurm.sh
sbatch --wait --output "$desk/job-%A-%a.out" small/slurm.sh
cat "$desk"/job-*.out
ls -d small-*-of-4
"$coadapt" study merge small-*-of-4 --out joined >joined.txt
tail -n 20 joined.txt
for file in results.csv summary.json figures/checkpoints.csv figures/cells.csv; do
    cmp "whole/$file" "joined/$file"
done
echo "== the array's results are those of one machine, byte for byte"
