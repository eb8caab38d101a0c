#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The whole forklift closed in a loop, in real time: a simulated truck and its sensors behind their wires (S300
# telegrams on a pseudo-terminal, camera in the network, CAN by an SLCAN adapter), SLAM and drive as processes of their
# own that talk over TCP, and places to go to. Takes the map of tools/demo.sh, which runs first when it is not there.
set -euo pipefail
cd "$(dirname "$0")/.."

if [[ ! -s build/demo/hall/manifest.json ]]; then
    tools/demo.sh
fi
program=$PWD/build/release/tools/hybrid-slam
out=build/demo
truck=127.0.0.1:${PORT:-$((20000 + RANDOM % 20000))}
rm -rf "$out/sim" "$out/run"

children=()
trap 'kill -INT "${children[@]}" 2>/dev/null || true; wait' EXIT

# Kidnapped to the middle of the hall: nobody tells SLAM where the truck stands.
"$program" simulate config/worlds/thesis_hall.yaml --serve "$out/sim" --start=0,1.6,0 &
children+=($!)
for _ in {1..100}; do
    [[ -s $out/sim/endpoints.json ]] && break
    sleep 0.1
done
camera=$(sed -n 's/.*"camera": "\(.*\)".*/\1/p' "$out/sim/endpoints.json")

"$program" localize "$out/hall" --live --lidar "$out/sim/s300" --camera "$camera" --publish "tcp://$truck" &
children+=($!)
"$program" drive --map "$out/hall" --can "slcan:$out/sim/can" --listen "$truck" --out "$out/run" &
children+=($!)
sleep 1

# The waypoints of the thesis's section 4.4, in the map's frame, which begins where the mapping drive began.
read -r first second < <(awk 'NR == 1 {
    heading = 2 * atan2($7, $8); c = cos(heading); s = sin(heading)
    split("1.30 -0.15 -2.40 -1.60", at, " ")
    for (i = 1; i < 4; i += 2) {
        x = at[i] - $2; y = at[i + 1] - $3
        printf "%.3f,%.3f ", c * x + s * y, c * y - s * x
    }
    print ""
}' "$out/drive/truth.tum")
timeout 180 "$program" goto "$truck" "$first" "$second" --watch --timeout 30

kill -INT "${children[@]}"
wait "${children[@]}" 2>/dev/null || true
children=()
trap - EXIT
echo "The way that was driven is in $out/run/drive.png, the truth in $out/sim/truth.tum, the frames in $out/sim/bus.log."
tail -n 1 "$out/sim/truth.tum" | awk '{
    printf "The truck stands at %.3f, %.3f in the world: %.1f cm from the second waypoint (-2.40, -1.60).\n", $2, $3,
        100 * sqrt(($2 + 2.40) ^ 2 + ($3 + 1.60) ^ 2)
}'
