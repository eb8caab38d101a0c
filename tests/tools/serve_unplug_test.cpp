// SPDX-License-Identifier: Apache-2.0
#include "serve_unplug.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/error_of.hpp"

namespace hybrid_slam::tools {
namespace {

using test::error_of;
using ::testing::HasSubstr;

TEST(Unplug, IsParsed) {
    const Unplug for_good = parse_unplug("can@5");
    EXPECT_EQ(for_good.device, ServedDevice::kCan);
    EXPECT_EQ(for_good.from, 5.0);
    EXPECT_FALSE(for_good.until);
    const Unplug back = parse_unplug("lidar@10.25:12.5");
    EXPECT_EQ(back.device, ServedDevice::kLidar);
    EXPECT_EQ(back.from, 10.25);
    EXPECT_EQ(back.until, 12.5);
    EXPECT_EQ(parse_unplug("camera@0").device, ServedDevice::kCamera);
}

TEST(Unplug, AnythingElseIsAnErrorThatNamesIt) {
    for (const char* text : {"", "can", "can@", "@5", "wheel@5", "can@x", "can@5:", "can@5:5",
                             "can@5:4", "can@-1", "can@5:6:7", "can@nan", "can@inf", "can@5 "}) {
        EXPECT_THAT(error_of([&] { parse_unplug(text); }),
                    HasSubstr(std::string("--unplug ") + text))
            << text;
    }
}

TEST(Unplug, IsDueOnceAndInOrder) {
    UnplugSchedule schedule(
        {parse_unplug("lidar@3:4"), parse_unplug("can@1:3.5"), parse_unplug("camera@1")});
    EXPECT_TRUE(schedule.due(0.999).empty());
    const auto first = schedule.due(1.0);
    ASSERT_EQ(first.size(), 2U);
    EXPECT_EQ(first[0].device, ServedDevice::kCan);
    EXPECT_FALSE(first[0].plug);
    EXPECT_EQ(first[1].device, ServedDevice::kCamera);
    EXPECT_TRUE(schedule.due(1.0).empty());
    const auto rest = schedule.due(99.0);
    ASSERT_EQ(rest.size(), 3U);
    EXPECT_EQ(to_string(rest[0].device), "lidar");
    EXPECT_EQ(to_string(rest[1].device), "can");
    EXPECT_TRUE(rest[1].plug);
    EXPECT_TRUE(rest[2].plug);
    EXPECT_EQ(rest[2].time, 4.0);
}

}  // namespace
}  // namespace hybrid_slam::tools
