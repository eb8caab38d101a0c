// SPDX-License-Identifier: Apache-2.0
#include "lidar_watch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace hybrid_slam {
namespace {

/// What scanners and converters are seen set to.
constexpr std::array<int, 9> kUsualBauds{9600,   19200,  38400,  115200, 125000,
                                         230400, 250000, 500000, 1000000};

std::string other_bauds(int baud) {
    std::string text;
    for (const int other : kUsualBauds) {
        if (other != baud) {
            text += fmt::format("{}{}", text.empty() ? "" : ", ", other);
        }
    }
    return text;
}

}  // namespace

LidarWatch::LidarWatch(const LidarConfig& config, const LiveOptions& options, double opened)
    : config_(config),
      silent_after_(options.silent_after),
      unreadable_after_(options.unreadable_after),
      last_byte_(opened) {}

void LidarWatch::take(const std::vector<std::uint8_t>& bytes, double now) {
    constexpr double kNever = std::numeric_limits<double>::infinity();
    if (bytes.empty()) {
        if (now - last_byte_ >= silent_after_) {
            state_ = DeviceState::kSilent;
            babbles_since_ = kNever;
        }
        return;
    }
    last_byte_ = now;
    if (holds_telegram(bytes)) {
        understood_ = true;
        babbles_since_ = kNever;
        state_ = DeviceState::kStreaming;
        return;
    }
    babbles_since_ = std::min(babbles_since_, now);
    if (now - babbles_since_ >= unreadable_after_) {
        state_ = DeviceState::kUnreadable;
    } else if (state_ == DeviceState::kSilent) {
        state_ = understood_ ? DeviceState::kStreaming : DeviceState::kConnecting;
    }
}

bool LidarWatch::holds_telegram(const std::vector<std::uint8_t>& bytes) {
    if (config_.protocol == LidarProtocol::kThesisWords) {
        return true;  // it has nothing to tell a telegram by
    }
    const std::uint64_t before = decoder_.counts().telegrams;
    decoder_.push(bytes.data(), bytes.size());
    S300Telegram telegram;
    while (decoder_.next(telegram)) {
    }
    return decoder_.counts().telegrams > before;
}

std::string LidarWatch::detail() const {
    switch (state_) {
        case DeviceState::kConnecting:
            return config_.port + ": open, no telegram yet";
        case DeviceState::kSilent:
            return fmt::format(
                "{}: no byte for {:g} s: is the scanner on, is continuous output configured, are "
                "the wires right?",
                config_.port, silent_after_);
        case DeviceState::kUnreadable:
            return fmt::format(
                "{}: bytes arrive but no telegram: the baud rate is probably not {} (set in the "
                "scanner by SICK CDS); others in use: {}",
                config_.port, config_.baud, other_bauds(config_.baud));
        default:
            return {};
    }
}

}  // namespace hybrid_slam
