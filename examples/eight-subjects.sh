#!/bin/sh
# Eight simulated naive subjects of the thesis's balance experiment (3.2.5): four sequential, four
# simultaneous, 20 rollouts of practice, 100 of teaching, and the robot alone from 100 starts.
#
#   examples/eight-subjects.sh [LOGS] [PROFILE]
#   coadapt report LOGS --out report.html
set -eu
logs=${1:-logs/eight}
profile=${2:-balance}
# Installed, or as it is here.
coadapt=${COADAPT:-$(command -v coadapt || echo cargo run --quiet --release --)}
for number in 1 2 3 4 5 6 7 8; do
    if [ "$number" -le 4 ]; then mode=sequential; else mode=simultaneous; fi
    # shellcheck disable=SC2086 # more than one word
    $coadapt run "$profile" --headless --operator simulated:naive \
        --subject "S0$number" --mode "$mode" --seed "$number" --logs "$logs"
done
