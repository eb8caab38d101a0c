// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <optional>
#include <thread>
#include <vector>

#include "hybrid_slam/lockstep/lockstep_client.hpp"
#include "hybrid_slam/lockstep/lockstep_server.hpp"
#include "support/error_of.hpp"
#include "talk.hpp"

namespace hybrid_slam::test {
namespace {

using ::testing::HasSubstr;

constexpr double kLong = 30.0;  // seconds: only a broken test waits for so long

LockstepTick tick_at(double now) {
    return {now, false, 0};
}

/// A server with both clients, of which each says what the test wants.
struct Clock {
    explicit Clock(double patience = kLong)
        : server(std::in_place, ":0", patience), sensors(server->url()), drive(server->url()) {
        sensors.say("hello sensors 1\n");
        drive.say("hello drive 1\n");
        EXPECT_TRUE(server->wait_for_clients(kLong));
    }
    std::optional<LockstepServer> server;
    Talker sensors;
    Talker drive;
};

TEST(Lockstep, TheDriveGetsTheTicksAndTheServerItsFrames) {
    std::optional<LockstepServer> server(std::in_place);
    Talker sensors(server->url());
    sensors.say("hello sensors 1\n");
    std::vector<LockstepTick> ticks;
    std::thread drive([&ticks, url = server->url()] {
        LockstepDriveClock clock(url);
        while (const auto tick = clock.next(kLong)) {
            ticks.push_back(*tick);
            clock.done(ticks.size() % 3);
        }
        EXPECT_TRUE(clock.ended());
        EXPECT_FALSE(clock.next(kLong)) << "and stays so";
    });
    ASSERT_TRUE(server->wait_for_clients(kLong));
    // Thirds have no exact form in any base: the very same number must arrive all the same.
    const auto time_of = [](std::size_t i) { return static_cast<double>(i) / 3.0; };
    for (std::size_t i = 1; i <= 50; ++i) {
        EXPECT_EQ(server->tick({time_of(i), i % 4 == 0, i}), i % 3);
    }
    EXPECT_EQ(server->counts().ticks, 50U);
    server.reset();
    drive.join();
    ASSERT_EQ(ticks.size(), 50U);
    for (std::size_t i = 1; i <= 50; ++i) {
        EXPECT_EQ(ticks[i - 1].now, time_of(i));
        EXPECT_EQ(ticks[i - 1].pose_due, i % 4 == 0);
        EXPECT_EQ(ticks[i - 1].frames, i);
    }
}

TEST(Lockstep, TheSensorsGetTheArrivalsInTheirOrder) {
    LockstepServer server;
    Talker drive(server.url());
    drive.say("hello drive 1\n");
    std::optional<LockstepSensorClock> sensors(std::in_place, server.url());
    ASSERT_TRUE(server.wait_for_clients(kLong));
    server.lidar(0.1, 1234);
    server.image(0.125);
    const auto lidar = sensors->next(kLong);
    ASSERT_TRUE(lidar);
    EXPECT_EQ(lidar->what, LockstepArrival::What::kLidar);
    EXPECT_EQ(lidar->arrival, 0.1);
    EXPECT_EQ(lidar->bytes, 1234U);
    const auto image = sensors->next(kLong);
    ASSERT_TRUE(image);
    EXPECT_EQ(image->what, LockstepArrival::What::kImage);
    EXPECT_EQ(image->arrival, 0.125);
    EXPECT_FALSE(sensors->next(0.01)) << "nothing yet";
    EXPECT_FALSE(sensors->ended());
    EXPECT_EQ(server.counts().lidar, 1U);
    EXPECT_EQ(server.counts().images, 1U);
}

TEST(Lockstep, TheServerWaitsUntilAllIsRead) {
    LockstepServer server;
    Talker drive(server.url());
    drive.say("hello drive 1\n");
    std::atomic<int> read = 0;
    std::thread sensors([&read, url = server.url()] {
        LockstepSensorClock clock(url);
        while (const auto arrival = clock.next(kLong)) {
            std::this_thread::sleep_for(std::chrono::milliseconds(5));
            ++read;
            clock.done();
            if (read == 6) {
                return;
            }
        }
    });
    ASSERT_TRUE(server.wait_for_clients(kLong));
    server.wait_until_read();
    for (int i = 1; i <= 3; ++i) {
        server.lidar(i, 10);
        server.image(i);
        server.wait_until_read();
        EXPECT_EQ(read, 2 * i);
    }
    sensors.join();
}

TEST(Lockstep, NeedsBothClientsAndTurnsOthersAway) {
    LockstepServer server;
    EXPECT_FALSE(server.wait_for_clients(0.0));
    Talker nobody(server.url());
    nobody.say("GET / HTTP/1.1\n");
    Talker sensors(server.url());
    sensors.say("hello sensors 1\n");
    EXPECT_FALSE(server.wait_for_clients(0.1));
    EXPECT_EQ(nobody.line(), "refused");
    EXPECT_EQ(nobody.line(), "") << "hung up";
    LockstepSensorClock second(server.url());
    EXPECT_FALSE(server.wait_for_clients(0.1));
    EXPECT_THAT(error_of([&] { second.next(kLong); }), HasSubstr("somebody else"));
    Talker drive(server.url());
    drive.say("hello drive 1\n");
    EXPECT_TRUE(server.wait_for_clients(kLong));
}

TEST(Lockstep, SensorsThatGoLeaveTheDriveAlone) {
    Clock clock;
    clock.drive.say("done 0\ndone 0\n");
    {
        const LockstepTick due{0.02, true, 0};
        clock.server->tick(due);
        EXPECT_EQ(clock.drive.line(), "tick 0.02 1 0");
    }
    clock.sensors.hang_up();
    clock.server->lidar(0.03, 10);
    clock.server->wait_until_read();
    EXPECT_TRUE(clock.server->counts().sensors_gone);
    clock.server->lidar(0.04, 10);
    clock.server->wait_until_read();
    clock.server->tick({0.04, true, 0});
    EXPECT_EQ(clock.drive.line(), "tick 0.04 0 0") << "nobody is left who makes a pose";
}

TEST(Lockstep, ADriveThatGoesEndsTheRun) {
    Clock clock;
    clock.drive.hang_up();
    EXPECT_THROW(clock.server->tick(tick_at(0.02)), LockstepClosed);
    EXPECT_THROW(clock.server->tick(tick_at(0.04)), LockstepClosed);
    EXPECT_EQ(clock.server->counts().ticks, 0U);
}

TEST(Lockstep, PatienceEndsWithAReason) {
    Clock clock(0.05);
    EXPECT_THAT(error_of([&] {
                    clock.server->tick({1.5, true, 0});
                }),
                HasSubstr("at 1.50 s (it waits for a pose)"));
    Clock slow(0.05);
    int meanwhile = 0;
    EXPECT_THAT(error_of([&] { slow.server->tick(tick_at(2.0), [&] { ++meanwhile; }); }),
                HasSubstr("no answer of the drive for 0.05 s"));
    EXPECT_GT(meanwhile, 1);
    slow.server->lidar(0.1, 5);
    EXPECT_THAT(error_of([&] { slow.server->wait_until_read(); }), HasSubstr("has not read"));
}

TEST(Lockstep, NonsenseIsAnErrorOnEitherSide) {
    for (const char* answer :
         {"ready\n", "done\n", "done x\n", "done -1\n", "done 1 2\n", "done 99999999999\n"}) {
        Clock clock;
        clock.drive.say(answer);
        EXPECT_THROW(clock.server->tick(tick_at(0.02)), Error) << answer;
    }
    Clock endless;
    endless.drive.say(std::string(5000, 'x'));
    EXPECT_THROW(endless.server->tick(tick_at(0.02)), LockstepClosed);
    for (const char* line : {"tock 1 1 0", "tick 1 1", "tick x 1 0", "tick nan 1 0"}) {
        Listener listener;
        LockstepDriveClock clock(listener.url());
        listener.accept();
        listener.say(std::string(line) + "\n");
        EXPECT_THROW(clock.next(kLong), Error) << line;
    }
    for (const char* line : {"lidar 1", "lidar 1 x", "image", "image inf", "picture 1"}) {
        Listener listener;
        LockstepSensorClock clock(listener.url());
        listener.accept();
        listener.say(std::string(line) + "\n");
        EXPECT_THROW(clock.next(kLong), Error) << line;
    }
}

TEST(Lockstep, NobodyThereIsAnErrorThatNamesTheClock) {
    std::string url;
    { url = LockstepServer().url(); }
    EXPECT_THAT(error_of([&] { LockstepDriveClock clock(url); }), HasSubstr(url));
    EXPECT_THAT(error_of([&] { LockstepServer server("not a place"); }), HasSubstr("not a place"));
}

}  // namespace
}  // namespace hybrid_slam::test
