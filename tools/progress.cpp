// SPDX-License-Identifier: Apache-2.0
#include "progress.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <utility>

#include "messages.hpp"

namespace hybrid_slam::tools {
namespace {

constexpr double kRedrawAfter = 0.1;  // seconds

std::string bar(double share) {
    constexpr std::size_t kWidth = 24;
    const auto filled = static_cast<std::size_t>(std::clamp(share, 0.0, 1.0) * kWidth);
    return "[" + std::string(filled, '#') + std::string(kWidth - filled, '.') + "]";
}

void draw(const std::string& text) {
    fmt::print(stderr, "\r{}\x1b[K", text);  // ESC [ K clears the rest of the line
    std::fflush(stderr);
}

}  // namespace

Progress::Progress(std::string label, bool quiet)
    : label_(std::move(label)), visible_(!quiet && isatty(STDERR_FILENO) == 1) {}

Progress::~Progress() {
    if (visible_ && drawn_at_ > 0.0) {
        draw("");
    }
}

void Progress::update(double share, std::size_t scans, double recorded) {
    const double elapsed = clock_.seconds();
    if (!visible_ || elapsed < drawn_at_ + kRedrawAfter) {
        return;
    }
    drawn_at_ = elapsed;
    std::string text = label_ + " ";
    if (share >= 0.0) {
        text += fmt::format("{} {:3.0f} %  ", bar(share), 100.0 * share);
    }
    text +=
        fmt::format("{} scans  {:.0f}/s", with_commas(scans), static_cast<double>(scans) / elapsed);
    if (recorded > 0.0) {
        text += fmt::format("  {:.0f} x real time", recorded / elapsed);
    }
    draw(text);
}

void Progress::say(const std::string& what) {
    if (visible_ && drawn_at_ > 0.0) {
        draw(label_ + " " + what);
    }
}

}  // namespace hybrid_slam::tools
