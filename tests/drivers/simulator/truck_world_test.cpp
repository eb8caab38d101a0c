// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/simulator/truck_world.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <deque>

#include "hybrid_slam/can/drive_codec.hpp"
#include "hybrid_slam/sensors/sensor_source.hpp"
#include "support/error_of.hpp"
#include "support/pose_matchers.hpp"

namespace hybrid_slam::test {
namespace {

using ::testing::HasSubstr;

World room() {
    World world;
    world.name = "room";
    const Points corners{{-6, -4}, {6, -4}, {6, 4}, {-6, 4}};
    for (std::size_t i = 0; i < 4; ++i) {
        world.walls.push_back({corners[i], corners[(i + 1) % 4]});
    }
    world.posts.push_back({{-2.0, 2.5}, 0.3});
    return world;
}

SimulatedDriveConfig clean() {
    SimulatedDriveConfig config;
    config.range_sigma = 0.0;
    config.dropout = 0.0;
    config.lidar_jitter = 0.0;
    config.camera = false;
    return config;
}

/// All that has come out of it.
struct Happenings {
    std::vector<LidarBytes> lidar;
    std::vector<CameraMoment> images;
    std::vector<TruckContact> contacts;
    std::vector<CanFrame> frames;

    void take(TruckWorld::Events events) {
        move_to(events.lidar, lidar);
        move_to(events.images, images);
        move_to(events.contacts, contacts);
        move_to(events.frames, frames);
    }

  private:
    template <typename What>
    static void move_to(std::vector<What>& from, std::vector<What>& to) {
        to.insert(to.end(), from.begin(), from.end());
    }
};

/// The same command fifty times a second.
Happenings drive(TruckWorld& truck, const DriveCommand& command, double from, double until) {
    const auto codec = make_drive_codec({}, {});
    Happenings run;
    for (long i = std::lround(from / 0.02); 0.02 * static_cast<double>(i) < until; ++i) {
        run.take(truck.advance(0.02 * static_cast<double>(i)));
        for (const CanFrame& frame : codec->encode(command, true)) {
            truck.receive(frame);
        }
    }
    return run;
}

/// Its scans as a source gives them.
class Stream : public SensorStream {
  public:
    explicit Stream(const std::vector<LidarBytes>& pieces) : pieces_(pieces) {}
    std::optional<SensorEvent> next() override {
        return next_ < pieces_.size() ? std::optional<SensorEvent>(pieces_[next_++]) : std::nullopt;
    }

  private:
    const std::vector<LidarBytes>& pieces_;
    std::size_t next_ = 0;
};

std::vector<Scan> scans_of(const std::vector<LidarBytes>& pieces, const RobotConfig& robot) {
    Stream stream(pieces);
    SensorSource source(stream, robot);
    std::vector<Scan> scans;
    while (auto measurement = source.next()) {
        scans.push_back(std::get<Scan>(std::move(*measurement)));
    }
    return scans;
}

TEST(TruckWorld, GoesWhereFramesTellIt) {
    TruckWorld truck(room(), {}, clean(), {-3, -1, 0});
    truck.advance(1.0);
    EXPECT_THAT(truck.state().world_from_robot, PoseNear(Pose2d(-3, -1, 0), 0.0, 0.0));
    EXPECT_FALSE(truck.driven());
    drive(truck, {0.3, 0.0}, 1.0, 9.0);
    EXPECT_TRUE(truck.driven());
    truck.advance(20.0);  // its own watchdog has stopped it
    EXPECT_FALSE(truck.driven());
    EXPECT_EQ(truck.state().speed, 0.0);
    EXPECT_EQ(truck.now(), 20.0);
    // 0.3 m/s for 8 s and until the watchdog; the ramps up and down make up for each other.
    EXPECT_NEAR(truck.state().world_from_robot.x(), -3 + 0.3 * 8.3, 0.02);
    EXPECT_NEAR(truck.distance(), truck.state().world_from_robot.x() + 3, 1e-9);
    EXPECT_NEAR(truck.worst_speed(), 0.3, 1e-3);
    drive(truck, {-0.3, 0.0}, 20.0, 24.0);
    EXPECT_GT(truck.distance(), 0.3 * 11.0) << "backwards counts too";
    truck.advance(3.0);
    EXPECT_GT(truck.now(), 20.0) << "never backwards";
}

TEST(TruckWorld, TellsTheBus) {
    TruckWorld truck(room(), {}, clean(), {});
    const Happenings run = drive(truck, {0.2, 0.3}, 0.0, 4.0);
    EXPECT_NEAR(static_cast<double>(run.frames.size()), 2.0 * 4.0 / 0.02, 4.0);
    const auto codec = make_drive_codec({}, {});
    DriveFeedback feedback;
    for (const CanFrame& frame : run.frames) {
        feedback = codec->decode(frame).value();
    }
    EXPECT_NEAR(feedback.speed.value(), 0.2, 2e-3);
    EXPECT_NEAR(feedback.steering.value(), 0.3, 1e-3);
}

TEST(TruckWorld, ItsScansAreCastFromWhereItWas) {
    RobotConfig robot;
    TruckWorld truck(room(), robot, clean(), {-2, -1, 0.3});
    const Happenings run = drive(truck, {0.3, 0.4}, 0.0, 12.0);
    const std::vector<Scan> scans = scans_of(run.lidar, robot);
    ASSERT_EQ(scans.size(), truck.truth().size());
    EXPECT_NEAR(static_cast<double>(scans.size()), 12.0 / 0.08, 2.0);
    const World world = room();
    const TrajectoryIndex index(truck.truth());
    double worst = 0.0;
    for (std::size_t i = 40; i + 1 < scans.size(); ++i) {
        const Scan& scan = scans[i];
        EXPECT_NEAR(scan.stamp, truck.truth()[i].stamp, 1e-4);
        for (std::size_t beam = 0; beam < scan.ranges.size(); beam += 27) {
            const double time = scan.stamp + static_cast<double>(beam) * scan.time_increment;
            const Pose2d laser = index.interpolated(time, 0.2).value() * scan.robot_from_laser;
            const double angle = laser.heading + scan.angle(beam);
            const double range = world.cast_ray(laser.translation,
                                                Eigen::Vector2d(std::cos(angle), std::sin(angle)));
            // Beside the post a hair of heading is far.
            const double error = std::abs(range - static_cast<double>(scan.ranges[beam]));
            worst = std::max(worst, error < 0.3 ? error : 0.0);
        }
    }
    EXPECT_LT(worst, 0.02);
    EXPECT_GT(worst, 0.004) << "centimetres are whole";
}

TEST(TruckWorld, PiecesComeWhenTheyArriveAndNotBefore) {
    SimulatedDriveConfig config = clean();
    config.lidar_jitter = 0.003;
    TruckWorld truck(room(), {}, config, {});
    double last = 0.0;
    std::size_t pieces = 0;
    for (int i = 1; i <= 3000; ++i) {
        const double now = 0.001 * i;
        for (const LidarBytes& piece : truck.advance(now).lidar) {
            EXPECT_LE(piece.arrival, now);
            EXPECT_GT(piece.arrival, now - 0.0011);
            EXPECT_GT(piece.arrival, last);
            last = piece.arrival;
            ++pieces;
            EXPECT_EQ(truck.truth().size(), pieces);
            EXPECT_LT(truck.truth().back().stamp, piece.arrival - 0.04);
        }
    }
    EXPECT_GT(pieces, 35U);
}

TEST(TruckWorld, StepsOfTheCallerDoNotMatter) {
    RobotConfig robot;
    SimulatedDriveConfig config;
    config.camera = false;
    World world = room();
    world.people.push_back({{{-1, -3}, {3, -3}}, 1.0, 0.2});
    const auto bytes_of_steps = [&](double step_size) {
        TruckWorld truck(world, robot, config, {1, 1, 2});
        Happenings run;
        for (int i = 1; i * step_size < 2.99; ++i) {
            run.take(truck.advance(i * step_size));
        }
        run.take(truck.advance(3.0));
        std::vector<std::uint8_t> bytes;
        for (const LidarBytes& piece : run.lidar) {
            bytes.insert(bytes.end(), piece.bytes.begin(), piece.bytes.end());
        }
        return bytes;
    };
    const auto fine = bytes_of_steps(0.001);
    EXPECT_EQ(fine, bytes_of_steps(0.02));
    EXPECT_EQ(fine, bytes_of_steps(0.0333));
    EXPECT_EQ(fine, bytes_of_steps(3.0));
    config.seed = 2;
    EXPECT_NE(fine, bytes_of_steps(3.0));
}

TEST(TruckWorld, ContactCountsOnceForEachTimeItBegins) {
    TruckWorld truck(room(), {}, clean(), {3.5, 0, 0});
    const Happenings ahead = drive(truck, {0.3, 0.0}, 0.0, 6.0);
    ASSERT_EQ(ahead.contacts.size(), 1U);
    const TruckContact& contact = ahead.contacts.front();
    EXPECT_EQ(contact.with, "wall 1");
    EXPECT_NEAR(contact.world_from_robot.x(), 4.5, 2e-3) << "the front is 1.5 m ahead";
    EXPECT_NEAR(contact.at.x(), 6.0, 1e-9);
    EXPECT_GT(contact.time, 3.3);
    EXPECT_GT(truck.state().world_from_robot.x(), 4.6) << "it goes on";
    const Happenings back = drive(truck, {-0.3, 0.0}, 6.0, 12.0);
    EXPECT_TRUE(back.contacts.empty());
    EXPECT_LT(truck.state().world_from_robot.x(), 4.4);
    EXPECT_EQ(drive(truck, {0.3, 0.0}, 12.0, 18.0).contacts.size(), 1U);
}

TEST(TruckWorld, SomebodyWhoWalksIntoItIsAContact) {
    World world = room();
    world.people.push_back({{{0, -3}, {0, 3}}, 1.0, 0.2});
    TruckWorld truck(world, {}, clean(), {0, 0, 0});
    Happenings run;
    run.take(truck.advance(6.0));
    ASSERT_EQ(run.contacts.size(), 1U);
    EXPECT_EQ(run.contacts[0].with, "person 0");
    EXPECT_NEAR(run.contacts[0].time, 3.0 - 0.45 - 0.2, 0.01);
}

TEST(TruckWorld, MomentsOfTheCameraAreThoseOfTheDrive) {
    SimulatedDriveConfig config = clean();
    config.camera = true;
    RobotConfig robot;
    TruckWorld truck(room(), robot, config, {-3, 0, 0});
    const Happenings run = drive(truck, {0.3, 0.0}, 0.0, 4.0);
    EXPECT_NEAR(static_cast<double>(run.images.size()), 4.0 * robot.camera.rate, 2.0);
    for (std::size_t i = 0; i < run.images.size(); ++i) {
        const CameraMoment& moment = run.images[i];
        EXPECT_EQ(moment.number, i);
        EXPECT_NEAR(moment.stamp, 0.02 + static_cast<double>(i) / robot.camera.rate, 1e-9);
        EXPECT_GE(moment.arrival, moment.stamp + robot.camera.latency);
        EXPECT_LE(moment.arrival, moment.stamp + robot.camera.latency + config.camera_jitter);
    }
    EXPECT_NEAR(run.images.back().twist.x(), 0.3, 1e-3);
    robot.camera.enabled = false;
    TruckWorld blind(room(), robot, config, {});
    EXPECT_TRUE(blind.advance(1.0).images.empty());
}

TEST(TruckWorld, TheRendererMakesTheImagesOfASimulatedVehicle) {
    World world = room();
    world.path = {{-3, 0}, {-2, 0}};
    RobotConfig robot;
    robot.camera.model.width = 64;
    robot.camera.model.height = 48;
    robot.camera.model.fx = robot.camera.model.fy = 60.0;
    robot.camera.model.cx = 31.5;
    robot.camera.model.cy = 23.5;
    SimulatedDriveConfig config;
    SimulatedVehicle vehicle(world, "", robot, config);
    TruckWorld truck(world, robot, config, {-3, 0, 0});
    MomentRenderer renderer(world, robot.camera, config);
    // Both stand still in the first half second.
    std::size_t same = 0;
    for (const CameraMoment& moment : truck.advance(0.4).images) {
        auto event = vehicle.next();
        while (!std::holds_alternative<CameraFrame>(*event)) {
            event = vehicle.next();
        }
        const auto& frame = std::get<CameraFrame>(*event);
        EXPECT_EQ(frame.arrival, moment.arrival);
        EXPECT_EQ(frame.image, renderer.render(moment));
        ++same;
    }
    EXPECT_GT(same, 8U);
}

TEST(TruckWorld, StandingItSpeaksAsASimulatedVehicleDoes) {
    World world = room();
    world.path = {{-3, 0}, {-2, 0}};
    world.people.push_back({{{-1, -3}, {3, -3}}, 1.0, 0.2});
    SimulatedDriveConfig config;
    config.camera = false;
    SimulatedVehicle vehicle(world, "", {}, config);
    TruckWorld truck(world, {}, config, {-3, 0, 0});
    const std::vector<LidarBytes> pieces = truck.advance(0.5).lidar;
    EXPECT_GE(pieces.size(), 5U);
    for (const LidarBytes& piece : pieces) {
        const auto expected = std::get<LidarBytes>(vehicle.next().value());
        EXPECT_EQ(piece.arrival, expected.arrival);
        EXPECT_EQ(piece.bytes, expected.bytes);
    }
}

TEST(TruckWorld, RefusesWhatCannotBeSimulated) {
    SimulatedDriveConfig config = clean();
    config.dropout = 2.0;
    EXPECT_THAT(error_of([&] { TruckWorld truck(room(), {}, config, {}); }), HasSubstr("dropout"));
    RobotConfig robot;
    robot.lidar.protocol = LidarProtocol::kThesisWords;
    EXPECT_THAT(error_of([&] { TruckWorld truck(room(), robot, clean(), {}); }),
                HasSubstr("lidar.protocol"));
    robot = {};
    robot.vehicle.wheelbase = 0.01;
    EXPECT_THAT(error_of([&] { TruckWorld truck(room(), robot, clean(), {}); }),
                HasSubstr("wheelbase"));
}

}  // namespace
}  // namespace hybrid_slam::test
