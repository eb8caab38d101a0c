// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <chrono>
#include <csignal>
#include <fstream>
#include <thread>

#include "hybrid_slam/link/link_client.hpp"
#include "hybrid_slam/link/link_server.hpp"
#include "navigation/bus_log.hpp"
#include "navigation/tour.hpp"
#include "support/error_of.hpp"

/// What the system test itself stands on.
namespace hybrid_slam::test {
namespace {

using ::testing::HasSubstr;

TEST(Process, ItsCodeItsWordsAndItsEnd) {
    const WorkFolder folder;
    EXPECT_EQ(run_process({"/bin/sh", "-c", "echo so; exit 3"}, folder.path(), folder.path() / "o"),
              3);
    EXPECT_EQ(contents_of(folder.path() / "o"), "so\n");
    Process sleeper({"/bin/sh", "-c", "echo at 127.0.0.1:80; exec sleep 100"}, folder.path(),
                    folder.path() / "o");
    EXPECT_EQ(sleeper.wait_for("at "), "127.0.0.1:80");
    EXPECT_FALSE(sleeper.wait(0.05));
    sleeper.send(SIGTERM);
    EXPECT_EQ(sleeper.wait(10.0), 128 + SIGTERM);
    EXPECT_THAT(error_of([&] { sleeper.wait_for("never"); }), HasSubstr("does not say 'never'"));
    Process none({"/no/such/program"}, folder.path(), folder.path() / "o");
    EXPECT_EQ(none.wait(10.0), 127);
}

/// Or a zombie, until somebody reaps it.
bool is_gone(int process) {
    std::ifstream stat("/proc/" + std::to_string(process) + "/stat");
    std::string word;
    for (int i = 0; i < 3; ++i) {
        stat >> word;
    }
    return !stat || word == "Z" || word == "X";
}

TEST(Process, NothingOutlivesItsOwner) {
    const WorkFolder folder;
    int child = 0;
    {
        Process shell({"/bin/sh", "-c", "sleep 100 & echo pid $!; wait"}, folder.path(),
                      folder.path() / "o");
        child = std::stoi(shell.wait_for("pid "));
        EXPECT_EQ(kill(child, 0), 0);
    }
    bool gone = false;
    for (int i = 0; i < 2000 && !gone; ++i) {  // the kernel takes its time
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
        gone = is_gone(child);
    }
    EXPECT_TRUE(gone);
}

/// Commands (id 203, 1/min) and feedbacks (id 183) of a truck that is told to stand at 100 ms.
std::filesystem::path write_bus(const std::filesystem::path& folder) {
    const auto file = folder / "bus.log";
    std::ofstream(file) << "(10.019000) can0 383#0000000000000000\n"  // the wheel is straight
                           "(10.020000) can0 183#640000000050FA00\n"
                           "(10.021000) can0 203#0364000A0A000000\n"
                           "(10.040500) can0 183#640000000050FA00\n"
                           "(10.080000) can0 203#0364000A0A000000\n"
                           "(10.100000) can0 203#0100000A0A000000\n"
                           "(10.120000) can0 183#320000000050FA00\n"
                           "(10.140000) can0 183#000000000050FA00\n"
                           "(10.160000) can0 203#0301000A0A000000\n";
    return file;
}

TEST(BusLog, WhenItIsToldToStandAndWhatFollows) {
    const WorkFolder folder;
    const std::vector<BusMoment> bus = read_bus(write_bus(folder.path()));
    ASSERT_EQ(bus.size(), 8U);
    EXPECT_EQ(bus[1].value, 100.0);
    EXPECT_TRUE(bus[1].is_command);
    // 100 turns a minute of the motor, by gear 21.96 and a wheel of 0.15 m.
    const double speed = 100.0 / 60.0 / 21.96 * 2.0 * kPi * 0.15;
    EXPECT_NEAR(speed_at(bus, 10'050'000), speed, 1e-6);
    EXPECT_EQ(speed_at(bus, 1), 0.0);
    EXPECT_EQ(epoch_of(bus), 10'000'000);
    const Stopping stopping = stopping_after(bus, 10'030'000, 10'025'000);
    EXPECT_NEAR(stopping.speed_before, speed, 1e-6);
    ASSERT_TRUE(stopping.seconds);
    EXPECT_NEAR(*stopping.seconds, 0.075, 1e-9);
    EXPECT_NEAR(stopping.rolled, 0.02 * 0.5 * speed, 1e-6);
    EXPECT_EQ(stopping.moved_later, 1);
    EXPECT_FALSE(stopping_after(bus, 10'150'000, 10'150'000).seconds);
}

LinkPose pose_at(double stamp, double x) {
    LinkPose pose;
    pose.stamp = stamp;
    pose.status = LinkPoseStatus::kTracking;
    pose.map_from_robot = Pose2d(x, 0.0, 0.0);
    return pose;
}

/// The next pose that comes, sent again and again.
LinkPose heard_of(LinkClient& client, LinkServer& server, const LinkPose& pose) {
    for (int i = 0; i < 200; ++i) {
        client.send(pose);
        for (const LinkEvent& event : server.events(0.05)) {
            if (const auto* const heard = std::get_if<LinkPose>(&event.what)) {
                return *heard;
            }
        }
    }
    ADD_FAILURE() << "no pose came";
    return {};
}

TEST(PoseRelay, PassesOnFreezesAndCuts) {
    LinkServerConfig config;
    config.listen = "127.0.0.1:0";
    LinkServer server(config);
    PoseRelay relay(server.endpoint().port);
    LinkClientConfig client_config;
    client_config.server = "127.0.0.1:" + std::to_string(relay.port());
    LinkClient client(client_config, LinkRole::kPose);
    ASSERT_TRUE(client.wait_connected(30.0));
    EXPECT_EQ(heard_of(client, server, pose_at(1.0, 0.5)).map_from_robot.x(), 0.5);
    EXPECT_TRUE(relay.passed().back().genuine);
    EXPECT_TRUE(relay.passed().back().known);
    while (!server.events(0.2).empty()) {
    }
    relay.set(RelayMode::kRepeatOld);
    const LinkPose old = heard_of(client, server, pose_at(2.0, 0.7));
    EXPECT_EQ(old.stamp, 1.0);
    EXPECT_EQ(old.map_from_robot.x(), 0.5);
    EXPECT_FALSE(relay.passed().back().genuine);
    while (!server.events(0.2).empty()) {
    }
    relay.set(RelayMode::kRepeatNew);
    const LinkPose restamped = heard_of(client, server, pose_at(3.0, 0.9));
    EXPECT_EQ(restamped.stamp, 3.0);
    EXPECT_EQ(restamped.map_from_robot.x(), 0.5);
    while (!server.events(0.2).empty()) {
    }
    relay.set(RelayMode::kSilent);
    client.send(pose_at(4.0, 1.0));
    EXPECT_TRUE(server.events(0.3).empty());
    relay.set(RelayMode::kClosed);
    bool gone = false;
    for (int i = 0; i < 100 && !gone; ++i) {
        for (const LinkEvent& event : server.events(0.1)) {
            gone = gone || std::holds_alternative<LinkDisconnected>(event.what);
        }
    }
    EXPECT_TRUE(gone);
}

TEST(TrueClearance, OfTheOutlineAndNotOfTheMiddle) {
    World world;
    world.walls = {{{4.0, -5.0}, {4.0, 5.0}}};
    world.posts = {{{0.0, 2.0}, 0.25}};
    const VehicleConfig truck;  // 1.5 m ahead, 1.1 m behind, 0.9 m wide
    EXPECT_NEAR(true_clearance(world, truck, {0.0, 0.0, 0.0}), 2.0 - 0.25 - 0.45, 1e-9);
    EXPECT_NEAR(true_clearance(world, truck, {2.0, 0.0, 0.0}), 0.5, 1e-9);
    EXPECT_NEAR(true_clearance(world, truck, {2.0, 0.0, kPi}), 0.9, 1e-9);
    EXPECT_EQ(true_clearance(world, truck, {3.0, 0.0, 0.0}), 0.0) << "through the wall";
    EXPECT_EQ(true_clearance(world, truck, {0.0, 2.0, 0.3}), 0.0) << "about the post";
}

TEST(TourErrors, AreThoseOfTheThreeMoments) {
    Trajectory truth;
    for (int i = 0; i <= 100; ++i) {
        const double share = 0.01 * i;
        truth.push_back({0.1 * i, {2.6 * share, -0.15, 0.0}});  // passes the first place half way
    }
    Trajectory estimate = truth;
    estimate.front().pose.translation.x() += 0.03;
    estimate[50].pose.translation.y() -= 0.02;
    estimate.back().pose.translation.x() -= 0.01;
    const TourErrors errors = tour_errors(estimate, truth);
    EXPECT_NEAR(errors.start, 0.03, 1e-9);
    EXPECT_NEAR(errors.first, 0.02, 1e-9);
    EXPECT_NEAR(errors.second, 0.01, 1e-9);
}

}  // namespace
}  // namespace hybrid_slam::test
