// SPDX-License-Identifier: Apache-2.0
#include "localization_monitor.hpp"

#include <fmt/format.h>

#include "messages.hpp"
#include "place_report.hpp"

namespace hybrid_slam::tools {
namespace {

constexpr double kDrawEvery = 0.25;  ///< seconds, on a terminal
constexpr double kSayEvery = 10.0;   ///< seconds, into a log

std::string state_text(const LocalizationResult& result) {
    std::string text(to_string(result.status));
    if (result.map_from_robot) {
        return text + fmt::format(": {}; sigma {}; score {:.2f}, {:.0f} % unmapped",
                                  pose_text(*result.map_from_robot), sigmas_text(result.covariance),
                                  result.score, 100.0 * result.fit.unmapped);
    }
    if (const auto& found = result.relocalization) {
        text += fmt::format(": {}, {}", words_for(found->verdict),
                            counted(found->places.size(), "place"));
    }
    return text;
}

std::string jump_text(const Jump& jump) {
    return fmt::format("jump of {:.2f} m: {} -> {}", between(jump.from, jump.to).translation.norm(),
                       pose_text(jump.from), pose_text(jump.to));
}

}  // namespace

LocalizationMonitor::LocalizationMonitor(const std::string& name, bool live, bool quiet)
    : name_(name), live_(live), bar_(name, quiet || live), line_(quiet || !live) {}

void LocalizationMonitor::look(const LocalizationResult& result, const Progressed& progressed) {
    if (live_) {
        rate_.look(clock_.seconds(), progressed.scans);
        tell(result);
    } else {
        bar_.update(progressed.share, progressed.scans, progressed.recorded);
    }
}

void LocalizationMonitor::tell(const LocalizationResult& result) {
    if (result.jump) {
        line_.clear();
        print_warning(jump_text(*result.jump));
    }
    const bool news = status_ != result.status;
    status_ = result.status;
    if (news || (!line_.visible() && clock_.seconds() >= next_line_)) {
        line_.clear();
        print_info(state_text(result));
        next_line_ = clock_.seconds() + (line_.visible() ? 0.0 : kSayEvery);
    }
    if (line_.visible() && clock_.seconds() >= next_line_) {
        line_.draw(fmt::format("{}; {:.1f} scans/s", state_text(result), rate_.rate()));
        next_line_ = clock_.seconds() + kDrawEvery;
    }
}

}  // namespace hybrid_slam::tools
