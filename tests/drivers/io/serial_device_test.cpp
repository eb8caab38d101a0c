// SPDX-License-Identifier: Apache-2.0
#include "io/serial_device.hpp"

#include <gmock/gmock.h>
#include <poll.h>

#include <optional>

#include "hybrid_slam/io/pseudo_terminal.hpp"
#include "support/error_of.hpp"
#include "support/temp_folder.hpp"

namespace hybrid_slam {
namespace {

using test::error_of;
using ::testing::HasSubstr;

constexpr int kBaud = 115200;

/// What `end` reads within a second, as soon as it is anything.
template <typename End>
std::string next_of(End& end) {
    pollfd state{end.descriptor(), POLLIN, 0};
    poll(&state, 1, 1000);
    return end.read();
}

TEST(SerialDevice, BytesGoBothWaysAsTheyAre) {
    PseudoTerminal terminal;
    SerialDevice device(terminal.path(), kBaud, "line");
    EXPECT_EQ(device.read(), "") << "it does not wait";
    EXPECT_EQ(terminal.read(), "");
    const std::string all("\r\n\0\x03\x11\x13\x7f\xff",
                          8);  // what a terminal would take as its own
    EXPECT_EQ(device.write(all), all.size());
    EXPECT_EQ(next_of(terminal), all);
    EXPECT_EQ(terminal.write(all), all.size());
    EXPECT_EQ(next_of(device), all);
    EXPECT_EQ(device.read(), "") << "nothing is echoed";
}

TEST(SerialDevice, BeginsWithoutWhatWasThere) {
    PseudoTerminal terminal;
    {
        const SerialDevice before(terminal.path(), kBaud, "line");
        terminal.write(std::string_view("old"));
    }
    SerialDevice device(terminal.path(), kBaud, "line");
    terminal.write(std::string_view("new"));
    EXPECT_EQ(next_of(device), "new");
}

TEST(SerialDevice, IsForOneAlone) {
    const PseudoTerminal terminal;
    std::optional<SerialDevice> first(std::in_place, terminal.path(), kBaud, "first");
    const auto open = [&terminal] { SerialDevice(terminal.path(), kBaud, "second"); };
    EXPECT_EQ(error_of(open), "second: in use by another program");
    first.reset();
    EXPECT_NO_THROW(open());
}

TEST(SerialDevice, TellsThatItWasUnplugged) {
    std::optional<PseudoTerminal> terminal(std::in_place);
    SerialDevice device(terminal->path(), kBaud, "line");
    terminal.reset();
    EXPECT_EQ(error_of([&device] { device.read(); }), "line: unplugged");
    EXPECT_EQ(error_of([&device] { device.write("x"); }), "line: unplugged");
}

TEST(SerialDevice, TakesNothingMoreWhileNobodyReads) {
    PseudoTerminal terminal;
    SerialDevice device(terminal.path(), kBaud, "line");
    const std::string block(4096, 'x');
    for (int i = 0; i < 1000 && device.write(block) > 0; ++i) {  // nobody reads
    }
    EXPECT_EQ(device.write("late"), 0u);
    while (!next_of(terminal).empty()) {
    }
    EXPECT_EQ(device.write("new"), 3u);
    EXPECT_EQ(next_of(terminal), "new");
}

TEST(SerialDevice, SaysWhatIsWrong) {
    const test::TempFolder folder;
    const auto open = [](const std::string& device) {
        return error_of([&device] { SerialDevice(device, kBaud, "line"); });
    };
    EXPECT_THAT(open(folder / "none"), HasSubstr("line: No such file or directory (is it"));
    EXPECT_EQ(open(folder.write("file", "x")), "line: not a serial port");
}

}  // namespace
}  // namespace hybrid_slam
