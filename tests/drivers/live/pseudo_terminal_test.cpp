// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/io/pseudo_terminal.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <optional>

#include "hybrid_slam/lidar/byte_source.hpp"
#include "streams.hpp"
#include "support/error_of.hpp"
#include "support/temp_folder.hpp"

namespace hybrid_slam {
namespace {

using test::Bytes;
using test::error_of;
using test::TempFolder;
using ::testing::HasSubstr;

LidarConfig lidar_at(const std::string& port) {
    LidarConfig config;
    config.port = port;
    return config;
}

/// Until nothing more comes.
Bytes all_of(ByteSource& source) {
    Bytes all;
    Bytes piece;
    do {
        source.read(piece, 0.2);
        test::append(all, piece);
    } while (!piece.empty());
    return all;
}

TEST(PseudoTerminal, ALinkLivesAsLongAsIt) {
    const TempFolder folder;
    const auto link = folder / "lidar";
    {
        const PseudoTerminal terminal(link);
        EXPECT_EQ(terminal.path(), link.string());
        EXPECT_TRUE(std::filesystem::is_character_file(link));
    }
    EXPECT_FALSE(std::filesystem::is_symlink(link));
}

TEST(PseudoTerminal, ALinkOfAnotherOneIsReplacedAndLeftAlone) {
    const TempFolder folder;
    const auto link = folder / "lidar";
    std::optional<PseudoTerminal> old(std::in_place, link);
    const PseudoTerminal fresh(link);
    const auto target = std::filesystem::read_symlink(link);
    old.reset();
    EXPECT_EQ(std::filesystem::read_symlink(link), target);
}

TEST(PseudoTerminal, DoesNotReplaceAFile) {
    const TempFolder folder;
    const auto file = folder.write("lidar", "precious");
    EXPECT_THAT(error_of([&] { PseudoTerminal terminal(file); }),
                HasSubstr(file.string() + ": exists and is no symbolic link"));
    EXPECT_EQ(test::bytes_of(file), "precious");
    EXPECT_THAT(error_of([&] { PseudoTerminal terminal(folder / "no/such/folder"); }),
                HasSubstr("no/such/folder"));
}

TEST(PseudoTerminal, WithoutAReaderAllIsDropped) {
    PseudoTerminal terminal;
    EXPECT_FALSE(terminal.has_reader());
    terminal.write(Bytes(1000, 1));
    EXPECT_EQ(terminal.dropped(), 1000u);
    const auto source = open_byte_source(lidar_at(terminal.path()));
    EXPECT_TRUE(terminal.has_reader());
    EXPECT_TRUE(all_of(*source).empty()) << "the past is not told";
}

TEST(PseudoTerminal, WhatAReaderLeftIsNotToldToTheNextOne) {
    PseudoTerminal terminal;
    auto source = open_byte_source(lidar_at(terminal.path()));
    terminal.write(Bytes(3000, 1));
    source.reset();
    EXPECT_FALSE(terminal.has_reader());
    terminal.write(Bytes(10, 2));
    // Not one of ours, which would throw away by itself what was there before it.
    const int reader = open(terminal.path().c_str(), O_RDONLY | O_NOCTTY | O_NONBLOCK);
    ASSERT_GE(reader, 0);
    Bytes bytes(100);
    EXPECT_LT(read(reader, bytes.data(), bytes.size()), 0) << "nothing is there";
    terminal.write({7});
    EXPECT_TRUE(test::comes_true([&] { return read(reader, bytes.data(), bytes.size()) == 1; }));
    EXPECT_EQ(bytes[0], 7);
    close(reader);
}

TEST(PseudoTerminal, ASerialPortBeginsWithWhatComesAfterItsOpening) {
    PseudoTerminal terminal;
    auto source = open_byte_source(lidar_at(terminal.path()));
    terminal.write(Bytes(3000, 1));
    source.reset();
    source = open_byte_source(lidar_at(terminal.path()));
    terminal.write(Bytes(20, 3));
    EXPECT_EQ(all_of(*source), Bytes(20, 3));
}

TEST(PseudoTerminal, ASlowReaderLosesWhatDoesNotFitAndNothingElse) {
    PseudoTerminal terminal;
    const auto source = open_byte_source(lidar_at(terminal.path()));
    std::size_t written = 0;
    Bytes sent;
    while (terminal.dropped() == 0 && written < 10000000) {
        Bytes block(1000);
        for (std::uint8_t& byte : block) {
            byte = static_cast<std::uint8_t>(written++ * 7 % 251);
        }
        terminal.write(block);
        test::append(sent, block);
    }
    ASSERT_GT(terminal.dropped(), 0u);
    sent.resize(sent.size() - terminal.dropped());
    EXPECT_EQ(all_of(*source), sent);
}

}  // namespace
}  // namespace hybrid_slam
