#!/bin/sh
# An array of 20 tasks, each a twentieth of a campaign: sbatch slurm_array.sh SPEC.toml FOLDER
# The folder must be one that all nodes see. A task that is requeued goes on where it was.
#SBATCH --job-name=sweep
#SBATCH --array=1-20
#SBATCH --cpus-per-task=4
#SBATCH --time=01:00:00
#SBATCH --requeue

exec omnidyn sweep "$1" -o "$2" --workers "${SLURM_CPUS_PER_TASK:-1}" \
    --shard "${SLURM_ARRAY_TASK_ID:-1}/${SLURM_ARRAY_TASK_COUNT:-1}"
