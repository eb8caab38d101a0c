// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <exception>

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/stopwatch.hpp"
#include "live_state.hpp"

namespace hybrid_slam {
namespace {

constexpr double kReadTimeout = 0.1;  // seconds, also the longest that stopping waits for a read
/// A webcam that hangs often wakes up when it is opened anew; this many stalls long we wait.
constexpr double kReopenAfterStalls = 5.0;

/// Until the device is gone (Error), its files have ended or `state` says stop.
void read_camera(LiveState& state, Capture& capture) {
    const CameraConfig& config = state.robot.camera;
    double last_image = steady_seconds();
    bool streams = false;
    bool stalled = false;
    CameraFrame frame;
    while (!state.stopping() && !capture.ended()) {
        if (capture.read(frame.image, kReadTimeout)) {
            frame.arrival = state.options.now();
            last_image = steady_seconds();
            state.push(std::move(frame));
            frame = {};
            if (!streams) {
                state.camera_streams();
            }
            streams = true;
            stalled = false;
            continue;
        }
        const double without = steady_seconds() - last_image;
        if (without >= kReopenAfterStalls * config.stall_after) {
            throw Error(config.device + ": hangs, opened anew");
        }
        if (without >= config.stall_after && !stalled) {
            state.camera_lost(DeviceState::kSilent, fmt::format("{}: no image for {:g} s",
                                                                config.device, config.stall_after));
            streams = false;
            stalled = true;
        }
    }
}

}  // namespace

void run_camera(LiveState& state) {
    while (!state.stopping()) {
        try {
            const std::unique_ptr<Capture> capture = state.options.open_camera(state.robot.camera);
            state.camera_opened();
            read_camera(state, *capture);
            if (capture->ended()) {
                state.camera_lost(DeviceState::kOff, state.robot.camera.device + ": ended");
                return;
            }
        } catch (const std::exception& error) {
            state.camera_lost(DeviceState::kConnecting, error.what());
        }
        state.wait_for_stop(state.options.retry_every);
    }
}

}  // namespace hybrid_slam
