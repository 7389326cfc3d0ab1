#!/usr/bin/env bash
# Bakes a short sequence through vdb_diffuse/farm/ on a Slurm of its own: munged, slurmctld and slurmd on this
# machine, in a temporary folder, ended when it ends. Skipped (status 77) where Slurm is not installed
# (Debian: slurm-wlm, munge) or it may not be started (needs root).
#
#     tests/farm/slurm_test.sh build/vdb_diffuse
set -euo pipefail
program=$(realpath "$1")
farm=$(realpath "$(dirname "$0")/../../vdb_diffuse/farm")
for tool in munged mungekey slurmctld slurmd sbatch squeue scontrol; do
  command -v $tool > /dev/null || { echo "skipped: there is no $tool"; exit 77; }
done
[ "$(id -u)" = 0 ] || { echo "skipped: slurmd needs root"; exit 77; }

work=$(mktemp -d)
services=()
finish() {
  status=$?
  if [ $status -ne 0 ]; then tail -n 20 "$work"/*.log || true; fi
  for service in "${services[@]}"; do kill "$service" 2> /dev/null || true; done
  wait 2> /dev/null || true
  rm -rf "$work"
  exit $status
}
trap finish EXIT
fail() { echo "failed: $*"; exit 1; }

chmod 711 "$work"
mkdir -m 700 "$work/private"
mkdir -m 755 "$work/munge" "$work/state" "$work/spool" "$work/job"
mungekey --create --keyfile="$work/private/key"
munged --foreground --force --key-file="$work/private/key" --socket="$work/munge/socket" \
  --pid-file="$work/private/pid" --seed-file="$work/private/seed" --log-file="$work/munged.log" > /dev/null 2>&1 &
services+=($!)

host=$(hostname -s)
port=$((20000 + RANDOM % 10000))
cat > "$work/slurm.conf" << END
ClusterName=test
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=$port
SlurmdPort=$((port + 1))
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket=$work/munge/socket
CredType=cred/munge
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/slurmd.pid
SlurmctldLogFile=$work/slurmctld.log
SlurmdLogFile=$work/slurmd.log
ProctrackType=proctrack/pgid
TaskPlugin=task/none
SelectType=select/linear
MpiDefault=none
ReturnToService=2
NodeName=$host NodeAddr=127.0.0.1 CPUs=$(nproc) State=UNKNOWN
PartitionName=all Nodes=$host Default=YES MaxTime=INFINITE State=UP
END
export SLURM_CONF=$work/slurm.conf
for _ in $(seq 50); do [ -S "$work/munge/socket" ] && break; sleep 0.1; done
slurmctld -D > /dev/null 2>&1 & services+=($!)
slurmd -D -N "$host" > /dev/null 2>&1 & services+=($!)
for _ in $(seq 100); do
  [ "$(sinfo -h -o %T 2> /dev/null)" = idle ] && break
  sleep 0.3
done
[ "$(sinfo -h -o %T)" = idle ] || fail "the node did not come up"

# Seven frames by threes; of them 4 is not there, and 6 is no volume.
cd "$work/job"
"$program" make sphere -o ball.0001.vdb --voxels 2000 > /dev/null
for frame in 0002 0003 0005 0007; do cp ball.0001.vdb ball.$frame.vdb; done
echo "not a volume" > ball.0006.vdb
export VDB_DIFFUSE=$program CHUNK=3

submit() {  # waits until the array has ended
  SBATCH_FLAGS="--wait --parsable $*" "$farm/submit.sh" 1 7 'ball.####.vdb' -o 'lit.####.vdb' --sun 0,0,-1
}
job=$(submit) && fail "two frames are missing, and the array says that all is well"
echo "$job" | grep -q '^[0-9]' || fail "not submitted: $job"
[ "$(ls vdb_diffuse.*.log | wc -l)" = 3 ] || fail "not three tasks: $(ls)"
for frame in 1 2 3 5 7; do [ -f lit.000$frame.vdb ] || fail "frame $frame is not baked"; done
for frame in 4 6; do [ ! -e lit.000$frame.vdb ] || fail "frame $frame is baked"; done
task=$(ls vdb_diffuse.*.1.log)
grep -q '1 of 3 frames done, not: 4,6' "$task" || fail "the second task says: $(cat "$task")"
[ "$(grep -c '0 of 1 frames done, not: 4' "$task")" = 1 ] || fail "frame 4 was not run once more, alone"
before=$(stat -c %Y lit.0005.vdb)

# The frames are mended: the same submission again does what is missing, and only that.
for frame in 0004 0006; do cp ball.0001.vdb ball.$frame.vdb; done
rm -f vdb_diffuse.*.log
submit > /dev/null || fail "with all frames there: $(cat vdb_diffuse.*.log)"
for frame in 1 2 3 4 5 6 7; do [ -f lit.000$frame.vdb ] || fail "frame $frame is not baked"; done
[ "$(stat -c %Y lit.0005.vdb)" = "$before" ] || fail "frame 5 was baked again"
cat vdb_diffuse.*.log | grep -c 'exists, skipped' | grep -qx 5 || fail "not five frames were skipped"
echo "passed: 7 frames in 3 tasks; 4 and 6 failed, were run once more alone, and were baked by a second submission"
