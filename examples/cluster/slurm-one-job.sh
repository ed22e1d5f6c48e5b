#!/bin/bash
#SBATCH --job-name=baldwinlab
#SBATCH --nodes=1
#SBATCH --ntasks=1
#SBATCH --cpus-per-task=32
#SBATCH --mem=16G
#SBATCH --time=02:00:00
#SBATCH --output=baldwinlab-%j.log
## Uncomment and change the lines that your site needs.
##SBATCH --account=PROJECT
##SBATCH --partition=normal
##SBATCH --qos=normal
set -e
export BALDWINLAB_CACHE="$HOME/.cache/baldwinlab"
OUT="$HOME/studies/foragers"
source "$HOME/baldwinlab/bin/activate"
baldwinlab run evo/A evo+self-taught/A --runs 300 --workers "$SLURM_CPUS_PER_TASK" --out "$OUT"
baldwinlab report "$OUT"
