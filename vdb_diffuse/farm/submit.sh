#!/usr/bin/env bash
# Submits vdb_diffuse.sbatch with as many tasks as the frames need:
#
#     CHUNK=8 AT_ONCE=10 submit.sh 1 240 'cloud.####.vdb' -o 'lit.####.vdb' --sun 1,0.5,-1
#
# SBATCH_... variables and SBATCH_FLAGS="--partition=long --cpus-per-task=16 --mem=32G" go to sbatch.
set -eu
export FIRST=$1 LAST=$2 STEP=${STEP:-1} CHUNK=${CHUNK:-8}
shift 2
tasks=$(((LAST - FIRST) / (STEP * CHUNK) + 1))
# shellcheck disable=SC2086 # flags are several words
exec sbatch --export=ALL ${SBATCH_FLAGS:-} --array="0-$((tasks - 1))${AT_ONCE:+%$AT_ONCE}" \
  "$(dirname "$0")/vdb_diffuse.sbatch" "$@"
