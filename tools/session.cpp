// SPDX-License-Identifier: Apache-2.0
#include "session.hpp"

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>

#include "hybrid_slam/core/error.hpp"
#include "interrupt.hpp"
#include "messages.hpp"
#include "progress.hpp"

namespace hybrid_slam::tools {
namespace {

double length_of(const Trajectory& trajectory) {
    double length = 0.0;
    for (std::size_t i = 1; i < trajectory.size(); ++i) {
        length += (trajectory[i].pose.translation - trajectory[i - 1].pose.translation).norm();
    }
    return length;
}

/// The loop over one log.
class Runner {
  public:
    Runner(const std::filesystem::path& file, const Settings& settings)
        : log_(file, settings.log), slam_(settings.slam) {
        session_.log = file;
    }

    void run(Progress& progress) {
        while (!session_.interrupted) {
            const std::optional<Frame> frame = next_frame();
            if (!frame) {
                break;
            }
            process(*frame);
            progress.update(log_.progress(), session_.scans, latest_ - earliest_);
            session_.interrupted = interrupted();
        }
        session_.input = log_.counts();
        session_.recorded = std::max(0.0, latest_ - earliest_);
    }

    Session finish() {
        const Stopwatch clock;
        session_.refinement = slam_.refine();
        session_.timings.refine = clock.seconds();
        session_.map = slam_.map();
        session_.path = length_of(session_.map.trajectory);
        return std::move(session_);
    }

    bool saw_anything() const { return saw_anything_; }

  private:
    std::optional<Frame> next_frame() {
        const Stopwatch clock;
        std::optional<Frame> frame;
        while (!frame) {
            std::optional<Measurement> measurement = log_.next();
            if (!measurement) {
                return std::nullopt;
            }
            frame = assembler_.push(std::move(*measurement));
        }
        session_.timings.read.add(clock.seconds());
        return frame;
    }

    void process(const Frame& frame) {
        const Scan& scan = frame.scan;
        saw_anything_ = saw_anything_ || std::any_of(scan.ranges.begin(), scan.ranges.end(),
                                                     [&](float r) { return scan.is_return(r); });
        earliest_ = std::min(earliest_, scan.stamp);
        latest_ = std::max(latest_, scan.stamp);
        if (frame.odom_from_robot) {
            session_.wheels.push_back({scan.stamp, *frame.odom_from_robot});
        }
        count(slam_.process(frame));
    }

    void count(const SlamResult& result) {
        ++session_.scans;
        ++session_.statuses[std::string(to_string(result.status))];
        if (result.status != OdometryStatus::kFirst) {
            ++session_.priors_used[std::string(to_string(result.prior_used))];
        }
        session_.optimizations += result.optimized ? 1 : 0;
        for (const Closure& closure : result.closures) {
            session_.most_search_nodes = std::max(session_.most_search_nodes, closure.nodes);
        }
        SessionTimings& timings = session_.timings;
        timings.odometry.add(result.timings.odometry);
        timings.loop_closing.add(result.timings.loop_closing);
        timings.optimization.add(result.timings.optimization);
        timings.scan.add(result.timings.total());
    }

    CarmenLog log_;
    FrameAssembler assembler_;
    Slam slam_;
    Session session_;
    bool saw_anything_ = false;
    double earliest_ = std::numeric_limits<double>::infinity();
    double latest_ = -std::numeric_limits<double>::infinity();
};

}  // namespace

std::size_t Session::icp_failures() const {
    const auto failed = statuses.find(std::string(to_string(OdometryStatus::kPriorOnly)));
    return failed == statuses.end() ? 0 : failed->second;
}

std::size_t Session::closures_with(ClosureVerdict verdict) const {
    return static_cast<std::size_t>(
        std::count_if(map.closures.begin(), map.closures.end(),
                      [verdict](const Closure& closure) { return closure.verdict == verdict; }));
}

double Session::scans_per_second() const {
    return static_cast<double>(scans) / timings.total;
}

double Session::real_time_factor() const {
    return recorded / timings.total;
}

Session run_session(const std::filesystem::path& log, const Settings& settings, bool quiet,
                    const std::string& label) {
    const Stopwatch clock;
    const double cpu_at_start = cpu_seconds();
    Progress progress(label, quiet);
    Runner runner(log, settings);
    runner.run(progress);
    if (!runner.saw_anything()) {
        throw Error(log.string() + ": no usable scan in this log");
    }
    progress.say("refining the map");
    Session session = runner.finish();
    session.timings.total = clock.seconds();
    session.timings.cpu = cpu_seconds() - cpu_at_start;
    return session;
}

std::vector<std::string> warnings_of(const CarmenLogCounts& counts) {
    const std::pair<std::size_t, const char*> kinds[] = {
        {counts.malformed_lines, "unreadable lines"},
        {counts.torn_last_line, "lines torn at the end"},
        {counts.backward_stamps, "scans stamped earlier than the one before"},
        {counts.duplicate_stamps, "scans stamped like the one before"},
        {counts.bad_poses, "laser lines without usable poses"},
        {counts.not_finite, "ranges that are no numbers"},
    };
    std::vector<std::string> warnings;
    for (const auto& [count, what] : kinds) {
        if (count > 0) {
            warnings.push_back(std::string(what) + ": " + with_commas(count));
        }
    }
    return warnings;
}

}  // namespace hybrid_slam::tools
