#!/usr/bin/env bash
# Many photo sets, one a task of a job array; each goes on where it was if it is requeued.
#
#     find archive -name photoset.toml -printf '%h\n' | sort > sets.txt
#     sbatch --array=1-$(wc -l < sets.txt)%50 packaging/slurm-many-sets.sh sets.txt library
#
# A result lies in the library as its set lies below the folder that sbatch is called in; of a set elsewhere, as below /.
# Exit status 3 (written, but not to be trusted) is no failure of the task: the coefficient file and the report say so.
#SBATCH --job-name=photogonio
#SBATCH --cpus-per-task=2
#SBATCH --mem=3G
#SBATCH --time=01:00:00
#SBATCH --requeue
set -euo pipefail
folder=$(sed -n "${SLURM_ARRAY_TASK_ID}p" "$1")
[ -n "$folder" ] || { echo "line $SLURM_ARRAY_TASK_ID of $1 names no set" >&2; exit 2; }
place=$(realpath --no-symlinks --relative-base="$PWD" -- "$folder") # without "..", which would lead out of the library
[ "$place" != . ] || place=$(basename "$PWD")
mkdir -p "$2"
export PHOTOGONIO_CACHE=${PHOTOGONIO_CACHE:-$2/.photogonio-cache}
export PHOTOGONIO_CACHE_SIZE=${PHOTOGONIO_CACHE_SIZE:-100GB}
photogonio process "$folder" -o "$2/${place#/}" --workers "$SLURM_CPUS_PER_TASK" --quiet || [ $? -eq 3 ]
