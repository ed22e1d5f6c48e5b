#!/bin/sh
# Does `--executor slurm` work on a real Slurm? Installs one from the distribution's packages where there is none, starts it with
# this machine as its only node, on loopback, runs the tests that need it, and stops it again. Needs root, and a machine that
# may be changed, such as a container.   usage: scripts/check_slurm.sh [PYTHON]
set -eu
python=${1:-python3}
cd "$(dirname "$0")/.."
command -v slurmctld >/dev/null && command -v munged >/dev/null || {
    apt-get update -qq
    DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends slurm-wlm munge >/dev/null
}
place=$(mktemp -d)
trap 'scancel --user=root 2>/dev/null || true
for file in slurmd slurmctld munged; do kill "$(cat "$place/$file.pid")" 2>/dev/null || true; done' EXIT
trap 'exit 1' INT TERM

dd if=/dev/urandom of="$place/munge.key" bs=128 count=1 2>/dev/null
chmod 600 "$place/munge.key"
munged --force --key-file="$place/munge.key" --socket="$place/munge.socket" --pid-file="$place/munged.pid" \
    --log-file="$place/munged.log" --seed-file="$place/munge.seed"

export SLURM_CONF="$place/slurm.conf"
cat >"$SLURM_CONF" <<END
ClusterName=check
SlurmctldHost=$(hostname -s)(127.0.0.1)
SlurmctldPort=16817
SlurmdPort=16818
CommunicationParameters=NoInAddrAny
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket=$place/munge.socket
StateSaveLocation=$place/state
SlurmdSpoolDir=$place/spool
SlurmctldPidFile=$place/slurmctld.pid
SlurmdPidFile=$place/slurmd.pid
SlurmctldLogFile=$place/slurmctld.log
SlurmdLogFile=$place/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
ReturnToService=2
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
$(slurmd -C | head -n 1) NodeAddr=127.0.0.1 State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
END
mkdir "$place/state" "$place/spool"
slurmctld
slurmd
for _ in 1 2 3 4 5 6 7 8 9 10; do
    sinfo --noheader --format=%T 2>/dev/null | grep -q idle && break
    sleep 1
done
sinfo || { cat "$place"/*.log; exit 1; }
"$python" -m pytest tests/test_executors.py -k "slurm_jobs" -rsP
