// SPDX-License-Identifier: Apache-2.0
#include <exception>

#include "hybrid_slam/core/stopwatch.hpp"
#include "lidar_watch.hpp"
#include "live_state.hpp"

namespace hybrid_slam {
namespace {

constexpr double kReadTimeout = 0.1;  // seconds, also the longest that stopping waits for a read

/// Until the device is gone (Error), its file has ended or `state` says stop.
void read_lidar(LiveState& state, ByteSource& source) {
    LidarWatch watch(state.robot.lidar, state.options, steady_seconds());
    state.set_lidar(watch.state(), watch.detail());
    std::vector<std::uint8_t> bytes;
    while (!state.stopping()) {
        source.read(bytes, kReadTimeout);
        const double arrival = state.options.now();
        const DeviceState before = watch.state();
        watch.take(bytes, steady_seconds());
        if (watch.state() != before) {
            state.set_lidar(watch.state(), watch.detail());
        }
        if (!bytes.empty()) {
            state.push(LidarBytes{arrival, std::move(bytes)});
            bytes = {};
        }
        if (source.ended()) {
            state.end_lidar();
        }
    }
}

}  // namespace

void run_lidar(LiveState& state) {
    while (!state.stopping()) {
        try {
            const std::unique_ptr<ByteSource> source = state.options.open_lidar(state.robot.lidar);
            state.lidar_opened();
            read_lidar(state, *source);
        } catch (const std::exception& error) {
            state.set_lidar(DeviceState::kConnecting, error.what());
        }
        state.wait_for_stop(state.options.retry_every);
    }
}

}  // namespace hybrid_slam
