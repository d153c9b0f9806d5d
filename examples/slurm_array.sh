#!/bin/sh
# An array of 20 tasks, each a twentieth of a campaign: sbatch slurm_array.sh SPEC.toml FOLDER
# The folder must be one that all nodes see. A task takes a whole node and starts omnidyn once; its processes share that
# node. Any array will do, such as 0-9 or 5-50:5. A task that is requeued goes on where it was.
#SBATCH --job-name=sweep
#SBATCH --array=1-20
#SBATCH --nodes=1
#SBATCH --exclusive
#SBATCH --time=01:00:00
#SBATCH --requeue

FIRST="${SLURM_ARRAY_TASK_MIN:-1}"
PART=$(( (${SLURM_ARRAY_TASK_ID:-1} - FIRST) / ${SLURM_ARRAY_TASK_STEP:-1} + 1 ))
exec omnidyn sweep "$1" -o "$2" --workers "${SLURM_CPUS_ON_NODE:-1}" --shard "$PART/${SLURM_ARRAY_TASK_COUNT:-1}"
