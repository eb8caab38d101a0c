// SPDX-License-Identifier: Apache-2.0
#include "lidar_watch.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "streams.hpp"
#include "uart.hpp"

namespace hybrid_slam {
namespace {

using test::Bytes;
using test::FramingErrors;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

class LidarWatchTest : public ::testing::Test {
  protected:
    LidarWatch watch() const { return {config_, options_, 100.0}; }

    LidarConfig config_;
    LiveOptions options_;
    const Bytes telegram_ = test::telegram_bytes(10);
    const Bytes garbage_ = Bytes(100, 0x55);
};

TEST_F(LidarWatchTest, StreamsWithTheFirstWholeTelegram) {
    LidarWatch watch = this->watch();
    EXPECT_EQ(watch.state(), DeviceState::kConnecting);
    watch.take({telegram_.begin(), telegram_.begin() + 600}, 100.1);
    EXPECT_EQ(watch.state(), DeviceState::kConnecting);
    EXPECT_THAT(watch.detail(), HasSubstr("no telegram yet"));
    watch.take({telegram_.begin() + 600, telegram_.end()}, 100.2);
    EXPECT_EQ(watch.state(), DeviceState::kStreaming);
    EXPECT_THAT(watch.detail(), IsEmpty());
}

TEST_F(LidarWatchTest, SilenceIsToldAfterAWhileAndEndsWithAByte) {
    LidarWatch watch = this->watch();
    watch.take({}, 100.9);
    EXPECT_EQ(watch.state(), DeviceState::kConnecting);
    watch.take({}, 101.0);
    EXPECT_EQ(watch.state(), DeviceState::kSilent);
    EXPECT_THAT(watch.detail(), AllOf(HasSubstr("/dev/ttyUSB0: no byte for 1 s"),
                                      HasSubstr("is the scanner on"), HasSubstr("wires")));
    watch.take(telegram_, 102.0);
    EXPECT_EQ(watch.state(), DeviceState::kStreaming);
    watch.take({}, 103.1);
    EXPECT_EQ(watch.state(), DeviceState::kSilent);
    watch.take({1, 2, 3}, 103.2);
    EXPECT_EQ(watch.state(), DeviceState::kStreaming) << "the beginning of a telegram, surely";
}

TEST_F(LidarWatchTest, BytesWithoutTelegramsNameTheBaudRate) {
    config_.baud = 115200;
    LidarWatch watch = this->watch();
    watch.take(garbage_, 100.1);
    watch.take(garbage_, 102.0);
    EXPECT_EQ(watch.state(), DeviceState::kConnecting);
    watch.take(garbage_, 102.2);
    EXPECT_EQ(watch.state(), DeviceState::kUnreadable);
    EXPECT_THAT(watch.detail(),
                AllOf(HasSubstr("the baud rate is probably not 115200"), HasSubstr("SICK CDS"),
                      HasSubstr("9600, 19200, 38400, 125000"), HasSubstr("500000, 1000000"),
                      Not(HasSubstr("\n"))));
    watch.take(telegram_, 102.3);
    EXPECT_EQ(watch.state(), DeviceState::kStreaming);
}

TEST_F(LidarWatchTest, AStreamThatTurnsUnreadableIsToldToo) {
    LidarWatch watch = this->watch();
    watch.take(telegram_, 100.1);
    watch.take(garbage_, 100.2);
    watch.take(garbage_, 102.1);
    EXPECT_EQ(watch.state(), DeviceState::kStreaming);
    watch.take(garbage_, 102.3);
    EXPECT_EQ(watch.state(), DeviceState::kUnreadable);
}

TEST_F(LidarWatchTest, ASilenceIsNoTimeOfGarbage) {
    LidarWatch watch = this->watch();
    watch.take(garbage_, 100.1);
    watch.take({}, 110.0);
    EXPECT_EQ(watch.state(), DeviceState::kSilent);
    watch.take(garbage_, 110.1);
    EXPECT_EQ(watch.state(), DeviceState::kConnecting);
}

TEST_F(LidarWatchTest, TheWordsOfTheThesisCannotBeJudged) {
    config_.protocol = LidarProtocol::kThesisWords;
    LidarWatch watch = this->watch();
    for (double now = 100.1; now < 110.0; now += 0.1) {
        watch.take(garbage_, now);
    }
    EXPECT_EQ(watch.state(), DeviceState::kStreaming);
}

TEST(Uart, ReadsWhatWasSentAtTheSameOrNearlyTheSameRate) {
    const Bytes sent = test::telegram_bytes(77);
    const auto levels = test::line_levels(sent, 100);
    for (const double rate : {500000.0, 490000.0, 510000.0}) {
        EXPECT_EQ(test::received(levels, 500000.0, rate, FramingErrors::kDropped), sent) << rate;
        EXPECT_EQ(test::received(levels, 500000.0, rate, FramingErrors::kDelivered), sent) << rate;
    }
}

TEST_F(LidarWatchTest, AWrongBaudRateIsUnreadableWhateverTheUartDoesWithFramingErrors) {
    for (const double rate :
         {9600.0, 19200.0, 38400.0, 115200.0, 125000.0, 230400.0, 250000.0, 1000000.0}) {
        for (const auto errors : {FramingErrors::kDropped, FramingErrors::kDelivered}) {
            LidarWatch watch = this->watch();
            std::uint32_t number = 0;
            for (double now = 100.0; now < 104.0; now += 0.4, number += 2) {
                // The rest of the 80 ms until the next telegram is silence on the line.
                const auto levels = test::line_levels(test::telegram_bytes(number), 14000);
                watch.take(test::received(levels, 500000.0, rate, errors), now);
                ASSERT_NE(watch.state(), DeviceState::kStreaming) << rate;
            }
            EXPECT_EQ(watch.state(), DeviceState::kUnreadable) << rate;
        }
    }
}

}  // namespace
}  // namespace hybrid_slam
