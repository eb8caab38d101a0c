// SPDX-License-Identifier: Apache-2.0
#include "scan_file.hpp"

#include <gmock/gmock.h>

#include <limits>
#include <random>

#include "support/error_of.hpp"
#include "support/temp_folder.hpp"

namespace hybrid_slam::test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using tools::read_scan;
using tools::write_scan;

Scan any_scan() {
    std::mt19937 rng(3);
    std::uniform_real_distribution<float> range(0.0F, 40.0F);
    Scan scan;
    scan.stamp = 1700000000.123456;
    scan.angle_min = -2.356194490192345;
    scan.angle_increment = 0.008726646259971648;
    scan.range_min = 0.02;
    scan.range_max = 29.9;
    scan.robot_from_laser = Pose2d(0.71, -0.03, 0.1234567);
    for (int i = 0; i < 541; ++i) {
        scan.ranges.push_back(range(rng));
    }
    scan.ranges[7] = std::numeric_limits<float>::infinity();
    return scan;
}

TEST(ScanFile, ComesBackToTheBit) {
    const TempFolder folder;
    const Scan scan = any_scan();
    write_scan(folder / "scan.json", scan);
    const Scan back = read_scan(folder / "scan.json");
    EXPECT_EQ(back.stamp, scan.stamp);
    EXPECT_EQ(back.angle_min, scan.angle_min);
    EXPECT_EQ(back.angle_increment, scan.angle_increment);
    EXPECT_EQ(back.range_min, scan.range_min);
    EXPECT_EQ(back.range_max, scan.range_max);
    EXPECT_EQ(back.robot_from_laser.x(), scan.robot_from_laser.x());
    EXPECT_NEAR(back.robot_from_laser.heading, scan.robot_from_laser.heading, 1e-15);
    ASSERT_EQ(back.ranges.size(), scan.ranges.size());
    for (std::size_t i = 0; i < scan.ranges.size(); ++i) {
        ASSERT_EQ(back.is_return(back.ranges[i]), scan.is_return(scan.ranges[i])) << i;
        if (scan.is_return(scan.ranges[i])) {
            ASSERT_EQ(back.ranges[i], scan.ranges[i]) << i;
        }
    }
}

TEST(ScanFile, WhatNeedNotBeThere) {
    const TempFolder folder;
    const auto file = folder.write("s.json", R"({"ranges": [1, null, 2.5, 1e300, -1],
        "angle_min": -0.5, "angle_increment": -0.1, "range_max": 30})");
    const Scan scan = read_scan(file);
    EXPECT_EQ(scan.stamp, 0.0);
    EXPECT_EQ(scan.range_min, 0.0);
    EXPECT_EQ(scan.robot_from_laser.vector(), Eigen::Vector3d::Zero());
    std::vector<bool> returns;
    for (const float range : scan.ranges) {
        returns.push_back(scan.is_return(range));
    }
    EXPECT_THAT(returns, ::testing::ElementsAre(true, false, true, false, false));
}

TEST(ScanFile, ErrorsNameFileAndKey) {
    const TempFolder folder;
    const std::string good = R"("angle_min": 0, "angle_increment": 0.1, "range_max": 30)";
    const std::pair<std::string, const char*> kCases[] = {
        {"", "s.json:1: is no JSON"},
        {"{\"ranges\": [1,\n2,\nx]}", "s.json:3: is no JSON"},
        {"[1, 2]", "must be an object"},
        {"{" + good + "}", "key 'ranges' is missing"},
        {"{" + good + R"(, "ranges": []})", "key 'ranges'"},
        {"{" + good + R"(, "ranges": 3})", "key 'ranges'"},
        {"{" + good + R"(, "ranges": [1, "2"]})", "key 'ranges[1]' must be a number or null"},
        {"{" + good + R"(, "ranges": [1], "range_mim": 0})", "key 'range_mim' is unknown"},
        {"{" + good + R"(, "ranges": [1], "range_min": 40})", "key 'range_min'"},
        {"{" + good + R"(, "ranges": [1], "stamp": null})", "key 'stamp' must be a number"},
        {"{" + good + R"(, "ranges": [1e999]})", "s.json: "},
        {"{" + good + ",\n\"ranges\": [1, NaN]}", "s.json:2: is no JSON from here on: NaN and"},
        {"{" + good + ",\n\"ranges\": [1, Infinity]}", "'ranges' has null for what did not"},
        {"{" + good + R"(, "ranges": [1], "stamp": 1e300})", "key 'stamp' must be from"},
        {"{" + good + R"(, "ranges": [1], "robot_from_laser": {"x": 1e300, "y": 0, "yaw_deg": 0}})",
         "key 'robot_from_laser.x' must be from -100 to 100"},
        {"{" + good + R"(, "ranges": [1], "robot_from_laser": {"x": 0, "y": 0, "yaw_deg": 1e9}})",
         "key 'robot_from_laser.yaw_deg' must be from"},
        {R"({"ranges": [1, 2], "angle_min": 0, "range_max": 30})",
         "key 'angle_increment' is missing"},
        {R"({"ranges": [1, 2], "angle_min": -135, "angle_increment": 0.5, "range_max": 30})",
         "key 'angle_min' must be from"},
        {R"({"ranges": [1, 2], "angle_min": 0, "angle_increment": 0, "range_max": 30})",
         "key 'angle_increment' must be radians"},
        {R"({"ranges": [1, 2], "angle_min": 0, "angle_increment": 1e-300, "range_max": 30})",
         "key 'angle_increment' must be radians"},
        {R"({"ranges": [1, 1, 1, 1], "angle_min": 0, "angle_increment": 3, "range_max": 30})",
         "key 'angle_increment' must be radians"},
        {R"({"ranges": [1, 2], "angle_min": 0, "angle_increment": 0.5, "range_max": 0})",
         "key 'range_max'"},
        {"{" + good + R"(, "ranges": [1], "robot_from_laser": [0, 0, 0]})",
         "key 'robot_from_laser' must be an object"},
        {"{" + good + R"(, "ranges": [1], "robot_from_laser": {"x": 1, "y": 0}})",
         "key 'robot_from_laser.yaw_deg' is missing"},
        {"{" + good + R"(, "ranges": [1], "robot_from_laser": {"x": 1, "y": 0, "yaw": 0}})",
         "key 'robot_from_laser.yaw' is unknown"}};
    for (const auto& [text, expected] : kCases) {
        SCOPED_TRACE(text);
        const auto file = folder.write("s.json", text);
        EXPECT_THAT(error_of([&] { read_scan(file); }),
                    AllOf(HasSubstr("s.json"), HasSubstr(expected)));
    }
}

TEST(ScanFile, NoFileAndNoRoomAreErrors) {
    const TempFolder folder;
    EXPECT_THAT(error_of([&] { read_scan(folder / "none.json"); }), HasSubstr("none.json"));
    EXPECT_THAT(error_of([&] { write_scan(folder / "no/where.json", any_scan()); }),
                HasSubstr("where.json"));
}

}  // namespace
}  // namespace hybrid_slam::test
