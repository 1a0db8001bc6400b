#!/bin/sh
# Shows a campaign: two machines, one maze, two seeds, on all cores of this computer; then the same runs on a
# dask.distributed cluster (here of one worker; `pip install "maze-machine[cluster]"`). The results are the same, byte for byte.
#
# $ sh campaign.sh
# > 100.0%
set -eu

maze-machine sweep --machines ../01_smallest/smallest.maze-machine,../05_variables/variables.maze-machine \
    --mazes ../straight.maze --seeds 2 --out here.jsonl

command -v dask >/dev/null || exit 0

address=tcp://127.0.0.1:${PORT:-8786}
dask scheduler --host 127.0.0.1 --port "${PORT:-8786}" --no-dashboard 2>scheduler.log &
scheduler=$!
dask worker "$address" --host 127.0.0.1 --nthreads 1 --no-dashboard 2>worker.log &
worker=$!
trap 'kill $scheduler $worker; wait' EXIT

maze-machine sweep --machines ../01_smallest/smallest.maze-machine,../05_variables/variables.maze-machine \
    --mazes ../straight.maze --seeds 2 --out cluster.jsonl --scheduler "$address"
cmp here.jsonl cluster.jsonl
