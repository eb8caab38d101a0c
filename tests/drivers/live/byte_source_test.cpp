// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/lidar/byte_source.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <numeric>
#include <optional>
#include <string>

#include "hybrid_slam/io/pseudo_terminal.hpp"
#include "local_server.hpp"
#include "streams.hpp"
#include "support/error_of.hpp"
#include "support/shared_data.hpp"
#include "support/temp_folder.hpp"

namespace hybrid_slam {
namespace {

using test::Bytes;
using test::error_of;
using test::LocalServer;
using test::TempFolder;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

LidarConfig lidar_at(const std::string& port, int baud = 500000) {
    LidarConfig config;
    config.port = port;
    config.baud = baud;
    return config;
}

Bytes read_as_much_as(ByteSource& source, std::size_t count) {
    Bytes all;
    Bytes piece;
    for (int i = 0; i < 300 && all.size() < count; ++i) {
        source.read(piece, 0.1);
        test::append(all, piece);
    }
    return all;
}

Bytes every_byte() {
    Bytes bytes(256);
    std::iota(bytes.begin(), bytes.end(), std::uint8_t{0});
    return bytes;
}

TEST(SerialPort, PassesEveryByteAsItIs) {
    PseudoTerminal terminal;
    const auto source = open_byte_source(lidar_at(terminal.path()));
    Bytes sent = every_byte();
    test::append(sent, {0xFF, 0xFF, 0x00, 0x03, 0x04, 0x11, 0x13, 0x0D, 0x0A, 0x7F, 0x1A});
    terminal.write(sent);
    EXPECT_EQ(read_as_much_as(*source, sent.size()), sent);
    EXPECT_FALSE(source->ended());
}

TEST(SerialPort, ReadsNothingWhenNothingComesInTime) {
    PseudoTerminal terminal;
    const auto source = open_byte_source(lidar_at(terminal.path()));
    Bytes bytes{1, 2, 3};
    source->read(bytes, 0.01);
    EXPECT_TRUE(bytes.empty());
    source->read(bytes, 0.0);
    EXPECT_TRUE(bytes.empty());
    terminal.write({9});
    EXPECT_EQ(read_as_much_as(*source, 1), Bytes{9}) << "a read in vain harms nothing";
}

TEST(SerialPort, TakesEveryBaudRateOfScannersAndConverters) {
    PseudoTerminal terminal;
    for (const int baud :
         {9600, 19200, 38400, 57600, 115200, 125000, 230400, 250000, 500000, 1000000}) {
        const auto source = open_byte_source(lidar_at(terminal.path(), baud));
        terminal.write({42});
        EXPECT_EQ(read_as_much_as(*source, 1), Bytes{42}) << baud;
    }
}

TEST(SerialPort, IsForOneReaderAloneUntilThatOneGoes) {
    PseudoTerminal terminal;
    auto source = open_byte_source(lidar_at(terminal.path()));
    EXPECT_EQ(error_of([&] { open_byte_source(lidar_at(terminal.path())); }),
              terminal.path() + ": in use by another program");
    terminal.write({1});
    EXPECT_EQ(read_as_much_as(*source, 1), Bytes{1}) << "the first one is not disturbed";
    source.reset();
    EXPECT_NO_THROW(open_byte_source(lidar_at(terminal.path())));
}

TEST(SerialPort, SaysWhenItIsUnplugged) {
    std::optional<PseudoTerminal> terminal(std::in_place);
    const std::string path = terminal->path();
    const auto source = open_byte_source(lidar_at(path));
    terminal.reset();
    EXPECT_EQ(error_of([&] { read_as_much_as(*source, 1); }), path + ": unplugged");
}

TEST(SerialPort, SaysWhyItCannotBeOpened) {
    const TempFolder folder;
    const std::string missing = (folder / "ttyUSB7").string();
    EXPECT_EQ(error_of([&] { open_byte_source(lidar_at(missing)); }),
              missing + ": No such file or directory (is it plugged in?)");
    EXPECT_EQ(error_of([] { open_byte_source(lidar_at("/dev/null")); }),
              "/dev/null: not a serial port");
    EXPECT_THAT(error_of([&] { open_byte_source(lidar_at(folder.path().string())); }),
                HasSubstr("neither a serial port nor a file"));
    ASSERT_EQ(mkfifo((folder / "pipe").c_str(), 0600), 0);
    EXPECT_THAT(error_of([&] { open_byte_source(lidar_at((folder / "pipe").string())); }),
                HasSubstr("neither a serial port nor a file"));
}

TEST(SerialPort, NamesTheGroupToJoin) {
    if (geteuid() == 0) {
        GTEST_SKIP() << "root may open everything";
    }
    const PseudoTerminal terminal;
    ASSERT_EQ(chmod(terminal.path().c_str(), 0), 0);
    EXPECT_EQ(error_of([&] { open_byte_source(lidar_at(terminal.path())); }),
              terminal.path() + ": Permission denied (is the user in the group dialout?)");
}

TEST(TcpClient, PassesEveryByteAsItIs) {
    LocalServer server;
    const auto source = open_byte_source(lidar_at(server.url()));
    server.accept();
    server.write(every_byte());
    EXPECT_EQ(read_as_much_as(*source, 256), every_byte());
    Bytes bytes{1};
    source->read(bytes, 0.01);
    EXPECT_TRUE(bytes.empty());
    server.hang_up();
    EXPECT_EQ(error_of([&] { read_as_much_as(*source, 1); }),
              server.url() + ": closed by the other end");
}

TEST(TcpClient, SaysWhyItCannotConnect) {
    std::string url;
    {
        const LocalServer server;
        url = server.url();
    }
    EXPECT_EQ(error_of([&] { open_byte_source(lidar_at(url)); }), url + ": Connection refused");
    for (const char* bad :
         {"tcp://", "tcp://host", "tcp://:4001", "tcp://host:", "tcp://host:serial",
          "tcp://host:65536", "tcp://host:123456", "tcp://host:-1"}) {
        EXPECT_THAT(error_of([&] { open_byte_source(lidar_at(bad)); }),
                    AllOf(StartsWith(std::string(bad) + ": "), HasSubstr("tcp://host:port")));
    }
}

TEST(ByteFile, IsPlayedToItsEndAtThePaceOfTheScanCounter) {
    const TempFolder folder;
    Bytes all{0, 0, 0, 0, 0, 0, 99};
    constexpr int kTelegrams = 5;
    for (std::uint32_t i = 0; i < kTelegrams; ++i) {
        test::append(all, test::telegram_bytes(100 + 2 * i));
    }
    test::append(all, {7, 7, 7});
    const auto file = folder.write("drive.bin", std::string(all.begin(), all.end()));
    const auto source = open_byte_source(lidar_at(file.string()));
    const auto begin = std::chrono::steady_clock::now();
    Bytes got;
    Bytes piece;
    while (!source->ended()) {
        source->read(piece, 0.05);
        EXPECT_LE(test::scan_numbers(piece).size(), 1u) << "not two at the same time";
        test::append(got, piece);
    }
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
    EXPECT_EQ(got, all);
    EXPECT_GE(took.count(), (kTelegrams - 1) * 2 * 0.040 - 0.001);
    source->read(piece, 0.0);
    EXPECT_TRUE(piece.empty());
}

TEST(ByteFile, GarbageAndPausesDoNotHoldItUp) {
    const TempFolder folder;
    Bytes all(40000, 0x55);
    test::append(all, test::telegram_bytes(10));
    test::append(all, test::telegram_bytes(4000000));  // days later
    test::append(all, test::telegram_bytes(2));        // switched off and on
    const auto file = folder.write("drive.bin", std::string(all.begin(), all.end()));
    LidarConfig config = lidar_at(file.string(), 4000000);
    const auto source = open_byte_source(config);
    EXPECT_EQ(read_as_much_as(*source, all.size()), all);
    EXPECT_TRUE(source->ended());
}

TEST(ByteFile, AnEmptyOneHasEnded) {
    const TempFolder folder;
    const auto source = open_byte_source(lidar_at(folder.write("empty.bin", "").string()));
    EXPECT_TRUE(source->ended());
}

TEST(ByteFile, TheGivenStreamHoldsTwoScans) {
    HYBRID_SLAM_SHARED_OR_SKIP(file, "data/s300_telegrams/stream_garbage_good_corrupt_good.bin");
    const auto source = open_byte_source(lidar_at(file.string()));
    const Bytes bytes = read_as_much_as(*source, std::filesystem::file_size(file));
    EXPECT_THAT(test::scan_numbers(bytes), ::testing::ElementsAre(100u, 104u));
}

}  // namespace
}  // namespace hybrid_slam
