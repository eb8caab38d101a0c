// SPDX-License-Identifier: Apache-2.0
#include "serve_lockstep.hpp"

#include <fmt/format.h>

#include <utility>

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/stopwatch.hpp"

namespace hybrid_slam::tools {

ServeLockstep::ServeLockstep(const ServeScene& scene, ServeStage& stage) : stage_(stage) {
    if (stage.devices().has_camera()) {
        renderer_.emplace(scene.world, scene.robot.camera, scene.config);
    }
}

void ServeLockstep::listen(double timeout) {
    const std::vector<CanFrame> frames = stage_.heard(timeout);
    heard_.insert(heard_.end(), frames.begin(), frames.end());
}

/// The drive opens its bus first, whose adapter has to answer.
bool ServeLockstep::wait_for_clients(const std::function<bool()>& ended) {
    constexpr double kSlice = 0.01;  // seconds
    while (!clock_.wait_for_clients(kSlice)) {
        listen(0.0);
        if (ended()) {
            return false;
        }
    }
    return true;
}

void ServeLockstep::deliver_images(double until) {
    while (!images_.empty() && images_.front().arrival <= until) {
        Image& image = images_.front();
        if (stage_.devices().camera_is_watched()) {
            clock_.wait_until_read();
            stage_.devices().publish(std::move(image.jpeg));
            clock_.image(image.arrival);
            ++stage_.counts().images;
        }
        images_.pop_front();
    }
}

/// In the order of arrival.
void ServeLockstep::deliver(const std::vector<LidarBytes>& telegrams) {
    for (const LidarBytes& telegram : telegrams) {
        deliver_images(telegram.arrival);
        clock_.wait_until_read();
        if (stage_.say(telegram)) {
            clock_.lidar(telegram.arrival, telegram.bytes.size());
        }
    }
    deliver_images(stage_.now());
}

/// A pseudo-terminal hands bytes on when it likes to: what the drive has written before it said
/// done may be on its way still.
void ServeLockstep::hear_all(std::size_t frames) {
    constexpr double kPatience = 10.0;  // seconds
    const Stopwatch watch;
    while (heard_.size() < frames && stage_.devices().can() != nullptr) {
        listen(0.01);
        if (watch.seconds() > kPatience) {
            throw Error(fmt::format("lockstep: {} of the drive's {} frames came at {:.2f} s",
                                    heard_.size(), frames, stage_.now()));
        }
    }
}

bool ServeLockstep::tick() {
    ++ticks_;
    const double now = kTick * static_cast<double>(ticks_);
    clock_.wait_until_read();  // a line that is pulled now must not take anything with it
    TruckWorld::Events events = stage_.advance(now);
    for (const CameraMoment& moment : events.images) {
        images_.push_back({moment.arrival, renderer_->render(moment)});
    }
    const std::uint64_t telegrams = stage_.counts().telegrams;
    deliver(events.lidar);
    LockstepTick tick;
    tick.now = now;
    tick.pose_due = stage_.counts().telegrams > telegrams;
    tick.frames = static_cast<std::size_t>(stage_.counts().frames_sent - frames_told_);
    frames_told_ = stage_.counts().frames_sent;
    try {
        hear_all(clock_.tick(tick, [this] { listen(0.0); }));
    } catch (const LockstepClosed&) {
        return false;
    }
    stage_.obey(std::exchange(heard_, {}));
    return true;
}

}  // namespace hybrid_slam::tools
