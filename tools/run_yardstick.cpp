// SPDX-License-Identifier: Apache-2.0
#include "run_yardstick.hpp"

#include <algorithm>

#include "hybrid_slam/core/error.hpp"

namespace hybrid_slam::tools {
namespace {

namespace fs = std::filesystem;

/// Whether stamps of another drive follow. Logs have short steps back in time too.
bool begins_anew(const Trajectory& trajectory) {
    constexpr double kStep = 5.0;  // seconds
    return std::adjacent_find(trajectory.begin(), trajectory.end(),
                              [](const StampedPose& before, const StampedPose& now) {
                                  return now.stamp < before.stamp - kStep;
                              }) != trajectory.end();
}

std::optional<Pose2d> tie(const fs::path& map, const fs::path& map_truth) {
    if (map_truth.empty()) {
        return std::nullopt;
    }
    const fs::path mapped = map / "trajectory.tum";
    if (!fs::exists(mapped)) {
        throw Error(map.string() + ": has no trajectory.tum, which --map-truth needs");
    }
    const Trajectory trajectory = read_tum(mapped);
    if (begins_anew(trajectory)) {
        throw Error(mapped.string() +
                    ": holds several drives; --map-truth needs the map of one, whose truth it is");
    }
    return truth_error(trajectory, read_tum(map_truth)).truth_from_estimate;
}

YardstickFiles placed(YardstickFiles files, bool tied) {
    files.alignment = tied ? TruthAlignment::kNone : files.alignment;
    return files;
}

}  // namespace

RunYardstick::RunYardstick(const YardstickFiles& files, const fs::path& map,
                           const fs::path& map_truth)
    : truth_from_map_(tie(map, map_truth)),
      yardstick_(placed(files, truth_from_map_.has_value())),
      how_(yardstick_.description()) {
    if (truth_from_map_) {
        how_ += ", which " + map_truth.string() + " ties to the map";
    } else if (files.relations.empty() && files.alignment != TruthAlignment::kNone) {
        how_ += ": the map's frame is its own (--map-truth ties it to the truth)";
    }
}

RunTruth RunYardstick::measure(const Trajectory& trajectory) const {
    Trajectory moved = trajectory;
    if (truth_from_map_) {
        for (StampedPose& pose : moved) {
            pose.pose = *truth_from_map_ * pose.pose;
        }
    }
    return {yardstick_.measure(moved), how_};
}

}  // namespace hybrid_slam::tools
