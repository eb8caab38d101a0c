#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Installs what is missing, builds the program, drives a simulated vehicle through a hall, makes a map of
# what its lidar saw and says how far the map is off.
set -euo pipefail
cd "$(dirname "$0")/.."

tools/install_packages.sh
cmake --preset release
cmake --build --preset release --target hybrid-slam

program=build/release/tools/hybrid-slam
out=build/demo
mkdir -p "$out"
"$program" simulate config/worlds/hall.yaml --out "$out/hall.clf" --seed 1
"$program" map "$out/hall.clf" --out "$out/hall_map"
"$program" evaluate "$out/hall_map/trajectory.tum" --truth "$out/hall.truth.tum"

echo "The map is in $out/hall_map; look at map.png and graph.png there."
