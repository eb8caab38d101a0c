// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "hybrid_slam/camera/capture.hpp"
#include "hybrid_slam/can/candump.hpp"
#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/trajectory.hpp"
#include "hybrid_slam/lidar/byte_source.hpp"
#include "hybrid_slam/live/live_sensors.hpp"
#include "hybrid_slam/sensors/sensor_source.hpp"
#include "serving.hpp"

namespace hybrid_slam::test {
namespace {

using ::testing::HasSubstr;

/// Reads scans from the live line until there are so many.
std::vector<Scan> read_scans(const RobotConfig& robot, std::size_t count) {
    LiveSensors sensors(robot);
    SensorSource source(sensors, robot);
    std::vector<Scan> scans;
    while (scans.size() < count) {
        scans.push_back(std::get<Scan>(source.next().value()));
    }
    EXPECT_EQ(source.counts().lidar.stream.bad_checksums, 0U);
    return scans;
}

/// Fifty commands a second until the truck has told a speed of `fraction` of what is asked.
double drive_until(CanBus& bus, const DriveCommand& command, double fraction) {
    Commands commands(command);
    double speed = 0.0;
    for (int i = 0; i < 1000 && std::abs(speed) < fraction * std::abs(command.speed); ++i) {
        commands.send(bus);
        const auto next = std::chrono::steady_clock::now() + std::chrono::milliseconds(20);
        while (std::chrono::steady_clock::now() < next) {
            if (const auto frame = bus.receive(0.005)) {
                speed = commands.hear(*frame).speed.value_or(speed);
            }
        }
    }
    return speed;
}

TEST(Serve, TelegramsAreScansOfTheWorldFromWhereItStands) {
    const TempFolder folder;
    const Serving serving(folder, "--no-camera --start 2,3,90");
    EXPECT_TRUE(serving.endpoints()["camera"].is_null());
    EXPECT_TRUE(serving.endpoints()["clock"].is_null());
    const std::vector<Scan> scans = read_scans(serving.robot(), 12);
    const Scan& scan = scans.back();
    // Of the scanner at (2, 4.3), looking up: 0.7 m to the wall y = 5, 2 m to x = 0 on its left.
    EXPECT_NEAR(static_cast<double>(scan.ranges[270]), 0.7, 0.1);
    EXPECT_NEAR(static_cast<double>(scan.ranges[450]), 2.0, 0.1);
    serving.end();
    EXPECT_EQ(serving.wait(), 0);
    const Json summary = serving.summary();
    EXPECT_GE(summary["scans"].get<std::size_t>(), 12U);
    EXPECT_EQ(summary["contacts"], 0);
    EXPECT_EQ(summary["ended_by"], "signal");
    EXPECT_EQ(summary["distance_m"], 0.0);
    const Trajectory truth = read_tum(folder / "sim/truth.tum");
    EXPECT_EQ(truth.size(), summary["scans"].get<std::size_t>());
    EXPECT_NEAR(truth.back().pose.x(), 2.0, 1e-6);
    EXPECT_NEAR(truth.back().pose.heading, kPi / 2, 1e-6);
    EXPECT_FALSE(std::filesystem::exists(folder / "sim/s300")) << "the links go with it";
    EXPECT_FALSE(std::filesystem::exists(folder / "sim/can"));
}

TEST(Serve, TheTruckObeysFramesAndTellsWhatItDoes) {
    const TempFolder folder;
    const Serving serving(folder, "--no-camera");
    {
        const auto bus = serving.open_bus();
        EXPECT_GT(drive_until(*bus, {0.3, 0.1}, 0.95), 0.28);
    }
    // Its own watchdog stops it now.
    for (int i = 0; i < 3000 && serving.events("stopped").empty(); ++i) {
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    serving.end();
    EXPECT_EQ(serving.wait(), 0);
    ASSERT_EQ(serving.events("stopped").size(), 1U);
    EXPECT_EQ(serving.events("bus opened").size(), 1U);
    EXPECT_GE(serving.events("driven").size(), 1U);
    const Json stopped = serving.events("stopped").front();
    const Json summary = serving.summary();
    EXPECT_EQ(stopped["pose"], summary["pose"]) << "where it stands";
    EXPECT_GT(summary["distance_m"].get<double>(), 0.1);
    EXPECT_NEAR(summary["worst_speed"].get<double>(), 0.3, 0.02);
    EXPECT_GT(summary["pose"][1].get<double>(), 1.2) << "to the left";
    std::size_t commands = 0;
    std::size_t feedback = 0;
    for (const CandumpLine& line : read_candump(folder / "sim/bus.log")) {
        commands += line.frame.id == 0x203 ? 1 : 0;
        feedback += line.frame.id == 0x183 || line.frame.id == 0x383 ? 1 : 0;
        EXPECT_GT(line.microseconds, 1600000000000000) << "of the wall clock";
    }
    EXPECT_EQ(commands, summary["frames_received"].get<std::size_t>());
    EXPECT_GE(feedback, summary["frames_sent"].get<std::size_t>());
}

TEST(Serve, TheCameraIsOnTheNetwork) {
    const TempFolder folder;
    const Serving serving(folder, "");
    const auto capture = open_capture(serving.robot().camera);
    EncodedImage bytes;
    std::size_t images = 0;
    for (int i = 0; i < 100 && images < 3; ++i) {
        images += capture->read(bytes, 0.5) ? 1 : 0;
    }
    ASSERT_EQ(images, 3U);
    const auto image = decode_image(bytes, ImageColor::kGray);
    ASSERT_TRUE(image);
    EXPECT_EQ(image->width, 640);
    serving.end();
    EXPECT_EQ(serving.wait(), 0);
    EXPECT_GE(serving.summary()["images"].get<std::size_t>(), 3U);
}

TEST(Serve, ALineThatIsPulledIsGoneUntilItIsPluggedAgain) {
    const TempFolder folder;
    const Serving serving(folder, "--no-camera --unplug lidar@1.5:2 --unplug can@1.5");
    const auto bus = serving.open_bus();
    const auto line = open_byte_source(serving.robot().lidar);
    std::vector<std::uint8_t> bytes;
    EXPECT_THROW(
        {
            for (int i = 0; i < 100; ++i) {
                line->read(bytes, 1.0);
            }
        },
        Error);
    for (int i = 0; i < 1000 && bus->fault().empty(); ++i) {
        bus->receive(0.02);
    }
    EXPECT_THAT(bus->fault(), HasSubstr("can"));
    for (int i = 0; i < 3000 && serving.events("plug").empty(); ++i) {
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    EXPECT_EQ(read_scans(serving.robot(), 3).size(), 3U);
    serving.end();
    EXPECT_EQ(serving.wait(), 0);
    EXPECT_EQ(serving.events("unplug").size(), 2U);
    ASSERT_EQ(serving.events("plug").size(), 1U);
    EXPECT_EQ(serving.events("plug")[0]["device"], "lidar");
    EXPECT_EQ(serving.events("bus closed").size(), 1U);
}

TEST(Serve, EndsByItselfAfterItsDuration) {
    const TempFolder folder;
    write_room(folder);
    const Outcome result =
        run_well(folder, "simulate room.yaml --serve --no-camera --duration 0.5 --seed 9 --json");
    EXPECT_GE(result.json()["duration_s"].get<double>(), 0.5);
    EXPECT_EQ(result.json()["seed"], 9);
    EXPECT_GT(result.json()["telegrams_unheard"].get<int>(), 3);
    EXPECT_THAT(result.err, HasSubstr("--lidar sim/s300"));
    EXPECT_THAT(result.err, HasSubstr("--can slcan:sim/can"));
    EXPECT_TRUE(std::filesystem::exists(folder / "sim/summary.json")) << "sim without a name";
}

TEST(Serve, SaysWhatItCannotDo) {
    const TempFolder folder;
    write_room(folder);
    EXPECT_EQ(run(folder, "simulate room.yaml").code, 2);
    EXPECT_EQ(run(folder, "simulate room.yaml --serve x --out y").code, 2);
    EXPECT_EQ(run(folder, "simulate room.yaml --serve x --start 1,2").code, 2);
    const Outcome alone = run(folder, "simulate room.yaml --out y --lockstep");
    EXPECT_EQ(alone.code, 2);
    EXPECT_THAT(alone.err, HasSubstr("--serve"));
    const Outcome plug = run(folder, "simulate room.yaml --serve x --unplug wheel@3");
    EXPECT_EQ(plug.code, 1);
    EXPECT_THAT(plug.err, HasSubstr("wheel@3"));
    const Outcome back = run(folder, "simulate room.yaml --serve x --lockstep --unplug lidar@3:4");
    EXPECT_EQ(back.code, 1);
    EXPECT_THAT(back.err, HasSubstr("lockstep"));
    EXPECT_FALSE(std::filesystem::exists(folder / "x/endpoints.json"));
    folder.write("taken", "a file");
    EXPECT_EQ(run(folder, "simulate room.yaml --serve taken").code, 1);
}

}  // namespace
}  // namespace hybrid_slam::test
