// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <set>

#include "drivers/log_reading.hpp"
#include "hybrid_slam/core/metrics.hpp"
#include "support/pose_matchers.hpp"
#include "support/shared_data.hpp"

namespace hybrid_slam::test {
namespace {

struct Recording {
    const char* name;
    std::size_t scans;
    std::size_t odom_lines;
    std::size_t backward_stamps;
    std::size_t beams;  ///< of each scan
    double step_deg;
    Pose2d robot_from_laser;
};

class CarmenRecording : public ::testing::TestWithParam<Recording> {};

TEST_P(CarmenRecording, HoldsWhatItIsKnownToHold) {
    const Recording& known = GetParam();
    HYBRID_SLAM_SHARED_OR_SKIP(file, std::string("data/slam2d/") + known.name + ".clf.gz");
    const LogContents log = read_log(file);
    EXPECT_EQ(log.counts.scans, known.scans);
    EXPECT_EQ(log.counts.odometry, known.odom_lines);
    EXPECT_EQ(log.odometry.size(), known.odom_lines + known.scans);
    EXPECT_EQ(log.counts.backward_stamps, known.backward_stamps);
    EXPECT_EQ(log.counts.duplicate_stamps, 0U);
    EXPECT_EQ(log.counts.malformed_lines + log.counts.torn_last_line + log.counts.bad_poses, 0U);
    EXPECT_EQ(log.counts.beams, known.scans * known.beams);
    EXPECT_LT(log.counts.no_returns, log.counts.beams / 10);
    for (const Scan& scan : log.scans) {
        ASSERT_EQ(scan.ranges.size(), known.beams);
        ASSERT_NEAR(degrees(scan.angle_min), -90.0, 1e-9);
        ASSERT_NEAR(degrees(scan.angle_increment), known.step_deg, 1e-9);
        ASSERT_THAT(scan.robot_from_laser, PoseNear(known.robot_from_laser, 2e-6, 1e-6));
    }
}

TEST_P(CarmenRecording, HasAScanForEveryStampOfItsRelations) {
    const std::string stem = std::string("data/slam2d/") + GetParam().name;
    HYBRID_SLAM_SHARED_OR_SKIP(file, stem + ".clf.gz");
    HYBRID_SLAM_SHARED_OR_SKIP(relations_file, stem + ".relations");
    std::set<double> stamps;
    for (const Scan& scan : read_log(file).scans) {
        stamps.insert(scan.stamp);
    }
    // Scans may be closer together than the tolerance: the nearest on either side counts.
    const auto has_scan = [&stamps](double stamp) {
        const auto after = stamps.lower_bound(stamp);
        const bool near_after = after != stamps.end() && *after - stamp <= 0.001;
        return near_after || (after != stamps.begin() && stamp - *std::prev(after) <= 0.001);
    };
    const std::vector<Relation> relations = read_relations(relations_file);
    EXPECT_GT(relations.size(), 1000U);
    for (const Relation& relation : relations) {
        ASSERT_TRUE(has_scan(relation.from_stamp)) << relation.from_stamp;
        ASSERT_TRUE(has_scan(relation.to_stamp)) << relation.to_stamp;
    }
}

INSTANTIATE_TEST_SUITE_P(
    Logs, CarmenRecording,
    ::testing::Values(Recording{"intel", 13631, 26915, 631, 180, 1.0, Pose2d()},
                      Recording{"fr079", 4934, 8951, 0, 360, 0.5, Pose2d(-0.04, 0.0, 0.0)},
                      Recording{"mit-csail", 1988, 0, 0, 361, 0.5, Pose2d()}),
    [](const auto& test) {
        std::string name = test.param.name;
        std::replace(name.begin(), name.end(), '-', '_');
        return name;
    });

}  // namespace
}  // namespace hybrid_slam::test
