#!/bin/bash
set -e
export BALDWINLAB_CACHE="$HOME/.cache/baldwinlab"
OUT="$HOME/studies/foragers"
source "$HOME/baldwinlab/bin/activate"
baldwinlab run evo/A evo+self-taught/A --runs 3000 --executor slurm --workers 20 --out "$OUT"
baldwinlab report "$OUT"
