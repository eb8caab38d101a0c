#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# check.sh BUILD_DIR: installs that build into a fresh prefix and uses it as strangers would.
set -euo pipefail
package_tests=$(cd "$(dirname "$0")" && pwd)
build=$1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

cmake --install "$build" --prefix "$work/prefix" >/dev/null

for project in consumer core_only subproject; do
    echo "--- $project"
    cmake -S "$package_tests/$project" -B "$work/$project" -G Ninja -DCMAKE_PREFIX_PATH="$work/prefix" \
        -Wno-dev --log-level=WARNING
    targets=(all)
    if [[ $project == subproject ]]; then
        targets=(use_core)
    fi
    cmake --build "$work/$project" --target "${targets[@]}"
    (cd "$work/$project" && ctest --output-on-failure --no-tests=error)
done

program=$work/prefix/bin/hybrid-slam
if [[ -x $program ]]; then
    "$program" --help >/dev/null
fi
