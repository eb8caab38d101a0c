// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "hybrid_slam/core/stopwatch.hpp"
#include "hybrid_slam/localization/localizer.hpp"
#include "last_pose.hpp"
#include "run_folder.hpp"

namespace hybrid_slam::tools {

/// Writes down what a localization says while it goes on: poses.csv, events.jsonl and, once a
/// second, last_pose.json.
class LocalizationLog {
  public:
    /// What a run begins with.
    struct Start {
        LastPose last_pose;                    ///< with the map
        std::filesystem::path last_pose_file;  ///< empty: none is kept
        bool keep_last_pose = false;           ///< that of the earlier run, until there is another
        nlohmann::ordered_json event;          ///< the first one
        std::string config;                    ///< YAML
    };

    /// Nothing is touched before the first result. `folder` must outlive it; with nullptr nothing
    /// is kept but the last pose.
    LocalizationLog(const RunFolder* folder, Start start);

    /// Whether the run is written down, and not only its last pose.
    bool keeps_run() const { return folder_ != nullptr; }

    /// `sure`: the pose is one to start from next time. Throws Error when the disk is full.
    void add(const LocalizationResult& result, bool sure);
    /// What has not reached the files yet. Throws Error likewise.
    void save();

  private:
    void begin();
    void add_row(const LocalizationResult& result);
    void add_events(const LocalizationResult& result);
    void add_event(double stamp, const std::string& kind, const nlohmann::ordered_json& facts);
    bool tells_news(const Relocalization& relocalization);

    const RunFolder* folder_;
    Start start_;
    std::optional<LineFile> poses_;
    std::optional<LineFile> events_;
    bool unsaved_ = false;  ///< the last pose is not on the disk yet
    LocalizationStatus status_ = LocalizationStatus::kRelocalizing;
    std::optional<PlaceVerdict> verdict_;
    std::size_t places_ = 0;
    Stopwatch since_save_;
};

}  // namespace hybrid_slam::tools
