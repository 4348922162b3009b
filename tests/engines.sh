#!/usr/bin/env bash
# Submits a sequence to real schedulers on this machine, ends a part of it in the middle, and compares with one run. Not a part of
# `cargo test`: as root on Debian 12 or Ubuntu 24.04, after
#   apt-get install slurmctld slurmd slurm-client munge
#   python3 -m venv venv && venv/bin/pip install openjd-cli hyperqueue     (PATH=$PWD/venv/bin:$PATH)
#   tests/engines.sh [slurm|hyperqueue|openjd]...
set -euo pipefail
cd "$(dirname "$0")/.."
cargo build --quiet --locked
meniscus=$PWD/target/debug/meniscus
work=$(mktemp -d)
end() {
  kill $(cat "$work"/*.pid 2>/dev/null) 2>/dev/null || true
  sleep 1
  rm -rf "$work"
}
trap end EXIT
cd "$work"
mkdir frames
python3 - <<'PYTHON'
for frame in range(12):
    with open(f"frames/p{frame}.csv", "w") as file:
        print("x,y,z", file=file)
        for i in range(20 ** 3):
            print(f"{0.1 * (i % 20) + 0.05 * frame},{0.1 * (i // 20 % 20)},{0.1 * (i // 400)}", file=file)
PYTHON
sequence() { echo sequence 'frames/*.csv' --size 320x240 --supersample 2 --radius 0.05 --eye 5,3,-4 --target 1,1,1 --absorption 0.4,0.2,0.1 "$@"; }
"$meniscus" $(sequence -o 'whole/##.png') 2> whole.log

# ENGINE: hands it over, calls what interrupts it, and waits for the film that the last task makes.
submit() {
  rm -rf out film.gif
  "$meniscus" submit --engine "$1" -o "job-$1" --tasks 3 "${@:2}" -- $(sequence -o 'out/##.png' -o film.gif)
}
until_there() { for ((i = 0; i < 4000; i++)); do [ ! -e "$1" ] || return 0; sleep 0.1; done; echo "no $1" >&2; cat ./*.log job-*/*.log >&2; return 1; }
# A process and all that came of it.
family() { local child; echo "$1"; for child in $(pgrep -P "$1"); do family "$child"; done; }
# Ended hard while it works, with all its tasks, and started again.
interrupted() {
  "$@" > first.log 2>&1 &
  local running=$!
  until_there out/01.png
  kill -KILL $(family "$running") 2> /dev/null || true
  wait "$running" 2> /dev/null || true
  [ ! -e film.gif ] || { echo "it was over before it was ended" >&2; return 1; }
  "$@" > second.log 2>&1 || { cat second.log >&2; return 1; }
}
compare() {
  until_there film.gif
  diff -r whole out
  # What parts finished that were not ended in the middle; the rest is theirs that were.
  local made
  made=$(cat "$@" | grep -o 'wrote [0-9]* pictures' | awk '{sum += $2} END {print sum}')
  echo "the same bits; pictures that parts finished: ${made:-0} of 12"
}

slurm() {
  local host; host=$(hostname -s)
  mkdir -p slurm/{state,spool,munge}
  chmod 700 slurm/munge
  dd if=/dev/urandom of=slurm/munge/key bs=1k count=1 status=none
  chmod 400 slurm/munge/key
  munged --force --key-file="$work/slurm/munge/key" --socket="$work/slurm/munge/socket" --pid-file="$work/munged.pid" \
    --log-file="$work/slurm/munge/log" --seed-file="$work/slurm/munge/seed" 2> /dev/null
  cat > slurm/slurm.conf <<CONF
ClusterName=test
SlurmctldHost=$host
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket=$work/slurm/munge/socket
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
StateSaveLocation=$work/slurm/state
SlurmdSpoolDir=$work/slurm/spool
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/slurmd.pid
SlurmctldLogFile=$work/slurm/slurmctld.log
SlurmdLogFile=$work/slurm/slurmd.log
SchedulerParameters=sched_interval=2
NodeName=$host CPUs=$(nproc) State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES State=UP
CONF
  export SLURM_CONF=$work/slurm/slurm.conf
  slurmctld
  slurmd
  for ((i = 0; i < 50; i++)); do sinfo -h -o %T 2> /dev/null | grep -q idle && break; sleep 0.2; done
  submit slurm --run
  # A part is taken away in the middle, and queued again.
  until_there out/00.png
  scontrol requeue "$(squeue -h -r -o %i -n meniscus-parts -t R | head -1)"
  compare job-slurm/part-*.log
  sinfo --version
}

openjd() {
  submit openjd
  interrupted ./job-openjd/submit.sh
  compare first.log second.log
  command openjd --version
}

# Its local cluster takes the tasks of the job file.
cluster() {
  python3 - <<'PYTHON'
import tomllib
from hyperqueue import Job, LocalCluster
from hyperqueue.cluster import WorkerConfig
tasks = tomllib.load(open("job-hyperqueue/job.toml", "rb"))["task"]
with LocalCluster() as cluster:
    cluster.start_worker(WorkerConfig(cores=2))
    job, made = Job(), {}
    for task in tasks:
        made[task["id"]] = job.program(
            task["command"], cwd=task["cwd"], stdout=task["stdout"], stderr=task["stderr"], name=task["name"],
            deps=[made[d] for d in task.get("deps", [])])
    client = cluster.client()
    client.wait_for_jobs([client.submit(job)])
PYTHON
}

hyperqueue() {
  submit hyperqueue
  interrupted cluster
  compare job-hyperqueue/part-*.log
  python3 -c 'import importlib.metadata as m; print("HyperQueue", m.version("hyperqueue"))'
}

for engine in "${@:-slurm}"; do
  echo "== $engine"
  "$engine"
done
