// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/trajectory.hpp"
#include "hybrid_slam/link/messages.hpp"
#include "hybrid_slam/localization/reference_map.hpp"
#include "hybrid_slam/pilot/pilot.hpp"
#include "run_folder.hpp"

namespace hybrid_slam::tools {

/// Names of the files of a drive.
struct DriveFiles {
    static constexpr auto kSummary = "summary.json";  ///< says that the folder is a drive
    static constexpr auto kDriven = "driven.csv";
    static constexpr auto kEvents = "events.jsonl";
    static constexpr auto kPicture = "drive.png";
};

/// Writes down what a vehicle does while it is driven; without a folder it only counts.
class DriveLog {
  public:
    /// Throws Error for a folder that holds something that is no drive.
    explicit DriveLog(const std::filesystem::path& folder_or_empty);

    /// Each cycle. `now`: seconds. When the disk is full it says so and writes no more.
    void look(double now, const PilotOutput& output, const std::optional<LinkPose>& pose,
              const Route* route);
    void event(double now, const std::string& what, const nlohmann::ordered_json& details);
    void flush();

    struct Ending {
        std::string title;
        const ReferenceMap& map;
        const VehicleConfig& vehicle;
        nlohmann::ordered_json counts;
    };
    /// Picture and summary, which is returned.
    nlohmann::ordered_json finish(const Ending& ending);

  private:
    void write(double now, const PilotOutput& output, const std::optional<LinkPose>& pose,
               const Route* route);
    void add_way(bool drives);
    void give_up(const Error& error);
    void look_at_status(double now, const LinkStatus& status);
    void keep_route(const Route* route);

    std::filesystem::path folder_;
    std::optional<LineFile> driven_;
    std::optional<LineFile> events_;
    LinkStatus last_;
    bool any_ = false;
    double next_row_ = 0.0;
    double next_flush_ = 0.0;
    double pose_stamp_ = 0.0;
    std::optional<Pose2d> last_pose_;
    std::optional<Pose2d> way_from_;  ///< up to where the way is counted
    double path_ = 0.0;               ///< metres by the poses
    std::size_t arrivals_ = 0;
    std::size_t stops_ = 0;
    bool had_route_ = false;
    std::vector<Route> routes_;
    Trajectory poses_;
    std::vector<Pose2d> stood_;        ///< at the start, and where it arrived
    std::vector<Pose2d> interrupted_;  ///< where it stopped on its way
};

}  // namespace hybrid_slam::tools
