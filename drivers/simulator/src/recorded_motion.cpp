// SPDX-License-Identifier: Apache-2.0
#include "recorded_motion.hpp"

#include <algorithm>

namespace hybrid_slam {

void RecordedMotion::record(double time, const VehicleState& state) {
    states_.push_back({time, state});
    while (states_.size() > 2 && states_[1].time < time - kKept) {
        states_.pop_front();
    }
}

/// The record before `time`, with one behind it unless there is only one.
std::size_t RecordedMotion::leg_at(double time) const {
    const auto after =
        std::upper_bound(states_.begin(), states_.end(), time,
                         [](double value, const Record& record) { return value < record.time; });
    const auto i = static_cast<std::size_t>(after - states_.begin());
    return states_.size() < 2 ? 0 : std::clamp<std::size_t>(i, 1, states_.size() - 1) - 1;
}

double RecordedMotion::share(std::size_t leg, double time) const {
    const double start = states_[leg].time;
    return std::clamp((time - start) / (states_[leg + 1].time - start), 0.0, 1.0);
}

Pose2d RecordedMotion::world_from_robot(double time) const {
    const std::size_t i = leg_at(time);
    if (i + 1 >= states_.size()) {
        return states_[i].state.world_from_robot;
    }
    return interpolate(states_[i].state.world_from_robot, states_[i + 1].state.world_from_robot,
                       share(i, time));
}

Eigen::Vector3d RecordedMotion::twist(double time) const {
    const std::size_t i = leg_at(time);
    const Eigen::Vector3d before = states_[i].state.twist(vehicle_);
    if (i + 1 >= states_.size()) {
        return before;
    }
    const double ratio = share(i, time);
    return (1.0 - ratio) * before + ratio * states_[i + 1].state.twist(vehicle_);
}

}  // namespace hybrid_slam
