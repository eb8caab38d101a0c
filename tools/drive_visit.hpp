// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hybrid_slam/link/messages.hpp"

namespace hybrid_slam::tools {

/// What is to be told to a drive; nothing: it is only watched.
struct DriveErrand {
    std::string server;  ///< as of parse_endpoint
    std::string token;
    std::optional<LinkInitialPose> here;
    std::vector<LinkCommand> commands;
    std::optional<LinkGoals> goals;  ///< with an id of their own
    bool watches = false;            ///< until the vehicle has arrived
    double patience = 5.0;           ///< seconds until the drive must have answered
    bool quiet = false;
    bool json = false;
};

/// Tells it, waits until the drive's status shows it, and watches. Returns the exit code of `goto`.
/// Throws Error when the connection is lost while sending.
int visit_drive(const DriveErrand& errand);

}  // namespace hybrid_slam::tools
