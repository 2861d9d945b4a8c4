#!/bin/sh
# Tries array.sh on a Slurm of one node that it sets up: 8 parts, of which one is killed and requeued, merged,
# and compared with the picture in one piece, byte by byte. Needs root; the daemons end with it.
#
#   scripts/slurm/try.sh [PROGRAM]      target/release/alhazen where not given
set -eu

root=$(CDPATH='' cd -- "$(dirname -- "$0")/../.." && pwd)
alhazen=$(realpath "${1:-$root/target/release/alhazen}")
if ! command -v slurmctld >/dev/null || ! command -v munged >/dev/null; then
    apt-get update -qq
    DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends slurm-wlm munge >/dev/null
fi

folder=$(mktemp -d)
host=$(hostname -s)
export SLURM_CONF=$folder/slurm.conf
cpus=$(nproc)
mkdir -p "$folder/state" "$folder/spool"
cat >"$SLURM_CONF" <<CONF
ClusterName=try
SlurmctldHost=$host(127.0.0.1)
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket=$folder/munge.socket
CredType=cred/munge
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/spool
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdPidFile=$folder/slurmd.pid
SlurmctldLogFile=$folder/slurmctld.log
SlurmdLogFile=$folder/slurmd.log
SlurmctldPort=16817
SlurmdPort=16818
KillWait=2
ReturnToService=2
MpiDefault=none
NodeName=$host NodeAddr=127.0.0.1 CPUs=$cpus State=UNKNOWN
PartitionName=all Nodes=$host Default=YES MaxTime=INFINITE State=UP
CONF
# Nothing on the system changes: the key is one of its own.
dd if=/dev/urandom of="$folder/munge.key" bs=64 count=1 2>/dev/null
chmod 600 "$folder/munge.key"
end() {
    for daemon in slurmd slurmctld munged; do
        [ ! -s "$folder/$daemon.pid" ] || kill "$(cat "$folder/$daemon.pid")" 2>/dev/null || true
    done
    sleep 1
    rm -rf "$folder"
}
trap end EXIT
munged --force --socket="$folder/munge.socket" --key-file="$folder/munge.key" --pid-file="$folder/munged.pid" \
    --log-file="$folder/munged.log" --seed-file="$folder/munge.seed"
slurmctld
slurmd

scene=$root/scenes/showcase.toml
options='--size 640x360 --samples 512 --quiet'
# shellcheck disable=SC2086  # several words
"$alhazen" render "$scene" $options -o "$folder/whole.exr"

export ALHAZEN=$alhazen
# shellcheck disable=SC2086
job=$(sbatch --parsable --array=1-8 --requeue --output="$folder/%a.log" "$root/scripts/slurm/array.sh" \
    "$scene" "$folder/picture.exr" $options --checkpoint 0.1s)
echo "job $job of 8 parts"

# Once a part has a checkpoint, it is killed and requeued.
killed=
tries=0
while [ -z "$killed" ]; do
    for file in "$folder"/picture.parts/*.checkpoint.exr; do
        [ -e "$file" ] || continue
        number=$(basename "$file" .checkpoint.exr)
        if scontrol requeue "${job}_$number"; then
            killed=$number
            echo "part $number was killed and requeued"
            break
        fi
    done
    tries=$((tries + 1))
    [ "$tries" -lt 600 ] || { echo 'no checkpoint came'; exit 1; }
    sleep 0.1
done
# A requeued job waits for a while before it is eligible again.
while squeue --noheader --job "$job" 2>/dev/null | grep -q .; do
    scontrol release "${job}_$killed" >/dev/null 2>&1 || true
    scontrol update JobId="${job}_$killed" StartTime=now >/dev/null 2>&1 || true
    tries=$((tries + 1))
    [ "$tries" -lt 1800 ] || { squeue; cat "$folder/slurmctld.log"; exit 1; }
    sleep 0.2
done
cat "$folder/$killed.log"
if cmp "$folder/whole.exr" "$folder/picture.exr"; then
    echo 'the merged picture is the same, byte by byte'
else
    tail -n 5 "$folder"/*.log
    exit 1
fi
