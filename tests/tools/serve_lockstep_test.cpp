// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "hybrid_slam/can/candump.hpp"
#include "hybrid_slam/core/trajectory.hpp"
#include "hybrid_slam/live/lockstep_sensors.hpp"
#include "hybrid_slam/lockstep/lockstep_client.hpp"
#include "serving.hpp"

namespace hybrid_slam::test {
namespace {

/// What came out of one run, in bytes.
struct Recorded {
    std::string truth;
    std::string bus;
    std::string sensors;  ///< arrivals and bytes
    std::size_t images = 0;
    std::size_t poses_due = 0;
    Json summary;
};

/// The sensors' end, which only keeps what it gets.
void read_sensors(const RobotConfig& robot, const std::string& url, Recorded& recorded) {
    LockstepSensors sensors(robot, url);
    while (const auto event = sensors.next()) {
        recorded.sensors += std::to_string(arrival_of(*event)) + " ";
        const auto* lidar = std::get_if<LidarBytes>(&*event);
        const auto& bytes = lidar != nullptr ? lidar->bytes : std::get<CameraFrame>(*event).image;
        recorded.sensors.append(bytes.begin(), bytes.end());
        recorded.images += lidar == nullptr ? 1 : 0;
    }
}

/// A drive that turns left all the time, and leaves at `leave_at` seconds.
void turn_left(const Serving& serving, double leave_at, Recorded& recorded) {
    const auto bus = serving.open_bus();
    LockstepDriveClock clock(serving.endpoints()["clock"]);
    Commands commands({0.3, 0.5});
    while (const auto tick = clock.next()) {
        if (tick->now >= leave_at) {
            return;
        }
        for (std::size_t i = 0; i < tick->frames; ++i) {
            EXPECT_TRUE(bus->receive(20.0)) << "of " << tick->frames << " at " << tick->now;
        }
        recorded.poses_due += tick->pose_due ? 1 : 0;
        clock.done(commands.send(*bus));
    }
}

Recorded record(const std::string& arguments, double leave_at = 1e9) {
    const TempFolder folder;
    const Serving serving(folder, "--lockstep " + arguments);
    Recorded recorded;
    std::thread sensors(read_sensors, serving.robot(), serving.endpoints()["clock"],
                        std::ref(recorded));
    turn_left(serving, leave_at, recorded);
    sensors.join();
    EXPECT_EQ(serving.wait(), 0);
    recorded.truth = bytes_of(folder / "sim/truth.tum");
    recorded.bus = bytes_of(folder / "sim/bus.log");
    recorded.summary = serving.summary();
    if (leave_at > 1e6) {
        const auto lines = read_candump(folder / "sim/bus.log");
        EXPECT_EQ(lines.front().microseconds, 20000) << "of the virtual clock";
    }
    return recorded;
}

TEST(ServeLockstep, TheSameRunGivesTheSameBytes) {
    const Recorded first = record("--duration 12 --seed 4");
    const Recorded again = record("--duration 12 --seed 4");
    EXPECT_FALSE(first.truth.empty());
    EXPECT_TRUE(first.truth == again.truth);
    EXPECT_TRUE(first.bus == again.bus);
    EXPECT_TRUE(first.sensors == again.sensors);
    EXPECT_EQ(first.summary, again.summary);
    EXPECT_EQ(first.summary["ended_by"], "duration");
    EXPECT_NEAR(first.summary["duration_s"].get<double>(), 12.0, 1e-6);
    EXPECT_NEAR(first.summary["distance_m"].get<double>(), 0.3 * 12.0, 0.2);
    EXPECT_EQ(first.poses_due, first.summary["scans"].get<std::size_t>());
    EXPECT_EQ(first.summary["frames_received"], 600);
    EXPECT_NEAR(first.summary["frames_sent"].get<double>(), 1200, 2);
    EXPECT_EQ(first.summary["telegrams_dropped"], 0);
    const Recorded other = record("--duration 12 --seed 5");
    EXPECT_FALSE(first.sensors == other.sensors);
}

TEST(ServeLockstep, ImagesComeInTheOrderOfTheirArrival) {
    const Recorded first = record("--duration 0.6 --images");
    const Recorded again = record("--duration 0.6 --images");
    EXPECT_GT(first.images, 10U);
    EXPECT_EQ(first.summary["images"].get<std::size_t>(), first.images);
    EXPECT_TRUE(first.sensors == again.sensors);
    EXPECT_EQ(record("--duration 0.1").images, 0U);
}

TEST(ServeLockstep, EndsWhenTheDriveLeaves) {
    const Recorded left = record("", 2.0);
    EXPECT_NEAR(left.summary["duration_s"].get<double>(), 2.0, 1e-6);
    EXPECT_EQ(left.summary["ended_by"], "drive left");
}

TEST(ServeLockstep, PulledLinesAreSilentAndTheTruckStopsByItself) {
    const Recorded pulled = record("--duration 6 --unplug lidar@2 --unplug can@3");
    EXPECT_LE(pulled.poses_due, 25U);
    EXPECT_GT(pulled.summary["telegrams_unheard"].get<int>(), 40);
    EXPECT_LT(pulled.summary["distance_m"].get<double>(), 0.3 * 3.4);
    EXPECT_GT(pulled.summary["distance_m"].get<double>(), 0.3 * 2.4);
}

}  // namespace
}  // namespace hybrid_slam::test
