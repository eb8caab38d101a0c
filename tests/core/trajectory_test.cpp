// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/core/trajectory.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "hybrid_slam/core/error.hpp"
#include "support/error_of.hpp"
#include "support/pose_matchers.hpp"
#include "support/temp_folder.hpp"

namespace hybrid_slam {
namespace {

using test::bytes_of;
using test::error_of;
using test::PoseNear;
using test::TempFolder;
using ::testing::HasSubstr;

TEST(Tum, WritesTheExactLayout) {
    const TempFolder folder;
    write_tum(folder / "t.tum", {{976052905.167303, {1.5, -2.25, 0.0}}, {2.0, {0.0, 0.0, kPi}}});
    EXPECT_EQ(bytes_of(folder / "t.tum"),
              "976052905.167303 1.500000000 -2.250000000 0 0 0 0.000000000000 1.000000000000\n"
              "2.000000 0.000000000 0.000000000 0 0 0 1.000000000000 0.000000000000\n");
}

TEST(Tum, RoundTripKeepsOrderStampsAndPoses) {
    const TempFolder folder;
    std::mt19937 random(10);
    std::uniform_real_distribution<double> metres(-100.0, 100.0);
    std::uniform_real_distribution<double> angle(-kPi, kPi);
    Trajectory written{{5.0, {1.0, 2.0, -kPi}}, {4.0, {1.0, 2.0, 3.1415926}}, {5.0, {}}};
    for (int i = 0; i < 200; ++i) {
        written.push_back(
            {1134864645.90321 + 0.1 * i, {metres(random), metres(random), angle(random)}});
    }
    for (const char* name : {"t.tum", "t.tum.gz"}) {
        write_tum(folder / name, written);
        const Trajectory read = read_tum(folder / name);
        ASSERT_EQ(read.size(), written.size());
        for (std::size_t i = 0; i < read.size(); ++i) {
            EXPECT_NEAR(read[i].stamp, written[i].stamp, 6e-7);
            EXPECT_THAT(read[i].pose, PoseNear(written[i].pose, 1e-9, 1e-11));
        }
    }
}

TEST(Tum, ReadsCommentsBlanksAndOtherQuaternions) {
    const TempFolder folder;
    const Trajectory read = read_tum(folder.write("t.tum",
                                                  "# stamp tx ty tz qx qy qz qw\n\n   \n"
                                                  "1e0\t+1 2 9  0 0 2 2\r\n"
                                                  "2 0 0 0 0 0 -0.7071067811865476 "
                                                  "-0.7071067811865476\n"));
    ASSERT_EQ(read.size(), 2U);
    EXPECT_EQ(read[0].stamp, 1.0);
    EXPECT_THAT(read[0].pose, PoseNear(Pose2d(1.0, 2.0, 0.5 * kPi), 1e-12, 1e-12));
    EXPECT_THAT(read[1].pose, PoseNear(Pose2d(0.0, 0.0, 0.5 * kPi), 1e-12, 1e-12));
}

TEST(Tum, TakesTheYawOfATiltedPose) {
    const TempFolder folder;
    // Yaw 0.8, then pitch 0.1 and roll -0.2, as q_yaw * q_pitch * q_roll.
    const double cy = std::cos(0.4), sy = std::sin(0.4), cp = std::cos(0.05), sp = std::sin(0.05),
                 cr = std::cos(-0.1), sr = std::sin(-0.1);
    const std::string line = "1 0 0 0 " + std::to_string(sr * cp * cy - cr * sp * sy) + " " +
                             std::to_string(cr * sp * cy + sr * cp * sy) + " " +
                             std::to_string(cr * cp * sy - sr * sp * cy) + " " +
                             std::to_string(cr * cp * cy + sr * sp * sy) + "\n";
    EXPECT_NEAR(read_tum(folder.write("t.tum", line))[0].pose.heading, 0.8, 1e-5);
}

TEST(Tum, NamesTheLineThatIsWrong) {
    const TempFolder folder;
    const auto error = [&folder](const std::string& bad) {
        const auto file = folder.write("t.tum", "# c\n1 0 0 0 0 0 0 1\n" + bad);
        return error_of([&] { read_tum(file); });
    };
    for (const char* bad : {"2 0 0 0 0 0 0\n", "2 0 0 0 0 0 0 1 7\n", "2 0 0 0 0 0 x 1\n",
                            "2 0 0 nan 0 0 0 1\n", "2 inf 0 0 0 0 0 1\n", "2,0,0,0,0,0,0,1\n"}) {
        EXPECT_EQ(error(bad), (folder / "t.tum").string() +
                                  ":3: must be eight numbers: stamp tx ty tz qx qy qz qw");
    }
    EXPECT_THAT(error("2 0 0 0 0 0 0 0\n"), HasSubstr("t.tum:3: the quaternion is zero"));
}

TEST(Tum, RefusesEmptyAndTruncatedFiles) {
    const TempFolder folder;
    EXPECT_THAT(error_of([&] { read_tum(folder.write("e.tum", "# none\n")); }),
                HasSubstr("e.tum: holds no pose"));
    write_tum(folder / "t.tum.gz", Trajectory(1000, {1.0, {1.0, 2.0, 3.0}}));
    const std::string bytes = bytes_of(folder / "t.tum.gz");
    EXPECT_THAT(
        error_of([&] { read_tum(folder.write("c.tum.gz", bytes.substr(0, bytes.size() - 5))); }),
        HasSubstr("truncated or corrupt"));
    EXPECT_THROW(write_tum(folder / "no/t.tum", {}), Error);
}

struct Index : ::testing::Test {
    // Out of order, with a repeated stamp.
    Trajectory trajectory{{3.0, {3.0, 0.0, 0.0}},
                          {1.0, {1.0, 0.0, 0.0}},
                          {2.0, {2.0, 0.0, 0.0}},
                          {2.0, {9.0, 0.0, 0.0}},
                          {std::numeric_limits<double>::quiet_NaN(), {}},
                          {10.0, {10.0, 0.0, 1.0}}};
    TrajectoryIndex index{trajectory};
};

TEST_F(Index, FindsTheNearestStampWithinTheTolerance) {
    EXPECT_EQ(index.nearest(1.0, 0.0)->x(), 1.0);
    EXPECT_EQ(index.nearest(1.4, 0.5)->x(), 1.0);
    EXPECT_EQ(index.nearest(2.6, 0.5)->x(), 3.0);
    EXPECT_EQ(index.nearest(0.5, 0.5)->x(), 1.0);
    EXPECT_EQ(index.nearest(10.5, 0.5)->x(), 10.0);
    EXPECT_EQ(index.nearest(2.0, 0.1)->x(), 2.0);
    EXPECT_FALSE(index.nearest(0.4, 0.5).has_value());
    EXPECT_FALSE(index.nearest(11.0, 0.5).has_value());
    EXPECT_FALSE(index.nearest(6.0, 0.5).has_value());
}

TEST_F(Index, InterpolatesBetweenNeighboursOnly) {
    EXPECT_THAT(*index.interpolated(1.25, 1.0), PoseNear(Pose2d(1.25, 0.0, 0.0), 1e-12, 1e-12));
    EXPECT_EQ(index.interpolated(1.0, 0.1)->x(), 1.0);
    EXPECT_EQ(index.interpolated(10.0, 0.1)->x(), 10.0);
    EXPECT_FALSE(index.interpolated(5.0, 6.9).has_value());
    EXPECT_TRUE(index.interpolated(5.0, 7.0).has_value());
    EXPECT_FALSE(index.interpolated(0.99, 9.0).has_value());
    EXPECT_FALSE(index.interpolated(10.01, 9.0).has_value());
}

TEST(TrajectoryIndex, NearestAgreesWithASearchThroughAll) {
    std::mt19937 random(11);
    std::uniform_real_distribution<double> seconds(0.0, 100.0);
    Trajectory trajectory;
    for (int i = 0; i < 300; ++i) {
        const double stamp = seconds(random);
        trajectory.push_back({stamp, {stamp, 0.0, 0.0}});
    }
    const TrajectoryIndex index(trajectory);
    for (int i = 0; i < 1000; ++i) {
        const double wanted = seconds(random);
        double least = 1e9;
        for (const StampedPose& pose : trajectory) {
            least = std::min(least, std::abs(pose.stamp - wanted));
        }
        const auto found = index.nearest(wanted, 0.2);
        ASSERT_EQ(found.has_value(), least <= 0.2);
        if (found) {
            EXPECT_DOUBLE_EQ(std::abs(found->x() - wanted), least);
        }
    }
}

TEST(TrajectoryIndex, OfNothingFindsNothing) {
    const TrajectoryIndex index({});
    EXPECT_FALSE(index.nearest(1.0, 1e9).has_value());
    EXPECT_FALSE(index.interpolated(1.0, 1e9).has_value());
}

TEST(Trajectory, LengthLeavesOutWhatOnlyTrembles) {
    Trajectory trembling;
    for (int i = 0; i < 1000; ++i) {
        trembling.push_back({0.1 * i, {0.001 * i, i % 2 == 0 ? 0.01 : -0.01, 0.0}});
    }
    EXPECT_NEAR(length_of(trembling), 1.0, 0.1) << "and not the 20 m of its steps";
}

TEST(Trajectory, LengthIsOfTheWayNotOfItsEnds) {
    EXPECT_EQ(length_of({}), 0.0);
    EXPECT_EQ(length_of({{1.0, {5.0, 5.0, 0.0}}}), 0.0);
    EXPECT_DOUBLE_EQ(
        length_of({{1.0, {0.0, 0.0, 0.0}}, {2.0, {3.0, 4.0, 1.0}}, {3.0, {0.0, 0.0, 0.0}}}), 10.0);
}

}  // namespace
}  // namespace hybrid_slam
