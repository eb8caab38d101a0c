// SPDX-License-Identifier: Apache-2.0
#include "session.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "frame_stream.hpp"
#include "hybrid_slam/core/error.hpp"
#include "interrupt.hpp"

namespace hybrid_slam::tools {
namespace {

/// The loop over one input.
class Runner {
  public:
    Runner(Input& input, const std::string& name, const Settings& settings)
        : input_(input), stream_(input), slam_(settings.slam) {
        session_.name = name;
    }

    void run(Progress& progress) {
        while (!session_.interrupted) {
            const std::optional<Frame> frame = next_frame();
            if (!frame) {
                break;
            }
            process(*frame);
            progress.update(input_.source().progress(), session_.scans, stream_.recorded());
            session_.interrupted = interrupted();
        }
        session_.input = input_.counts();
        session_.warnings = input_.warnings();
        session_.recorded = stream_.recorded();
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

    bool saw_anything() const { return stream_.saw_anything(); }

  private:
    std::optional<Frame> next_frame() {
        const Stopwatch clock;
        while (std::optional<DriveStep> step = stream_.next()) {
            if (step->motion) {
                watch_.see(*step->motion);
            }
            if (step->frame) {
                session_.timings.read.add(clock.seconds());
                return std::move(step->frame);
            }
        }
        return std::nullopt;
    }

    void process(const Frame& frame) {
        if (frame.odom_from_robot) {
            session_.wheels.push_back({frame.scan.stamp, *frame.odom_from_robot});
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
    FrameStream stream_;
    Slam slam_;
    VisionWatch watch_;
    Session session_;
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
