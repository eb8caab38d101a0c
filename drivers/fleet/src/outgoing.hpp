// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <deque>
#include <string>

#include "action_states.hpp"
#include "hybrid_slam/fleet/fleet_config.hpp"
#include "hybrid_slam/fleet/fleet_messages.hpp"
#include "order_book.hpp"

namespace hybrid_slam {

/// All that a state tells of.
struct StateView {
    const OrderBook& book;
    const ActionStates& actions;
    const std::deque<FleetProblem>& problems;
    const FleetStatus& status;
    double wheelbase;
    bool is_held;   ///< the drive has waited for something for a while
    bool is_fresh;  ///< the drive has told its status just now
};

/// The pose is of now, so that one may act on it.
bool is_localized(const FleetStatus& status);

bool is_standing(const FleetStatus& status);
bool is_paused(const FleetStatus& status);

/// Radius in metres about the pose that holds the truth with 95 %: the greater axis of the
/// covariance's ellipse, sqrt(5.991 lambda) (chi square of two degrees of freedom).
double deviation_range(const Eigen::Matrix3d& covariance);

/// Each without the header.
Json state_body(const StateView& view);
Json visualization_body(const FleetStatus& status, double wheelbase);
Json factsheet_body(const FleetConfig& config, const FleetVehicle& vehicle);

/// YYYY-MM-DDTHH:mm:ss.mmmZ
std::string iso_time(std::chrono::system_clock::time_point time);

/// Never throws: what is not UTF-8 is replaced.
inline std::string dump(const Json& json) {
    return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace hybrid_slam
