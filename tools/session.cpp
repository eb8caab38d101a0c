// SPDX-License-Identifier: Apache-2.0
#include "session.hpp"

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>

#include "hybrid_slam/core/error.hpp"
#include "interrupt.hpp"

namespace hybrid_slam::tools {
namespace {

/// Seconds for which a scan of a recording waits for an image, so that the motion to it is
/// interpolated.
constexpr double kVisualWait = 0.2;

/// The loop over one input.
class Runner {
  public:
    Runner(Input& input, const std::string& name, const Settings& settings)
        : input_(input), assembler_(input.live() ? 0.0 : kVisualWait), slam_(settings.slam) {
        session_.name = name;
    }

    void run(Progress& progress) {
        while (!session_.interrupted) {
            const std::optional<Frame> frame = next_frame();
            if (!frame) {
                break;
            }
            process(*frame);
            progress.update(input_.source().progress(), session_.scans, latest_ - earliest_);
            session_.interrupted = interrupted();
        }
        session_.input = input_.counts();
        session_.warnings = input_.warnings();
        session_.recorded = std::max(0.0, latest_ - earliest_);
        session_.vision = watch_.finish();
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
            std::optional<Measurement> measurement = input_.source().next();
            if (!measurement) {
                return assembler_.flush();
            }
            if (const auto* motion = std::get_if<VisualMotion>(&*measurement)) {
                watch_.see(*motion);
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
            watch_.see_scan(result.visual_lag);
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

    Input& input_;
    FrameAssembler assembler_;
    Slam slam_;
    VisionWatch watch_;
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

std::size_t Session::with_prior(PriorKind kind) const {
    const auto used = priors_used.find(std::string(to_string(kind)));
    return used == priors_used.end() ? 0 : used->second;
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

Session run_session(Input& input, const std::string& name, const Settings& settings,
                    Progress& progress) {
    const Stopwatch clock;
    const double cpu_at_start = cpu_seconds();
    Runner runner(input, name, settings);
    runner.run(progress);
    if (!runner.saw_anything()) {
        throw Error(name + ": no usable scan in it");
    }
    progress.say("refining the map");
    Session session = runner.finish();
    session.timings.total = clock.seconds();
    session.timings.cpu = cpu_seconds() - cpu_at_start;
    return session;
}

}  // namespace hybrid_slam::tools
