// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/can/slcan_terminal.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <optional>
#include <thread>

#include "frames.hpp"
#include "hybrid_slam/can/can_bus.hpp"
#include "support/error_of.hpp"
#include "support/temp_folder.hpp"

namespace hybrid_slam {
namespace {

using test::error_of;
using test::frame;
using test::TempFolder;
using ::testing::HasSubstr;

/// Opens the bus while the terminal answers.
std::unique_ptr<CanBus> opened(SlcanTerminal& terminal) {
    std::unique_ptr<CanBus> bus;
    std::thread host([&] {
        CanConfig config;
        config.port = "slcan:" + terminal.path();
        bus = open_can_bus(config);
    });
    for (int i = 0; i < 2000 && !terminal.is_open(); ++i) {
        terminal.receive(0.01);
    }
    host.join();
    return bus;
}

TEST(SlcanTerminal, HasAStableNameForAsLongAsItLives) {
    const TempFolder folder;
    const std::filesystem::path link = folder / "can";
    {
        SlcanTerminal terminal(link);
        EXPECT_EQ(terminal.path(), link.string());
        EXPECT_TRUE(std::filesystem::is_character_file(link));
        EXPECT_FALSE(terminal.send(frame("183#00"))) << "nobody has opened the bus";
        EXPECT_EQ(terminal.dropped(), 1U);
        const auto bus = opened(terminal);
        ASSERT_TRUE(bus);
        EXPECT_TRUE(terminal.send(frame("183#0102")));
        EXPECT_EQ(bus->receive(20.0), frame("183#0102"));
        EXPECT_TRUE(bus->send(frame("203#00")));
        std::vector<CanFrame> frames;
        for (int i = 0; i < 2000 && frames.empty(); ++i) {
            frames = terminal.receive(0.01);
        }
        EXPECT_EQ(frames, std::vector<CanFrame>{frame("203#00")});
    }
    EXPECT_FALSE(std::filesystem::is_symlink(std::filesystem::symlink_status(link)));
}

TEST(SlcanTerminal, ReplacesALinkThatIsLeftOver) {
    const TempFolder folder;
    const std::filesystem::path link = folder / "can";
    std::filesystem::create_symlink("/dev/gone", link);
    std::optional<SlcanTerminal> first(std::in_place, link);
    const auto target = std::filesystem::read_symlink(link);
    EXPECT_NE(target, "/dev/gone");
    // A second one takes the name over; the first leaves it alone then.
    const SlcanTerminal second(link);
    const auto second_target = std::filesystem::read_symlink(link);
    EXPECT_NE(second_target, target);
    first.reset();
    EXPECT_EQ(std::filesystem::read_symlink(link), second_target);
}

TEST(SlcanTerminal, ANameThatIsTakenIsAnError) {
    const TempFolder folder;
    const auto file = folder.write("can", "a file");
    EXPECT_THAT(error_of([&] { SlcanTerminal terminal(file); }), HasSubstr("no symbolic link"));
    EXPECT_TRUE(std::filesystem::is_regular_file(file));
    EXPECT_THAT(error_of([&] { SlcanTerminal terminal(folder / "none/can"); }),
                HasSubstr("none/can"));
}

}  // namespace
}  // namespace hybrid_slam
