#!/usr/bin/env bash
# One large photo set on several nodes: a dask scheduler and workers on all of them, photogonio on the first.
#
#     sbatch packaging/slurm-one-set.sh my-set my-set-brdf
#
# SET and OUT lie in a folder that all nodes see; photos are then read where they are. photogonio[cluster] of one version
# must be in the same environment on all nodes. PHOTOGONIO_CACHE in the shared folder lets a job that was requeued go on.
# Exit status 3 (written, but not to be trusted) is no failure of the job: the coefficient file and the report say so.
#SBATCH --job-name=photogonio
#SBATCH --nodes=4
#SBATCH --ntasks-per-node=1
#SBATCH --cpus-per-task=16
#SBATCH --mem-per-cpu=1G
#SBATCH --time=02:00:00
#SBATCH --requeue
set -euo pipefail
set_folder=$1 out=$2
host=$(hostname)
port=$((20000 + SLURM_JOB_ID % 20000))
export PHOTOGONIO_CACHE=${PHOTOGONIO_CACHE:-$(dirname "$out")/photogonio-cache}
export PHOTOGONIO_CACHE_SIZE=${PHOTOGONIO_CACHE_SIZE:-100GB}
export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 # a thread a photo
# else dask looks 100 times a second at what each worker does, and 50 times at itself
export DASK_DISTRIBUTED__WORKER__PROFILE__ENABLED=False DASK_DISTRIBUTED__ADMIN__TICK__INTERVAL=1s

dask scheduler --host "$host" --port "$port" --no-dashboard &
scheduler=$!
trap 'kill $scheduler 2>/dev/null || true' EXIT
for _ in {1..120}; do # until the scheduler listens
  (exec 3<>"/dev/tcp/$host/$port") 2>/dev/null && break
  sleep 0.5
done
# --death-timeout: workers end by themselves when the scheduler is gone
srun dask worker "$host:$port" --nworkers 1 --nthreads "$SLURM_CPUS_PER_TASK" --no-dashboard --death-timeout 60 &

photogonio process "$set_folder" -o "$out" --executor "dask://$host:$port" || [ $? -eq 3 ]
