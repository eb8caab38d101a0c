// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/can/can_bus.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/can.h>
#include <linux/can/error.h>
#include <sys/socket.h>
#include <unistd.h>

#include "can_buses.hpp"
#include "frames.hpp"
#include "support/error_of.hpp"
#include "support/temp_folder.hpp"

namespace hybrid_slam {
namespace {

using test::error_of;
using test::frame;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr double kLong = 20.0;  // seconds

CanConfig port(const std::string& name) {
    CanConfig config;
    config.port = name;
    return config;
}

TEST(CanBus, NamesThatMeanNothingAreRefused) {
    for (const char* name : {"", ":", "slcan:", "candump:", "/dev/ttyACM0", "pcan:usb", "a/b"}) {
        EXPECT_THAT(error_of([name] { open_can_bus(port(name)); }), HasSubstr("not a CAN port"))
            << name;
    }
}

TEST(CanBus, WithoutSocketCanTheErrorNamesTheAlternatives) {
    const int socket = ::socket(PF_CAN, SOCK_RAW, CAN_RAW);
    if (socket >= 0) {
        close(socket);
        EXPECT_THAT(error_of([] { open_can_bus(port("nocan7")); }), HasSubstr("ip link set"));
        EXPECT_THAT(error_of([] { open_can_bus(port("aNameOfTwentyLetters")); }),
                    HasSubstr("too long"));
        return;
    }
    EXPECT_THAT(error_of([] { open_can_bus(port("can0")); }),
                AllOf(HasSubstr("can0: "), HasSubstr("SocketCAN"), HasSubstr("slcan:"),
                      HasSubstr("candump:")));
}

TEST(CandumpSink, WritesLinesThatCanBeWatched) {
    const test::TempFolder folder;
    const auto file = folder / "dry.log";
    const auto bus = open_can_bus(port("candump:" + file.string()));
    EXPECT_FALSE(bus->hears());
    EXPECT_TRUE(bus->send(frame("203#0100000A0A000000")));
    EXPECT_EQ(read_candump(file).size(), 1U) << "before it is closed";
    EXPECT_TRUE(bus->send(frame("203#00")));
    EXPECT_FALSE(bus->send(CanFrame::of(0x800, {})));
    EXPECT_EQ(bus->receive(0.001), std::nullopt);
    const std::vector<CandumpLine> lines = read_candump(file);
    ASSERT_EQ(lines.size(), 2U);
    EXPECT_EQ(lines[0].frame, frame("203#0100000A0A000000"));
    EXPECT_EQ(lines[1].frame, frame("203#00"));
    EXPECT_EQ(bus->counts().sent, 2U);
    EXPECT_EQ(bus->counts().dropped, 1U);
}

TEST(CandumpSink, RefusesWhatIsNoFile) {
    const test::TempFolder folder;
    EXPECT_THAT(error_of([&] { open_can_bus(port("candump:" + folder.path().string())); }),
                HasSubstr(folder.path().string()));
    EXPECT_THAT(error_of([&] { open_can_bus(port("candump:" + (folder / "a/b").string())); }),
                HasSubstr("a/b"));
}

/// The kernel's end of a CAN socket: whole can_frames as it would pass them.
class SocketCanTest : public ::testing::Test {
  protected:
    SocketCanTest() {
        int ends[2] = {-1, -1};
        EXPECT_EQ(socketpair(AF_UNIX, SOCK_SEQPACKET, 0, ends), 0);
        kernel_ = ends[0];
        bus_ = socket_can_on(ends[1], "can7");
    }
    ~SocketCanTest() override { hang_up(); }

    void hang_up() {
        if (kernel_ >= 0) {
            close(kernel_);
        }
        kernel_ = -1;
    }
    void kernel_says(canid_t id, std::uint8_t size) const {
        can_frame raw{};
        raw.can_id = id;
        raw.can_dlc = size;
        raw.data[0] = 0xAB;
        ASSERT_EQ(write(kernel_, &raw, sizeof raw), static_cast<ssize_t>(sizeof raw));
    }

    int kernel_ = -1;
    std::unique_ptr<CanBus> bus_;
};

TEST_F(SocketCanTest, FramesAreTheKernels) {
    EXPECT_TRUE(bus_->send(frame("18FEF100#0102")));
    can_frame raw{};
    ASSERT_EQ(read(kernel_, &raw, sizeof raw), static_cast<ssize_t>(sizeof raw));
    EXPECT_EQ(raw.can_id, 0x18FEF100U | CAN_EFF_FLAG);
    EXPECT_EQ(raw.can_dlc, 2);
    EXPECT_EQ(raw.data[1], 2);
    EXPECT_TRUE(bus_->send(frame("601#R4")));
    ASSERT_EQ(read(kernel_, &raw, sizeof raw), static_cast<ssize_t>(sizeof raw));
    EXPECT_EQ(raw.can_id, 0x601U | CAN_RTR_FLAG);
    EXPECT_EQ(raw.can_dlc, 4);

    kernel_says(0x183, 1);
    kernel_says(0x00000183 | CAN_EFF_FLAG | CAN_RTR_FLAG, 2);
    EXPECT_EQ(bus_->receive(kLong), frame("183#AB"));
    EXPECT_EQ(bus_->receive(kLong), frame("00000183#R2"));
    EXPECT_EQ(bus_->receive(0.0), std::nullopt);
    EXPECT_EQ(bus_->counts().sent, 2U);
    EXPECT_EQ(bus_->counts().received, 2U);
}

TEST_F(SocketCanTest, AFullQueueDropsAndIsNoFault) {
    int taken = 0;
    while (taken < 100000 && bus_->send(frame("203#00"))) {
        ++taken;
    }
    EXPECT_LT(taken, 100000);
    EXPECT_EQ(bus_->counts().dropped, 1U);
    EXPECT_EQ(bus_->fault(), "");
    can_frame raw{};
    ASSERT_GT(read(kernel_, &raw, sizeof raw), 0);
    EXPECT_TRUE(bus_->send(frame("203#00")));
}

TEST_F(SocketCanTest, ErrorFramesAreCountedAndBusOffIsAFault) {
    kernel_says(CAN_ERR_FLAG | CAN_ERR_CRTL, 8);
    kernel_says(0x183, 1);
    EXPECT_EQ(bus_->receive(kLong), frame("183#AB"));
    EXPECT_EQ(bus_->counts().errors, 1U);
    EXPECT_EQ(bus_->fault(), "");
    kernel_says(CAN_ERR_FLAG | CAN_ERR_BUSOFF, 8);
    EXPECT_EQ(bus_->receive(kLong), std::nullopt);
    EXPECT_THAT(bus_->fault(), AllOf(HasSubstr("can7: "), HasSubstr("bus off")));
    EXPECT_FALSE(bus_->send(frame("203#00")));
}

TEST_F(SocketCanTest, AnInterfaceThatGoesIsAFault) {
    hang_up();
    EXPECT_FALSE(bus_->send(frame("203#00")));
    EXPECT_THAT(bus_->fault(), HasSubstr("can7: "));
    EXPECT_EQ(bus_->receive(kLong), std::nullopt) << "at once";
}

}  // namespace
}  // namespace hybrid_slam
