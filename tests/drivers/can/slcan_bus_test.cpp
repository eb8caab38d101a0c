// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <mutex>
#include <optional>
#include <thread>

#include "frames.hpp"
#include "hybrid_slam/can/can_bus.hpp"
#include "hybrid_slam/can/slcan_terminal.hpp"
#include "support/error_of.hpp"
#include "support/temp_folder.hpp"

namespace hybrid_slam {
namespace {

using test::error_of;
using test::frame;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr double kLong = 20.0;  // seconds: only a broken test waits for so long

CanConfig slcan_at(const std::string& path) {
    CanConfig config;
    config.port = "slcan:" + path;
    return config;
}

/// Lets the terminal hear what the host has said; a loaded machine brings it in pieces.
bool becomes(SlcanTerminal& terminal, bool open) {
    for (int i = 0; i < 2000 && terminal.is_open() != open; ++i) {
        terminal.receive(0.01);
    }
    return terminal.is_open() == open;
}

/// An adapter that answers in a thread of its own and keeps what it was sent.
class LiveAdapter {
  public:
    LiveAdapter() : terminal_(std::in_place), thread_([this] { run(); }) {}
    ~LiveAdapter() { unplug(); }

    std::string path() const { return terminal_->path(); }

    void unplug() {
        end_ = true;
        if (thread_.joinable()) {
            thread_.join();
        }
        terminal_.reset();
    }
    void say(const std::string& bytes) {
        const std::lock_guard<std::mutex> lock(mutex_);
        to_say_ += bytes;
    }
    std::vector<CanFrame> heard(std::size_t count) {
        for (int i = 0; i < 2000; ++i) {
            {
                const std::lock_guard<std::mutex> lock(mutex_);
                if (heard_.size() >= count) {
                    return heard_;
                }
            }
            usleep(10000);
        }
        return {};
    }

  private:
    void run() {
        while (!end_) {
            const std::vector<CanFrame> frames = terminal_->receive(0.005);
            const std::lock_guard<std::mutex> lock(mutex_);
            heard_.insert(heard_.end(), frames.begin(), frames.end());
            terminal_->write(to_say_);
            to_say_.clear();
        }
    }

    std::optional<SlcanTerminal> terminal_;
    std::atomic<bool> end_{false};
    std::mutex mutex_;
    std::vector<CanFrame> heard_;
    std::string to_say_;
    std::thread thread_;
};

TEST(SlcanBus, FramesGoBothWays) {
    LiveAdapter adapter;
    const auto bus = open_can_bus(slcan_at(adapter.path()));
    EXPECT_TRUE(bus->hears());
    EXPECT_TRUE(bus->send(frame("203#0100000A0A000000")));
    EXPECT_TRUE(bus->send(frame("18FEF100#R3")));
    EXPECT_THAT(adapter.heard(2), ElementsAre(frame("203#0100000A0A000000"), frame("18FEF100#R3")));
    adapter.say("t1838F40132000050FA00\rt383218FC0001\r");
    EXPECT_EQ(bus->receive(kLong), frame("183#F40132000050FA00"));
    EXPECT_EQ(bus->receive(kLong), frame("383#18FC"));
    EXPECT_EQ(bus->receive(0.0), std::nullopt);
    EXPECT_EQ(bus->counts().sent, 2U);
    EXPECT_EQ(bus->counts().received, 2U);
    EXPECT_EQ(bus->counts().errors, 0U);
    EXPECT_EQ(bus->counts().dropped, 0U);
    EXPECT_EQ(bus->fault(), "");
}

TEST(SlcanBus, TroubleOnTheLineIsCounted) {
    LiveAdapter adapter;
    const auto bus = open_can_bus(slcan_at(adapter.path()));
    adapter.say("\a???\rt1831FF\r");
    EXPECT_EQ(bus->receive(kLong), frame("183#FF"));
    EXPECT_EQ(bus->counts().errors, 2U);
    EXPECT_FALSE(bus->send(CanFrame::of(0x800, {})));
    EXPECT_EQ(bus->counts().dropped, 1U);
}

TEST(SlcanBus, FloodsAreBoundedAndTheNewestKept) {
    LiveAdapter adapter;
    const auto bus = open_can_bus(slcan_at(adapter.path()));
    std::string flood;
    for (int i = 0; i < 500; ++i) {
        flood += "t1000\r";
    }
    adapter.say(flood + "t1010\r");
    std::uint64_t got = 0;
    for (std::optional<CanFrame> next = bus->receive(kLong); next; next = bus->receive(kLong)) {
        ++got;
        if (next->id == 0x101) {
            break;
        }
    }
    EXPECT_EQ(bus->counts().received, got);
    EXPECT_EQ(bus->counts().received + bus->counts().dropped, 501U);
}

TEST(SlcanBus, UnpluggedIsSaidOnceAndCanBeOpenedAnew) {
    LiveAdapter adapter;
    const auto bus = open_can_bus(slcan_at(adapter.path()));
    adapter.unplug();
    EXPECT_EQ(bus->receive(kLong), std::nullopt);
    EXPECT_THAT(bus->fault(), HasSubstr("unplugged"));
    EXPECT_THAT(bus->fault(), HasSubstr("slcan:/dev/"));
    EXPECT_FALSE(bus->send(frame("203#00")));
    EXPECT_EQ(bus->receive(kLong), std::nullopt) << "at once";
    EXPECT_EQ(bus->counts().dropped, 1U);

    LiveAdapter another;
    const auto anew = open_can_bus(slcan_at(another.path()));
    EXPECT_TRUE(anew->send(frame("203#00")));
    EXPECT_EQ(another.heard(1).size(), 1U);
}

TEST(SlcanBus, UnpluggedIsFoundBySendingToo) {
    LiveAdapter adapter;
    const auto bus = open_can_bus(slcan_at(adapter.path()));
    adapter.unplug();
    EXPECT_FALSE(bus->send(frame("203#00")));
    EXPECT_THAT(bus->fault(), HasSubstr("unplugged"));
}

TEST(SlcanBus, AnAdapterThatTakesNothingIsAFaultAndOldCommandsAreNotKept) {
    SlcanTerminal deaf;
    CanConfig config = slcan_at(deaf.path());
    config.slcan_silent = true;
    const auto bus = open_can_bus(config);
    for (int i = 0; i < 5000 && bus->fault().empty(); ++i) {
        bus->send(frame("203#0100000A0A000000"));
        usleep(bus->counts().dropped > 0 ? 10000 : 0);
    }
    EXPECT_THAT(bus->fault(), HasSubstr("takes nothing"));
    std::size_t kept = 0;
    for (std::size_t more = 1; more > 0; kept += more) {
        more = deaf.receive(0.0).size();
    }
    EXPECT_LT(kept, bus->counts().sent) << "forgotten";
}

TEST(SlcanBus, AnAdapterThatAnswersNoMoreIsAFault) {
    SlcanTerminal terminal;
    CanConfig config = slcan_at(terminal.path());
    config.slcan_silent = true;
    const auto bus = open_can_bus(config);
    ASSERT_TRUE(becomes(terminal, true));
    bus->receive(0.05);  // the answers to opening
    // As long as it answers, all is well, however long it has nothing to answer.
    for (int i = 0; i < 5; ++i) {
        EXPECT_TRUE(bus->send(frame("203#00")));
        EXPECT_EQ(terminal.receive(kLong).size(), 1U);
        usleep(100000);
    }
    EXPECT_EQ(bus->fault(), "");
    for (int i = 0; i < 2000 && bus->send(frame("203#00")); ++i) {
        usleep(10000);
    }
    EXPECT_THAT(bus->fault(), HasSubstr("answers no more"));
}

TEST(SlcanBus, OpeningSaysWhatIsWrong) {
    const test::TempFolder folder;
    const auto refusal = [](const CanConfig& config) {
        return error_of([&config] { open_can_bus(config); });
    };
    EXPECT_THAT(refusal(slcan_at((folder / "none").string())), HasSubstr("is it plugged in?"));
    EXPECT_THAT(refusal(slcan_at(folder.write("file", "x").string())),
                HasSubstr("not a serial port"));
    SlcanTerminal mute;
    EXPECT_THAT(refusal(slcan_at(mute.path())), HasSubstr("no answer"));

    LiveAdapter adapter;
    CanConfig config = slcan_at(adapter.path());
    config.bit_rate = 83333;
    EXPECT_THAT(refusal(config), HasSubstr("bit_rate: SLCAN has 10000"));
    config = slcan_at(adapter.path());
    config.baud = 12345;  // any, as far as the device can do it
    const auto bus = open_can_bus(config);
    EXPECT_THAT(refusal(config), HasSubstr("in use by another program"));
}

TEST(SlcanBus, AnAdapterThatRefusesIsNotUsed) {
    // Answers no to whatever comes: bells are on the line before they are asked for.
    SlcanTerminal refusing;
    std::atomic<bool> end{false};
    std::thread bells([&] {
        while (!end) {
            refusing.write("\a");
            usleep(5000);
        }
    });
    EXPECT_THAT(error_of([&] { open_can_bus(slcan_at(refusing.path())); }),
                HasSubstr("refuses 250000 bits per second"));
    end = true;
    bells.join();
}

TEST(SlcanTerminal, SendsOnlyWhileTheBusIsOpen) {
    SlcanTerminal terminal;
    terminal.send(frame("183#00"));
    EXPECT_EQ(terminal.dropped(), 1U);
    EXPECT_TRUE(terminal.receive(0.01).empty());
    CanConfig config = slcan_at(terminal.path());
    config.slcan_silent = true;
    {
        const auto bus = open_can_bus(config);
        ASSERT_TRUE(becomes(terminal, true));
        terminal.send(frame("183#00"));
        EXPECT_EQ(bus->receive(kLong), frame("183#00"));
    }
    // The host's last words are there though it has gone.
    EXPECT_TRUE(becomes(terminal, false));
}

}  // namespace
}  // namespace hybrid_slam
