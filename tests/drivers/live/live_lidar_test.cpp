// SPDX-License-Identifier: Apache-2.0
// LiveSensors with a lidar at the other end of a pseudo-terminal or of TCP.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <optional>

#include "collector.hpp"
#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/io/pseudo_terminal.hpp"
#include "hybrid_slam/lidar/lidar_reader.hpp"
#include "local_server.hpp"
#include "support/temp_folder.hpp"
#include "uart.hpp"

namespace hybrid_slam {
namespace {

using test::Bytes;
using test::Collector;
using test::comes_true;
using test::FramingErrors;
using test::LocalServer;
using test::numbers_from;
using test::scan_numbers;
using test::telegram_bytes;
using test::TempFolder;
using ::testing::AllOf;
using ::testing::HasSubstr;

RobotConfig robot_with_lidar(const std::string& port) {
    RobotConfig robot;
    robot.lidar.port = port;
    robot.camera.enabled = false;
    return robot;
}

LiveOptions quick() {
    LiveOptions options;
    options.retry_every = 0.02;
    return options;
}

bool lidar_is(const LiveSensors& sensors, DeviceState state) {
    return comes_true([&] { return sensors.status().lidar.state == state; });
}

/// Opened for the so-many-th time: from then on it hears all that is sent.
bool listens(const LiveSensors& sensors, std::uint64_t connects) {
    return comes_true([&] { return sensors.status().lidar.connects == connects; });
}

bool has_scans(const Collector& collector, std::size_t count) {
    return comes_true([&] { return scan_numbers(collector.bytes()).size() >= count; });
}

TEST(LiveLidar, TelegramsArriveComplete) {
    PseudoTerminal terminal;
    LiveSensors sensors(robot_with_lidar(terminal.path()), quick());
    const Collector collector(sensors);
    ASSERT_TRUE(listens(sensors, 1));
    EXPECT_TRUE(test::send_telegrams(terminal, collector, 50));
    EXPECT_EQ(scan_numbers(collector.bytes()), numbers_from(0, 50));
    EXPECT_EQ(terminal.dropped(), 0u);
    const DeviceStatus status = sensors.status().lidar;
    EXPECT_EQ(status.state, DeviceState::kStreaming);
    EXPECT_EQ(status.detail, "");
    EXPECT_EQ(status.dropped, 0u);
}

TEST(LiveLidar, TelegramsInPiecesAreDeliveredAsTheyCome) {
    PseudoTerminal terminal;
    LiveSensors sensors(robot_with_lidar(terminal.path()), quick());
    const Collector collector(sensors);
    ASSERT_TRUE(listens(sensors, 1));
    const Bytes whole = telegram_bytes(6);
    Bytes sent;
    for (const std::size_t size : {1u, 3u, 9u, 500u, 594u, 1u}) {
        const auto from = whole.begin() + static_cast<std::ptrdiff_t>(sent.size());
        const Bytes piece(from, from + static_cast<std::ptrdiff_t>(size));
        terminal.write(piece);
        test::append(sent, piece);
        ASSERT_TRUE(comes_true([&] { return collector.bytes() == sent; })) << "nothing waits";
    }
    ASSERT_EQ(sent.size(), whole.size());
    EXPECT_TRUE(lidar_is(sensors, DeviceState::kStreaming));
    EXPECT_GE(collector.lidar_events().size(), 6u);
}

TEST(LiveLidar, APulledCableCostsNothingButTheGap) {
    const TempFolder folder;
    const auto link = folder / "lidar";
    std::optional<PseudoTerminal> terminal(std::in_place, link);
    LiveSensors sensors(robot_with_lidar(link.string()), quick());
    const Collector collector(sensors);
    std::uint32_t number = 0;
    std::size_t sent = 0;
    for (std::uint64_t plugged = 1; plugged <= 3; ++plugged) {
        ASSERT_TRUE(listens(sensors, plugged));
        for (int i = 0; i < 10; ++i, number += 2, ++sent) {
            terminal->write(telegram_bytes(number));
        }
        const Bytes half = telegram_bytes(9999);
        terminal->write({half.begin(), half.begin() + 700});
        ASSERT_TRUE(has_scans(collector, sent));
        EXPECT_EQ(terminal->dropped(), 0u);
        terminal.reset();
        ASSERT_TRUE(lidar_is(sensors, DeviceState::kConnecting));
        ASSERT_TRUE(comes_true([&] {
            return sensors.status().lidar.detail ==
                   link.string() + ": No such file or directory (is it plugged in?)";
        })) << sensors.status().lidar.detail;
        terminal.emplace(link);
    }
    EXPECT_EQ(scan_numbers(collector.bytes()), numbers_from(0, sent));
}

TEST(LiveLidar, ALidarThatComesLaterIsFound) {
    const TempFolder folder;
    LiveSensors sensors(robot_with_lidar((folder / "lidar").string()), quick());
    const Collector collector(sensors);
    ASSERT_TRUE(comes_true([&] {
        return sensors.status().lidar.detail.find("is it plugged in?") != std::string::npos;
    }));
    EXPECT_EQ(sensors.status().lidar.connects, 0u);
    PseudoTerminal terminal(folder / "lidar");
    ASSERT_TRUE(listens(sensors, 1));
    terminal.write(telegram_bytes(2));
    EXPECT_TRUE(lidar_is(sensors, DeviceState::kStreaming));
}

TEST(LiveLidar, SilenceIsToldAndForgotten) {
    PseudoTerminal terminal;
    LiveOptions options = quick();
    options.silent_after = 0.15;
    LiveSensors sensors(robot_with_lidar(terminal.path()), options);
    const Collector collector(sensors);
    ASSERT_TRUE(lidar_is(sensors, DeviceState::kSilent));
    EXPECT_THAT(
        sensors.status().lidar.detail,
        AllOf(HasSubstr(terminal.path() + ": no byte for 0.15 s"), HasSubstr("is the scanner on")));
    terminal.write(telegram_bytes(2));
    EXPECT_TRUE(lidar_is(sensors, DeviceState::kStreaming));
    EXPECT_TRUE(lidar_is(sensors, DeviceState::kSilent));
    EXPECT_EQ(sensors.status().lidar.connects, 1u);
}

struct WrongBaud {
    double rate;
    FramingErrors errors;
};

class LiveLidarWrongBaud : public ::testing::TestWithParam<WrongBaud> {};

TEST_P(LiveLidarWrongBaud, IsNamedAndGivesNoScan) {
    PseudoTerminal terminal;
    RobotConfig robot = robot_with_lidar(terminal.path());
    robot.lidar.baud = static_cast<int>(GetParam().rate);
    LiveOptions options = quick();
    options.silent_after = 5.0;
    options.unreadable_after = 0.1;
    LiveSensors sensors(robot, options);
    Collector collector(sensors);
    ASSERT_TRUE(listens(sensors, 1));
    std::uint32_t number = 0;
    ASSERT_TRUE(comes_true([&] {
        const auto levels = test::line_levels(telegram_bytes(number += 2), 14000);
        terminal.write(test::received(levels, 500000.0, GetParam().rate, GetParam().errors));
        return sensors.status().lidar.state == DeviceState::kUnreadable;
    })) << sensors.status().lidar.detail;
    EXPECT_THAT(sensors.status().lidar.detail, AllOf(HasSubstr("the baud rate is probably not " +
                                                               std::to_string(robot.lidar.baud)),
                                                     HasSubstr("500000")));
    sensors.stop();
    collector.join();
    LidarReader reader(robot.lidar);
    for (const LidarBytes& bytes : collector.lidar_events()) {
        reader.push(bytes);
        EXPECT_FALSE(reader.next());
    }
    EXPECT_GT(reader.counts().stream.bytes, 0u);
}

INSTANTIATE_TEST_SUITE_P(Rates, LiveLidarWrongBaud,
                         ::testing::Values(WrongBaud{38400.0, FramingErrors::kDelivered},
                                           WrongBaud{115200.0, FramingErrors::kDelivered},
                                           WrongBaud{115200.0, FramingErrors::kDropped},
                                           WrongBaud{125000.0, FramingErrors::kDropped},
                                           WrongBaud{230400.0, FramingErrors::kDelivered},
                                           WrongBaud{250000.0, FramingErrors::kDropped},
                                           WrongBaud{1000000.0, FramingErrors::kDelivered},
                                           WrongBaud{1000000.0, FramingErrors::kDropped}));

TEST(LiveLidar, AConverterThatRestartsIsConnectedAgain) {
    std::optional<LocalServer> server(std::in_place);
    const std::uint16_t port = server->port();
    LiveSensors sensors(robot_with_lidar(server->url()), quick());
    const Collector collector(sensors);
    std::uint32_t number = 0;
    for (std::size_t started = 1; started <= 3; ++started) {
        server->accept();
        for (int i = 0; i < 10; ++i, number += 2) {
            server->write(telegram_bytes(number));
        }
        ASSERT_TRUE(has_scans(collector, 10 * started));
        EXPECT_TRUE(lidar_is(sensors, DeviceState::kStreaming));
        server.reset();
        ASSERT_TRUE(comes_true([&] {
            return sensors.status().lidar.detail.find("Connection refused") != std::string::npos;
        }));
        server.emplace(port);
    }
    EXPECT_EQ(scan_numbers(collector.bytes()), numbers_from(0, 30));
}

TEST(LiveLidar, AFileIsReadToItsEndAndThenItIsOver) {
    const TempFolder folder;
    Bytes all;
    for (std::uint32_t i = 0; i < 6; ++i) {
        test::append(all, telegram_bytes(1000 + 2 * i));
    }
    const auto file = folder.write("drive.bin", std::string(all.begin(), all.end()));
    LiveSensors sensors(robot_with_lidar(file.string()), quick());
    Bytes got;
    std::vector<double> arrivals;
    while (const auto event = sensors.next()) {
        test::append(got, std::get<LidarBytes>(*event).bytes);
        arrivals.push_back(arrival_of(*event));
    }
    EXPECT_EQ(got, all);
    EXPECT_TRUE(sensors.ended());
    EXPECT_EQ(sensors.status().lidar.state, DeviceState::kOff);
    EXPECT_THAT(sensors.status().lidar.detail, HasSubstr("drive.bin: ended"));
    ASSERT_EQ(arrivals.size(), 6u);
    // Less than 5 periods, as the first one may have been late.
    EXPECT_GE(arrivals.back() - arrivals.front(), 3 * 0.080);
}

TEST(LiveLidar, StopWakesWhoWaits) {
    PseudoTerminal terminal;
    LiveSensors sensors(robot_with_lidar(terminal.path()), quick());
    std::thread stopper([&] {
        test::sleep_ms(50);
        sensors.stop();
    });
    EXPECT_FALSE(sensors.next());
    stopper.join();
    EXPECT_TRUE(sensors.ended());
    EXPECT_FALSE(sensors.next_within(10.0));
    sensors.stop();
}

TEST(LiveLidar, WaitsNoLongerThanAsked) {
    PseudoTerminal terminal;
    LiveSensors sensors(robot_with_lidar(terminal.path()), quick());
    EXPECT_FALSE(sensors.next_within(0.01));
    EXPECT_FALSE(sensors.next_within(0.0));
    EXPECT_FALSE(sensors.ended());
}

TEST(LiveLidar, ArrivalsAreOfTheWallClockUnlessToldOtherwise) {
    PseudoTerminal terminal;
    const auto wall = [] {
        return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch())
            .count();
    };
    const double before = wall();
    {
        LiveSensors sensors(robot_with_lidar(terminal.path()), quick());
        ASSERT_TRUE(listens(sensors, 1));
        terminal.write({1});
        const auto event = sensors.next();
        ASSERT_TRUE(event);
        EXPECT_GE(arrival_of(*event), before - 0.01);
        EXPECT_LE(arrival_of(*event), wall() + 0.01);
    }
    LiveOptions options = quick();
    options.now = [] { return 77.0; };
    LiveSensors sensors(robot_with_lidar(terminal.path()), options);
    ASSERT_TRUE(listens(sensors, 1));
    terminal.write({1});
    const auto event = sensors.next();
    ASSERT_TRUE(event);
    EXPECT_EQ(arrival_of(*event), 77.0);
}

/// Hands out the numbers from 0 on, one byte at a time, as fast as it is asked.
class Counting : public ByteSource {
  public:
    void read(std::vector<std::uint8_t>& bytes, double) override {
        bytes = {static_cast<std::uint8_t>(count_++ % 256)};
        if (count_ > 500) {
            test::sleep_ms(1);
        }
    }

  private:
    int count_ = 0;
};

TEST(LiveLidar, WhatASlowConsumerLosesIsTheOldestAndIsCounted) {
    LiveOptions options = quick();
    options.most_lidar_events = 64;
    options.open_lidar = [](const LidarConfig&) { return std::make_unique<Counting>(); };
    LiveSensors sensors(robot_with_lidar("fake"), options);
    ASSERT_TRUE(comes_true([&] { return sensors.status().lidar.dropped >= 300; }));
    const auto first = sensors.next();
    ASSERT_TRUE(first);
    std::uint8_t last = std::get<LidarBytes>(*first).bytes.at(0);
    for (int i = 1; i < 64; ++i) {
        const auto event = sensors.next();
        ASSERT_TRUE(event);
        const std::uint8_t value = std::get<LidarBytes>(*event).bytes.at(0);
        EXPECT_GE(static_cast<std::uint8_t>(value - last), 1);
        EXPECT_LE(static_cast<std::uint8_t>(value - last), 64);
        last = value;
    }
}

TEST(LiveLidar, ADriverThatHangsDoesNotHoldUpTheEnd) {
    auto released = std::make_shared<std::atomic<bool>>(false);
    auto left = std::make_shared<std::atomic<bool>>(false);
    {
        LiveOptions options = quick();
        options.open_lidar = [released, left](const LidarConfig&) -> std::unique_ptr<ByteSource> {
            while (!*released) {
                test::sleep_ms(1);
            }
            *left = true;
            throw Error("too late");
        };
        LiveSensors sensors(robot_with_lidar("fake"), options);
        EXPECT_FALSE(sensors.next_within(0.02));
    }
    *released = true;  // not before the end, which would have waited for ever
    EXPECT_TRUE(comes_true([&] { return left->load(); }));
}

TEST(LiveLidar, WhateverADriverThrowsIsAStatus) {
    LiveOptions options = quick();
    options.open_lidar = [](const LidarConfig&) -> std::unique_ptr<ByteSource> {
        throw std::runtime_error("a driver's own trouble");
    };
    LiveSensors sensors(robot_with_lidar("fake"), options);
    EXPECT_TRUE(
        comes_true([&] { return sensors.status().lidar.detail == "a driver's own trouble"; }));
    EXPECT_EQ(sensors.status().lidar.state, DeviceState::kConnecting);
}

}  // namespace
}  // namespace hybrid_slam
