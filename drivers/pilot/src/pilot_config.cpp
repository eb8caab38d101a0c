// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/pilot/pilot.hpp"

namespace hybrid_slam {

void describe(ConfigSchema& schema, PilotConfig& config) {
    {
        const ConfigSchema::Section section(schema, "pilot");
        schema.add("pose_valid", config.pose_valid, 0.05, 2.0,
                   "s that a pose may be driven on after it came; then the vehicle stops");
        schema.add("pose_delay", config.pose_delay, 0.0, 2.0,
                   "s of age that SLAM needs anyway; what a pose is older counts as late");
        schema.add("pose_jump", config.pose_jump, 0.05, 100.0,
                   "m that a pose may differ from the wheels' way; more pauses the vehicle");
        schema.add("pose_source", config.pose_source,
                   "name that the pose source must have (localize --name); empty: any");
        schema.add("position_sigma", config.position_sigma, 0.001, 10.0,
                   "m, of the pose's worst direction; a worse one stops the vehicle");
        schema.add_degrees("heading_sigma_deg", config.heading_sigma, 0.01, 180.0,
                           "deg; a worse heading stops the vehicle");
        schema.add("frozen_after", config.frozen_after, 0.02, 10.0,
                   "m by the wheels without the pose moving along; then the vehicle stops");
        schema.add("most_replans", config.most_replans, 0, 1000,
                   "new ways for one order before it is given up");
        schema.add("needs_goal_client", config.needs_goal_client,
                   "stop and forget the places when the client that sent them is gone");
        schema.add("starts_automatic", config.starts_automatic, "else it begins in manual mode");
    }
    {
        const ConfigSchema::Section section(schema, "planner");
        describe(schema, config.planner);
    }
    const ConfigSchema::Section section(schema, "follower");
    describe(schema, config.follower);
}

}  // namespace hybrid_slam
