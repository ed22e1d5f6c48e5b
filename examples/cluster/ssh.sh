#!/bin/bash
# Run a study on machines that are reached with SSH and that share a file system.
set -euo pipefail

HOSTS="${HOSTS:-node1 node2 node3}"
WORKERS_PER_HOST="${WORKERS_PER_HOST:-16}"
# The conditions of the study and their options.
STUDY="${STUDY:-evo/A evo+self-taught/A --runs 300}"
# The folder with the programs of baldwinlab, on all machines.
BIN="${BIN:-$HOME/baldwinlab/bin}"
OUT="${OUT:-$HOME/studies/foragers}"
# An address of this machine that all machines can reach.
ADDRESS="${ADDRESS:-$(hostname -f)}"
PORT="${PORT:-8786}"

trap 'kill $(jobs -p) 2>/dev/null' EXIT
"$BIN/dask" scheduler --host "$ADDRESS" --port "$PORT" --no-dashboard &
for host in $HOSTS; do
  # With a terminal (-tt), the worker ends when the connection ends.
  ssh -tt "$host" "$BIN/dask" worker "tcp://$ADDRESS:$PORT" --nworkers "$WORKERS_PER_HOST" \
    --nthreads 1 --no-dashboard --death-timeout 60 </dev/null &
done

# The words of STUDY are separate arguments.
# shellcheck disable=SC2086
"$BIN/baldwinlab" run $STUDY --executor "dask:tcp://$ADDRESS:$PORT" --out "$OUT"
"$BIN/baldwinlab" report "$OUT"
