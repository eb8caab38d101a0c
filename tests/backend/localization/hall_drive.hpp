// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "backend/localization/localization_support.hpp"
#include "hybrid_slam/localization/localizer.hpp"
#include "support/pose_matchers.hpp"

/// A lap of the thesis's hall to localize along.
namespace hybrid_slam::test {

inline constexpr double kScanRate = 12.5;
inline const Eigen::Matrix3d kGivenDoubt =
    Eigen::Vector3d(0.01, 0.01, radians(3.0) * radians(3.0)).asDiagonal();

/// Once around the thesis's hall, and its map.
struct Hall {
    Hall() : world(world_named("thesis_hall")) {
        world.laps = 1;
        map = map_of(world);
        drive = drive_in(world, s300_config());
    }
    World world;
    std::shared_ptr<const ReferenceMap> map;
    TestDrive drive;
};
inline const Hall& hall() {
    static const Hall hall;
    return hall;
}

inline TestDrive part_of(const TestDrive& drive, std::size_t first, std::size_t last) {
    TestDrive part;
    const auto frame = drive.frames.begin();
    const auto pose = drive.truth.begin();
    part.frames.assign(frame + static_cast<std::ptrdiff_t>(first),
                       frame + static_cast<std::ptrdiff_t>(last));
    part.truth.assign(pose + static_cast<std::ptrdiff_t>(first),
                      pose + static_cast<std::ptrdiff_t>(last));
    return part;
}

inline std::vector<LocalizationResult> follow(Localizer& localizer,
                                              const std::vector<Frame>& frames) {
    std::vector<LocalizationResult> results;
    results.reserve(frames.size());
    for (const Frame& frame : frames) {
        results.push_back(localizer.process(frame));
    }
    return results;
}

inline bool is_known(const LocalizationResult& result) {
    return result.status == LocalizationStatus::kTracking ||
           result.status == LocalizationStatus::kDegraded;
}

/// Whether all poses from a frame on are known and right.
inline void expect_right(const std::vector<LocalizationResult>& results, const Trajectory& truth,
                         std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
        ASSERT_TRUE(is_known(results[i])) << "frame " << i << ": " << to_string(results[i].status);
        ASSERT_THAT(*results[i].map_from_robot, PoseNear(truth[i].pose, 0.05, radians(1.0)))
            << "frame " << i;
    }
}

inline std::size_t first_known(const std::vector<LocalizationResult>& results,
                               std::size_t from = 0) {
    std::size_t i = from;
    while (i < results.size() && !is_known(results[i])) {
        ++i;
    }
    return i;
}

}  // namespace hybrid_slam::test
