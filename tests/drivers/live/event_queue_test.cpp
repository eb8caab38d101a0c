// SPDX-License-Identifier: Apache-2.0
#include "event_queue.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

namespace hybrid_slam {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

LidarBytes bytes_at(double arrival) {
    return {arrival, {1}};
}
CameraFrame frame_at(double arrival) {
    return {arrival, {2}};
}

std::vector<double> arrivals(EventQueue& queue) {
    std::vector<double> times;
    while (const auto event = queue.pop()) {
        times.push_back(arrival_of(*event));
    }
    return times;
}

TEST(EventQueue, GivesTheEarlierOneFirst) {
    EventQueue queue(10, 10);
    queue.push(frame_at(1.0));
    queue.push(frame_at(4.0));
    queue.push(bytes_at(2.0));
    queue.push(bytes_at(3.0));
    EXPECT_FALSE(queue.empty());
    EXPECT_THAT(arrivals(queue), ElementsAre(1.0, 2.0, 3.0, 4.0));
    EXPECT_TRUE(queue.empty());
}

TEST(EventQueue, NeverGoesBack) {
    EventQueue queue(10, 10);
    queue.push(bytes_at(-5.0));
    EXPECT_THAT(arrivals(queue), ElementsAre(-5.0));
    queue.push(frame_at(2.0));
    EXPECT_THAT(arrivals(queue), ElementsAre(2.0));
    queue.push(bytes_at(1.999));
    queue.push(bytes_at(2.5));
    EXPECT_THAT(arrivals(queue), ElementsAre(2.0, 2.5));
}

TEST(EventQueue, DropsTheOldestOfTheKindThatIsTooMany) {
    EventQueue queue(3, 2);
    std::size_t images = 0;
    std::size_t lidar = 0;
    for (int i = 0; i < 5; ++i) {
        images += queue.push(frame_at(i + 0.5));
        if (i < 3) {
            lidar += queue.push(bytes_at(i));
        }
    }
    EXPECT_EQ(images, 3u);
    EXPECT_EQ(lidar, 0u) << "images make no room by the lidar's bytes";
    EXPECT_EQ(queue.push(bytes_at(10.0)), 1u);
    EXPECT_THAT(arrivals(queue), ElementsAre(1.0, 2.0, 3.5, 4.5, 10.0));
}

TEST(EventQueue, ALimitOfZeroIsOne) {
    EventQueue queue(0, 0);
    EXPECT_THAT(arrivals(queue), IsEmpty());
    EXPECT_EQ(queue.push(frame_at(1.0)), 0u);
    EXPECT_EQ(queue.push(frame_at(2.0)), 1u);
    EXPECT_THAT(arrivals(queue), ElementsAre(2.0));
}

}  // namespace
}  // namespace hybrid_slam
