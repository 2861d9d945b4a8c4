#!/bin/sh
#SBATCH --job-name=alhazen
#SBATCH --requeue
#SBATCH --open-mode=append
# Renders a scene in as many parts as the job array has tasks, and merges them:
#
#   sbatch --array=1-8 --requeue scripts/slurm/array.sh SCENE OUTPUT.exr [options of alhazen render]
#
# Parts and checkpoints lie in OUTPUT.parts, which all nodes must see. A task that is requeued goes on from
# its last checkpoint; one that had finished ends at once. ALHAZEN names the program where it is not in PATH.
set -eu

scene=$1 output=$2
shift 2
count=$SLURM_ARRAY_TASK_COUNT
number=$((SLURM_ARRAY_TASK_ID - SLURM_ARRAY_TASK_MIN + 1))
alhazen=${ALHAZEN:-alhazen}
parts=${output%.exr}.parts
mkdir -p "$parts"

[ -e "$parts/$number.exr" ] ||
    "$alhazen" render "$scene" "$@" --part "$number/$count" --resume --threads "${SLURM_CPUS_PER_TASK:-1}" \
        -o "$parts/$number.exr"

# Whoever sees all parts merges. Two that see them at once write the same bytes.
set --
i=1
while [ "$i" -le "$count" ]; do
    [ -e "$parts/$i.exr" ] || exit 0
    set -- "$@" "$parts/$i.exr"
    i=$((i + 1))
done
"$alhazen" merge "$@" -o "$output"
