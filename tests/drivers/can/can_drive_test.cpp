// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/can/can_drive.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>

#include "frames.hpp"
#include "hybrid_slam/can/slcan_terminal.hpp"
#include "hybrid_slam/can/truck_can.hpp"
#include "hybrid_slam/core/stopwatch.hpp"
#include "support/error_of.hpp"
#include "support/temp_folder.hpp"

namespace hybrid_slam {
namespace {

using test::error_of;
using test::frame;
using ::testing::AllOf;
using ::testing::HasSubstr;

/// False after a time that only a broken program needs.
bool eventually(const std::function<bool()>& done) {
    for (int i = 0; i < 4000; ++i) {
        if (done()) {
            return true;
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return false;
}

/// A truck, and a wire to it that can be cut. For two threads: the bus's and the test's.
struct Yard {
    Yard() : truck({}, {}, {}, steady_seconds()) {}

    std::mutex mutex;
    TruckCan truck;
    std::vector<CanFrame> sent;
    std::vector<CanFrame> told;
    std::string fault;
    bool mute = false;
    int busy = 0;                               ///< frames that are not taken
    std::vector<CanFrame>* survivor = nullptr;  ///< what is sent, for after the end

    CanFrame last() {
        const std::lock_guard<std::mutex> lock(mutex);
        return sent.empty() ? CanFrame() : sent.back();
    }
    std::size_t count() {
        const std::lock_guard<std::mutex> lock(mutex);
        return sent.size();
    }
    double speed() {
        const std::lock_guard<std::mutex> lock(mutex);
        return truck.state().speed;
    }
    void change(const std::function<void(Yard&)>& how) {
        const std::lock_guard<std::mutex> lock(mutex);
        how(*this);
    }
};

class YardBus : public CanBus {
  public:
    explicit YardBus(Yard& yard) : yard_(yard) {}

    bool send(const CanFrame& frame) override {
        const std::lock_guard<std::mutex> lock(yard_.mutex);
        fault_ = yard_.fault;
        if (!fault_.empty()) {
            ++counts_.dropped;
            return false;
        }
        ++counts_.sent;
        yard_.sent.push_back(frame);
        keep(yard_.truck.receive(frame, steady_seconds()));
        return true;
    }
    std::optional<CanFrame> receive(double timeout) override {
        for (const double end = steady_seconds() + timeout; steady_seconds() < end;) {
            {
                const std::lock_guard<std::mutex> lock(yard_.mutex);
                fault_ = yard_.fault;
                keep(yard_.truck.advance(steady_seconds()));
                if (!fault_.empty()) {
                    return std::nullopt;
                }
                if (!yard_.told.empty()) {
                    const CanFrame frame = yard_.told.front();
                    yard_.told.erase(yard_.told.begin());
                    ++counts_.received;
                    return frame;
                }
            }
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }
        return std::nullopt;
    }

  private:
    void keep(const std::vector<CanFrame>& frames) {
        if (!yard_.mute) {
            yard_.told.insert(yard_.told.end(), frames.begin(), frames.end());
        }
    }

    Yard& yard_;
};

CanDrive drive_in(Yard& yard, const CanDriveConfig& config = {}) {
    return {std::make_unique<YardBus>(yard), config, VehicleConfig()};
}

/// Commands for as long as `done` needs.
bool commanding(CanDrive& drive, const DriveCommand& command, const std::function<bool()>& done) {
    return eventually([&] {
        drive.set_command(command);
        return done();
    });
}

CanDriveConfig quick_release() {
    CanDriveConfig config;
    config.release_after = 0.1;
    return config;
}

TEST(CanDrive, NothingMovesUntilACommandComes) {
    Yard yard;
    const CanDrive drive = drive_in(yard);
    EXPECT_TRUE(eventually([&] { return yard.count() > 10; }));
    EXPECT_EQ(drive.status().state, CanDriveState::kOff);
    EXPECT_EQ(yard.last(), frame("203#0000000000000000"));
    yard.change([](Yard& y) { EXPECT_EQ(y.sent.front(), frame("000#0103")) << "the start"; });
    EXPECT_TRUE(eventually([&] { return drive.status().feedback.speed.has_value(); }));
    EXPECT_LT(drive.status().feedback_age, 20.0);
}

TEST(CanDrive, DrivesWhileCommandsComeThenStopsThenReleases) {
    Yard yard;
    CanDrive drive = drive_in(yard, quick_release());
    EXPECT_TRUE(commanding(drive, {0.2, 0.1}, [&] { return std::abs(yard.speed() - 0.2) < 1e-3; }));
    const CanDriveStatus status = drive.status();
    EXPECT_EQ(status.state, CanDriveState::kDriving);
    EXPECT_EQ(status.sent.speed, 0.2);
    EXPECT_EQ(status.reason, "");
    EXPECT_TRUE(eventually([&] { return drive.status().state == CanDriveState::kOff; }));
    EXPECT_TRUE(eventually([&] { return yard.last() == frame("203#0000000000000000"); }));
    // On the way: speed zero with the interlock on and the wheel where it was (5.73 degrees).
    yard.change(
        [](Yard& y) { EXPECT_THAT(y.sent, ::testing::Contains(frame("203#0100000A0A3D0200"))); });
    EXPECT_TRUE(eventually([&] { return yard.speed() == 0.0; }));
}

TEST(CanDrive, StopStopsThoughTheCommandStillHolds) {
    CanDriveConfig config;
    config.command_valid = 2.0;
    Yard yard;
    CanDrive drive = drive_in(yard, config);
    EXPECT_TRUE(commanding(drive, {0.2, 0.0}, [&] { return yard.speed() > 0.05; }));
    drive.stop();
    EXPECT_TRUE(eventually([&] { return drive.status().state == CanDriveState::kStopping; }));
    EXPECT_EQ(drive.status().sent.speed, 0.0);
}

TEST(CanDrive, CommandsThatAreNotFiniteStopToo) {
    CanDriveConfig config;
    config.command_valid = 2.0;
    Yard yard;
    CanDrive drive = drive_in(yard, config);
    EXPECT_TRUE(commanding(drive, {0.2, 0.0}, [&] { return yard.speed() > 0.05; }));
    EXPECT_THAT(error_of([&] { drive.set_command({NAN, 0.0}); }), HasSubstr("finite"));
    EXPECT_TRUE(eventually([&] { return drive.status().state == CanDriveState::kStopping; }));
}

TEST(CanDrive, ATruckThatIsSilentIsNotDriven) {
    Yard yard;
    yard.mute = true;
    CanDriveConfig config;
    config.feedback_valid = 0.2;
    CanDrive drive = drive_in(yard, config);
    EXPECT_TRUE(commanding(drive, {0.2, 0.0}, [&] {
        return drive.status().state == CanDriveState::kHeld && yard.count() > 20;
    }));
    EXPECT_EQ(drive.status().reason, "the truck is silent");
    EXPECT_TRUE(std::isinf(drive.status().feedback_age));
    EXPECT_EQ(yard.speed(), 0.0);
    yard.change([](Yard& y) { y.mute = false; });
    EXPECT_TRUE(commanding(drive, {0.2, 0.0}, [&] { return yard.speed() > 0.05; }));
    yard.change([](Yard& y) { y.mute = true; });
    EXPECT_TRUE(commanding(drive, {0.2, 0.0}, [&] { return yard.speed() == 0.0; }));
}

TEST(CanDrive, AFaultOfTheTruckHoldsIt) {
    Yard yard;
    CanDrive drive = drive_in(yard);
    EXPECT_TRUE(commanding(drive, {0.2, 0.0}, [&] { return yard.speed() > 0.05; }));
    yard.change([](Yard& y) { y.truck.set_fault(23); });
    EXPECT_TRUE(commanding(drive, {0.2, 0.0},
                           [&] { return drive.status().state == CanDriveState::kHeld; }));
    EXPECT_EQ(drive.status().reason, "the drive reports fault 23");
    EXPECT_EQ(drive.status().sent.speed, 0.0);
    yard.change([](Yard& y) { y.truck.set_fault(0); });
    EXPECT_TRUE(commanding(drive, {0.2, 0.0},
                           [&] { return drive.status().state == CanDriveState::kDriving; }));
}

TEST(CanDrive, ABrokenBusIsSaidAndStaysSo) {
    Yard yard;
    CanDrive drive = drive_in(yard);
    EXPECT_TRUE(commanding(drive, {0.2, 0.0}, [&] { return yard.speed() > 0.05; }));
    yard.change([](Yard& y) { y.fault = "can0: bus off"; });
    EXPECT_TRUE(eventually([&] { return drive.status().state == CanDriveState::kFault; }));
    yard.change([](Yard& y) { y.fault.clear(); });
    const std::size_t count = yard.count();
    drive.set_command({0.2, 0.0});
    std::this_thread::sleep_for(std::chrono::milliseconds(60));
    EXPECT_EQ(drive.status().reason, "can0: bus off");
    EXPECT_EQ(yard.count(), count) << "nothing is sent any more";
    EXPECT_EQ(drive.status().sent.speed, 0.0);
}

TEST(CanDrive, TheLastFramesStopTheTruck) {
    CanDriveConfig config;
    config.command_valid = 2.0;
    Yard yard;
    {
        CanDrive drive = drive_in(yard, config);
        EXPECT_TRUE(commanding(drive, {0.2, 0.0}, [&] { return yard.speed() > 0.05; }));
    }
    ASSERT_GT(yard.count(), 2U);
    EXPECT_EQ(yard.sent[yard.sent.size() - 2], frame("203#0100000A0A000000"));
    EXPECT_EQ(yard.last(), frame("203#0000000000000000"));
}

TEST(CanDrive, ADryRunDrivesWithoutATruck) {
    const test::TempFolder folder;
    CanDriveConfig config;
    config.bus.port = "candump:" + (folder / "dry.log").string();
    config.feedback_valid = 0.05;
    CanDrive drive(open_can_bus(config.bus), config, VehicleConfig());
    EXPECT_TRUE(commanding(drive, {0.2, 0.0}, [&] { return drive.status().counts.sent > 50; }));
    EXPECT_EQ(drive.status().state, CanDriveState::kDriving);
    std::size_t starts = 0;
    std::size_t commands = 0;
    for (const CandumpLine& line : read_candump(folder / "dry.log")) {
        starts += line.frame == frame("000#0103") ? 1 : 0;
        commands += line.frame == frame("203#0318010A0A000000") ? 1 : 0;  // 280 rpm
    }
    EXPECT_EQ(starts, 1U);
    EXPECT_GT(commands, 40U);
}

TEST(CanDrive, RefusesAConfigThatDoesNotWork) {
    Yard yard;
    CanDriveConfig config;
    config.rate = 0.0;
    EXPECT_THAT(error_of([&] { drive_in(yard, config); }), HasSubstr("rate"));
    config.rate = 50.0;
    config.layout.profile = DriveProfile::kCia402;
    config.layout.steering_node = config.layout.node;
    EXPECT_THAT(error_of([&] { drive_in(yard, config); }), HasSubstr("steering_node"));
}

/// All of it, through a real terminal: a truck behind an SLCAN adapter that can be pulled out.
class PulledAdapter : public ::testing::TestWithParam<DriveProfile> {};

TEST_P(PulledAdapter, TheTruckStopsByItselfAndTheDriveSaysWhy) {
    CanDriveConfig config;
    config.layout.profile = GetParam();
    std::optional<SlcanTerminal> terminal(std::in_place);
    config.bus.port = "slcan:" + terminal->path();
    std::atomic<bool> pull{false};
    std::atomic<bool> end{false};
    std::atomic<double> speed{0.0};
    std::thread world([&] {
        TruckCan truck(config.layout, {}, {}, steady_seconds());
        while (!end) {
            std::vector<CanFrame> told;
            if (pull) {
                terminal.reset();
                std::this_thread::sleep_for(std::chrono::milliseconds(5));
            } else {
                for (const CanFrame& heard : terminal->receive(0.005)) {
                    const auto answer = truck.receive(heard, steady_seconds());
                    told.insert(told.end(), answer.begin(), answer.end());
                }
            }
            const auto more = truck.advance(steady_seconds());
            told.insert(told.end(), more.begin(), more.end());
            for (std::size_t i = 0; terminal && i < told.size(); ++i) {
                terminal->send(told[i]);
            }
            speed = truck.state().speed;
        }
    });
    {
        CanDrive drive(open_can_bus(config.bus), config, VehicleConfig());
        EXPECT_TRUE(commanding(drive, {-0.2, 0.0}, [&] { return speed < -0.15; }));
        EXPECT_LT(drive.status().feedback.speed.value_or(0.0), 0.0);
        pull = true;
        EXPECT_TRUE(commanding(drive, {-0.2, 0.0},
                               [&] { return drive.status().state == CanDriveState::kFault; }));
        EXPECT_THAT(drive.status().reason, AllOf(HasSubstr("slcan:"), HasSubstr("unplugged")));
        EXPECT_TRUE(commanding(drive, {-0.2, 0.0}, [&] { return speed == 0.0; }));
    }
    end = true;
    world.join();
}

INSTANTIATE_TEST_SUITE_P(Profiles, PulledAdapter,
                         ::testing::Values(DriveProfile::kCurtis, DriveProfile::kCia402));

/// A bus that forgets nothing and waits for nobody.
class PatientBus : public CanBus {
  public:
    explicit PatientBus(Yard& yard) : yard_(yard) {}

    bool send(const CanFrame& frame) override {
        if (yard_.busy > 0) {
            --yard_.busy;
            return false;
        }
        (yard_.survivor != nullptr ? *yard_.survivor : yard_.sent).push_back(frame);
        return true;
    }
    std::optional<CanFrame> receive(double /*timeout*/) override {
        if (yard_.told.empty()) {
            return std::nullopt;
        }
        const CanFrame frame = yard_.told.front();
        yard_.told.erase(yard_.told.begin());
        return frame;
    }

  private:
    Yard& yard_;
};

/// A drive, its truck and their clock, all stepped.
struct SteppedYard {
    explicit SteppedYard(const CanDriveConfig& config = {})
        : drive(std::make_unique<PatientBus>(yard), config, {}, [this] { return now; }),
          truck({}, {}, {}, 0.0) {}

    /// Seconds of cycles at 50 Hz; commands are given at each while there is one.
    void run(double seconds, std::optional<DriveCommand> command) {
        for (const double end = now + seconds; now < end - 1e-9;) {
            now += 0.02;
            if (command) {
                drive.set_command(*command);
            }
            const std::size_t before = yard.sent.size();
            drive.step();
            for (std::size_t i = before; i < yard.sent.size(); ++i) {
                keep(truck.receive(yard.sent[i], now));
            }
            keep(truck.advance(now));
        }
    }
    void keep(const std::vector<CanFrame>& frames) {
        for (const CanFrame& frame : frames) {
            if (frame.id != loses) {
                yard.told.push_back(frame);
            }
        }
    }

    Yard yard;
    std::uint32_t loses = 0;  ///< id of what does not arrive
    double now = 0.0;
    CanDrive drive;
    TruckCan truck;
};

TEST(CanDrive, GoesByTheClockThatItIsGiven) {
    SteppedYard stepped;
    stepped.run(3.0, DriveCommand{0.3, 0.0});
    EXPECT_EQ(stepped.drive.status().state, CanDriveState::kDriving);
    EXPECT_NEAR(stepped.truck.state().speed, 0.3, 0.005);
    const double driven = stepped.truck.state().world_from_robot.x();
    stepped.run(1.0, std::nullopt);
    EXPECT_EQ(stepped.drive.status().state, CanDriveState::kStopping);
    EXPECT_NEAR(stepped.truck.state().speed, 0.0, 1e-6);
    // 0.2 s that the command holds, then 0.3 m/s taken off at 0.5 m/s^2 at most.
    EXPECT_LT(stepped.truck.state().world_from_robot.x() - driven, 0.3 * 0.22 + 0.09 + 0.02);
    SteppedYard again;
    again.run(3.0, DriveCommand{0.3, 0.0});
    again.run(1.0, std::nullopt);
    EXPECT_TRUE(again.yard.sent == stepped.yard.sent);
}

TEST(CanDrive, AFaultThatIsOverAtOnceIsSeenAllTheSame) {
    SteppedYard stepped;
    stepped.run(2.0, DriveCommand{0.3, 0.0});
    stepped.truck.set_fault(23);
    stepped.run(0.02, DriveCommand{0.3, 0.0});
    stepped.truck.set_fault(0);
    stepped.run(0.1, DriveCommand{0.3, 0.0});
    EXPECT_EQ(stepped.drive.status().reason, "the drive reports fault 23");
    EXPECT_EQ(stepped.drive.status().sent.speed, 0.0);
    stepped.run(1.0, DriveCommand{0.3, 0.0});
    EXPECT_EQ(stepped.drive.status().reason, "");
}

TEST(CanDrive, AFaultHoldsUntilTheTruckSaysThatItIsOver) {
    CanDriveConfig config;
    config.feedback_valid = 5.0;
    SteppedYard stepped(config);
    stepped.run(2.0, DriveCommand{0.3, 0.0});
    stepped.truck.set_fault(23);
    stepped.run(0.04, DriveCommand{0.3, 0.0});
    stepped.loses = 0x183;
    stepped.run(1.0, DriveCommand{0.3, 0.0});
    EXPECT_EQ(stepped.drive.status().reason, "the drive reports fault 23");
    EXPECT_EQ(stepped.drive.status().sent.speed, 0.0);
}

TEST(CanDrive, ATruckWithoutSteeringAngleIsNotDriven) {
    CanDriveConfig config;
    config.layout.speed_of = SpeedOf::kAxle;  // else it would not know its speed either
    SteppedYard stepped(config);
    stepped.loses = 0x383;
    stepped.run(2.0, DriveCommand{0.3, 0.0});
    EXPECT_EQ(stepped.drive.status().state, CanDriveState::kHeld);
    EXPECT_EQ(stepped.drive.status().reason, "the truck does not tell its steering angle");
    EXPECT_EQ(stepped.truck.state().speed, 0.0);
}

TEST(CanDrive, ABusyBusIsAskedAgainToStop) {
    Yard yard;
    {
        SteppedYard stepped;
        stepped.run(2.0, DriveCommand{0.3, 0.0});
        stepped.yard.busy = 3;
        stepped.yard.survivor = &yard.sent;
    }
    ASSERT_EQ(yard.sent.size(), 2U);
    EXPECT_EQ(yard.sent[0].data[0] & 1, 1) << "speed zero first, with power";
    EXPECT_EQ(yard.sent[0].data[1] | yard.sent[0].data[2], 0);
    EXPECT_EQ(yard.sent[1], frame("203#0000000000000000"));
}

TEST(CanDrive, IsSilentWhileOthersDriveButStopsFirst) {
    SteppedYard stepped;
    stepped.run(2.0, DriveCommand{0.3, 0.1});
    stepped.drive.set_silent(true);
    stepped.drive.stop();
    stepped.run(0.5, std::nullopt);
    EXPECT_EQ(stepped.drive.status().state, CanDriveState::kStopping);
    EXPECT_FALSE(stepped.yard.sent.back() == frame("203#0000000000000000"));
    stepped.run(1.5, std::nullopt);
    ASSERT_EQ(stepped.drive.status().state, CanDriveState::kOff);
    const std::size_t count = stepped.yard.sent.size();
    EXPECT_EQ(stepped.yard.sent.back().data[0] & 1, 0) << "power is off in the last frame";
    stepped.run(2.0, std::nullopt);
    EXPECT_EQ(stepped.yard.sent.size(), count);
    stepped.drive.set_silent(false);
    stepped.run(2.0, DriveCommand{0.2, 0.0});
    EXPECT_NEAR(stepped.truck.state().speed, 0.2, 0.005);
}

}  // namespace
}  // namespace hybrid_slam
