// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <random>
#include <set>

#include "hybrid_slam/core/error.hpp"
#include "navigation.hpp"
#include "navigation/fault_trial.hpp"

namespace hybrid_slam {
namespace {

using test::Fault;
using test::FaultOutcome;

constexpr double kAsked = 0.4;  ///< seconds

/// All trials of one fault.
struct Row {
    int count = 0;
    int standing = 0;  ///< trials that did not count: it happened to drive slowly
    double worst = 0.0;
    double sum = 0.0;
    double rolled = 0.0;
    int never = 0;  ///< did not stop
    int moved_later = 0;
    int arrived = 0;
    int reported = 0;
    std::set<std::string> reasons;

    void take(const FaultOutcome& outcome) {
        ++count;
        arrived += outcome.arrived ? 1 : 0;
        reported += outcome.reported ? 1 : 0;
        std::string reason = outcome.reason.substr(0, 80);
        std::replace_if(
            reason.begin(), reason.end(),
            [](char letter) { return letter >= '0' && letter <= '9'; },
            '#');  // ports, which differ each time
        reasons.insert(reason);
        moved_later += outcome.stopping.moved_later;
        if (!outcome.stopping.seconds) {
            ++never;
            return;
        }
        worst = std::max(worst, *outcome.stopping.seconds);
        sum += *outcome.stopping.seconds;
        rolled = std::max(rolled, outcome.stopping.rolled);
    }
};

/// Those that come in two kinds share the trials.
int trials_of(Fault fault, int runs) {
    switch (fault) {
        case Fault::kLinkCut:
        case Fault::kPoseFrozen:
            return (runs + 1) / 2;
        case Fault::kLinkClosed:
        case Fault::kPoseRestamped:
            return std::max(1, runs / 2);
        default:
            return runs;
    }
}

Row try_often(const test::LoopMap& map, Fault fault, int runs) {
    std::mt19937 random(static_cast<unsigned>(fault) + 1U);
    const double longest = drives_on(fault) ? 2.0 : 4.0;  // the one way is shorter
    Row row;
    const int trials = trials_of(fault, runs);
    for (int attempt = 1; row.count < trials && attempt <= 3 * trials; ++attempt) {
        const double after = std::uniform_real_distribution<double>(0.2, longest)(random);
        const FaultOutcome outcome = test::try_fault(map, fault, attempt, after);
        if (outcome.drove) {
            row.take(outcome);
        } else {
            ++row.standing;
        }
    }
    return row;
}

/// How many figures miss.
int print(Fault fault, const Row& row, std::ostream& out) {
    if (drives_on(fault)) {
        out << fmt::format("  {:24} {:3}   drives on and arrives: {}, reported: {}\n",
                           name_of(fault), row.count, row.arrived, row.reported);
    } else {
        const int stopped = row.count - row.never;
        out << fmt::format("  {:24} {:3}   {:6.3f} {:6.3f}   {:6.3f}   {:5} {:5}\n", name_of(fault),
                           row.count, row.sum / std::max(1, stopped), row.worst, row.rolled,
                           row.never, row.moved_later);
    }
    for (const std::string& reason : row.reasons) {
        out << "      says: " << reason << '\n';
    }
    if (row.standing > 0) {
        out << "      not counted, since it did not drive fast just then: " << row.standing << '\n';
    }
    if (drives_on(fault)) {
        return row.count == 0 || row.arrived < row.count || row.reported < row.count ? 1 : 0;
    }
    return row.count == 0 || row.never > 0 || row.moved_later > 0 || row.worst > kAsked ? 1 : 0;
}

}  // namespace

int measure_faults(const NavigationOptions& options, const test::LoopMap& map, std::ostream& out) {
    out << fmt::format(
        "\nFaults at a random moment of driving faster than 0.2 m/s, in real time. Asked: a "
        "command to stand within {} s of the last valid input (adapter: the truck's watchdog lets "
        "go), none to move later\n"
        "  {:24} runs    mean  worst s  rolled m  never  moved\n",
        kAsked, "fault");
    int misses = 0;
    for (const Fault fault : test::kFaults) {
        if (fault == Fault::kBrokerGone && !test::Broker::is_there()) {
            out << "  broker gone: no broker on this computer\n";
            continue;
        }
        misses += print(fault, try_often(map, fault, options.runs > 0 ? options.runs : 20), out);
        out.flush();
    }
    return misses;
}

}  // namespace hybrid_slam
