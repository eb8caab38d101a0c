#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Installs what is missing, builds the program, drives a simulated forklift through the thesis's hall, its
# scanner speaking S300 telegrams and its camera giving images, makes a map of that recording and says how
# far the map is off.
set -euo pipefail
cd "$(dirname "$0")/.."

tools/install_packages.sh
cmake --preset release
cmake --build --preset release --target hybrid-slam

program=build/release/tools/hybrid-slam
out=build/demo
rm -rf "$out/drive"
mkdir -p "$out"
"$program" simulate config/worlds/thesis_hall.yaml --path figure_eight --out "$out/drive" --seed 1 --set distance=40
"$program" info "$out/drive"
"$program" map "$out/drive" --out "$out/hall"
"$program" evaluate "$out/hall/trajectory.tum" --truth "$out/drive/truth.tum" --align first

echo "The recording is in $out/drive (look at info.png), the map in $out/hall (map.png and graph.png)."
