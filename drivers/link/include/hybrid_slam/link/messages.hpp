// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "hybrid_slam/core/pose2.hpp"

namespace hybrid_slam {

/// What is spoken between the SLAM computer, the vehicle's computer and those who send it places.
/// Frames: map, robot (middle of the fixed axle, x forward). docs/link.md says it line by line.

inline constexpr int kLinkVersion = 1;

enum class LinkRole { kPose, kGoal, kWatch };

/// The first line of a connection.
struct LinkHello {
    LinkRole role = LinkRole::kWatch;
    int version = kLinkVersion;
    std::string token;  ///< the shared secret; empty: none
    std::string name;   ///< for people
};

enum class LinkPoseStatus { kTracking, kDegraded, kLost, kRelocalizing };

/// Where the vehicle is, or that this is not known.
struct LinkPose {
    double stamp = 0.0;  ///< s of the sender's clock, of the scan that the pose is of
    double age = 0.0;    ///< s from then until it was given to the network, by the same clock
    std::string map;
    LinkPoseStatus status = LinkPoseStatus::kLost;
    /// This and its covariance (m^2, m rad, rad^2; x, y, heading) mean nothing unless `is_known`:
    /// they are then neither sent nor read.
    Pose2d map_from_robot;
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    double score = 0.0;  ///< 0 to 1, how well scan and map agree
    /// Metres to the nearest obstacle in the steered corridor; nothing: not known, so stop.
    std::optional<double> clear_ahead;
    std::optional<double> clear_behind;
    bool is_protective = true;  ///< the scanner's protective field is broken

    /// Only what was measured is told: no last pose is repeated once tracking is lost.
    bool is_known() const {
        return status == LinkPoseStatus::kTracking || status == LinkPoseStatus::kDegraded;
    }
};

struct LinkWaypoint {
    Eigen::Vector2d place = Eigen::Vector2d::Zero();  ///< m in the map
    std::optional<double> heading;                    ///< rad; nothing: any
};

struct LinkGoals {
    std::vector<LinkWaypoint> waypoints;  ///< one at least
    bool append = false;                  ///< behind those that wait, not instead of them
    std::string id;                       ///< comes back in LinkStatus, so that one knows his own
};

enum class LinkCommand { kCancel, kPause, kResume, kManual, kAutomatic };

/// Somebody says where the vehicle stands: from a goal client to the server, and from there to the
/// pose sources, which begin anew there.
struct LinkInitialPose {
    Pose2d map_from_robot;
};

using ClientMessage = std::variant<LinkHello, LinkPose, LinkGoals, LinkCommand, LinkInitialPose>;

/// The answer to a good LinkHello.
struct LinkWelcome {
    int version = kLinkVersion;
};

enum class LinkMode { kManual, kAutomatic };
enum class LinkDriveState { kIdle, kDriving, kPaused, kStopped, kArrived, kFault };
/// As the lines say it.
std::string_view to_string(LinkMode mode);
std::string_view to_string(LinkDriveState state);

/// What the vehicle does. Sent to all clients: goal clients and watchers show it, a pose source
/// looks for obstacles where the vehicle steers to.
struct LinkStatus {
    LinkMode mode = LinkMode::kManual;
    LinkDriveState state = LinkDriveState::kIdle;
    std::string reason;  ///< why it stands; empty: it does not, or nothing hinders it
    std::string fault;   ///< of the drive; empty: none
    std::string goals;   ///< LinkGoals::id of the last that were taken
    std::string map;
    std::optional<Pose2d> map_from_robot;  ///< the last that was known
    double pose_age = 0.0;                 ///< s since its scan; 0 without a pose
    double pose_stamp = 0.0;               ///< LinkPose::stamp of the newest pose, known or not
    double speed = 0.0;                    ///< m/s of the fixed axle, negative is backwards
    double steering = 0.0;                 ///< rad, positive to the left
    int waypoints_left = 0;
    double remaining = 0.0;  ///< m of planned way
};

/// A line was refused, or what it asked for, or the connection is.
struct LinkRefusal {
    std::string reason;
};

using ServerMessage = std::variant<LinkWelcome, LinkStatus, LinkRefusal, LinkInitialPose>;

}  // namespace hybrid_slam
