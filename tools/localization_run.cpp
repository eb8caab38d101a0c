// SPDX-License-Identifier: Apache-2.0
#include "localization_run.hpp"

#include <algorithm>
#include <utility>

#include "frame_stream.hpp"
#include "hybrid_slam/core/error.hpp"
#include "interrupt.hpp"
#include "messages.hpp"
#include "pose_trust.hpp"

namespace hybrid_slam::tools {
namespace {

/// The loop over one input.
class Runner {
  public:
    Runner(Input& input, Localizer& localizer, LocalizationLog& log, LocalizationMonitor& monitor,
           LocalizationListener* listener)
        : input_(input),
          stream_(input),
          localizer_(localizer),
          log_(log),
          monitor_(monitor),
          listener_(listener) {}

    bool saw_anything() const { return stream_.saw_anything(); }

    LocalizationRun run() {
        Stopwatch read_clock;
        while (!run_.interrupted) {
            const std::optional<DriveStep> step = stream_.next();
            if (!step) {
                run_.interrupted = input_.live() && interrupted();  // a recording has an end
                break;
            }
            if (step->motion) {
                follow(*step->motion);
            }
            if (step->frame) {
                run_.read.add(read_clock.seconds());
                process(*step->frame);
                read_clock = Stopwatch();
            }
            run_.interrupted = interrupted();
        }
        if (!has_warned_) {
            log_.save();
        }
        run_.scans = stream_.frames();
        run_.recorded = stream_.recorded();
        run_.input = input_.counts();
        run_.warnings = input_.warnings();
        run_.vision = watch_.finish();
        return std::move(run_);
    }

  private:
    void follow(const VisualMotion& motion) {
        watch_.see(motion);
        const std::optional<PredictedPose> pose = localizer_.predict(motion);
        if (pose && trust_.known() && log_.keeps_run()) {
            run_.camera_poses.push_back({pose->stamp, pose->map_from_robot});
        }
    }

    void process(const Frame& frame) {
        const Stopwatch clock;
        if (listener_ != nullptr) {
            listener_->before(localizer_);
        }
        const LocalizationResult result = localizer_.process(frame);
        run_.scan.add(clock.seconds());
        trust_.see(result);
        if (listener_ != nullptr) {
            listener_->after(frame, result, trust_.known());
        }
        write_down(result);
        count(result);
        monitor_.look(result, {input_.source().progress(), stream_.frames(), stream_.recorded()});
    }

    /// While others drive by it, a full disk is no reason to end.
    void write_down(const LocalizationResult& result) {
        try {
            log_.add(result, trust_.sure());
        } catch (const Error& error) {
            if (listener_ == nullptr) {
                throw;
            }
            if (!has_warned_) {
                print_warning(std::string(error.what()) + "; the run goes on without its files");
                has_warned_ = true;
            }
        }
    }

    void count(const LocalizationResult& result) {
        first_stamp_ = first_stamp_.value_or(result.stamp);
        if (stream_.frames() > 1) {
            watch_.see_scan(result.visual_lag);
            ++run_.priors_used[std::string(to_string(result.prior_used))];
        }
        ++run_.statuses[std::string(to_string(result.status))];
        if (trust_.known()) {
            run_.found_after = run_.found_after.value_or(result.stamp - *first_stamp_);
        }
        if (trust_.sure()) {
            ++run_.trusted;
            run_.score_sum += result.score;
            run_.unmapped_sum += result.fit.unmapped;
            run_.misfit_sum += result.fit.rms;
        }
        if (result.jump && log_.keeps_run()) {
            run_.jumps.push_back(*result.jump);
        }
        if (result.relocalization) {
            count(*result.relocalization);
        }
        keep(result);
    }

    void count(const Relocalization& relocalization) {
        run_.most_nodes = std::max(run_.most_nodes, relocalization.nodes);
        if (!relocalization.of_filter) {
            ++run_.searches[relocalization.verdict];
        }
    }

    /// A vehicle that drives for months keeps none of its way in memory.
    void keep(const LocalizationResult& result) {
        const bool follows = was_known_ && !result.jump;
        if (result.map_from_robot && (trust_.known() || was_known_)) {
            if (follows) {
                run_.path += between(last_, *result.map_from_robot).translation.norm();
            }
            last_ = *result.map_from_robot;
            if (log_.keeps_run()) {
                run_.way.push_back({last_, result.status, follows});
            }
        }
        if (trust_.known() && log_.keeps_run()) {
            run_.trajectory.push_back({result.stamp, last_});
        }
        was_known_ = trust_.known();
    }

    Input& input_;
    FrameStream stream_;
    Localizer& localizer_;
    LocalizationLog& log_;
    LocalizationMonitor& monitor_;
    LocalizationListener* listener_;
    VisionWatch watch_;
    PoseTrust trust_;
    LocalizationRun run_;
    std::optional<double> first_stamp_;
    bool was_known_ = false;
    bool has_warned_ = false;  ///< of files that cannot be written
    Pose2d last_;
};

}  // namespace

std::size_t LocalizationRun::with(LocalizationStatus status) const {
    const auto found = statuses.find(std::string(to_string(status)));
    return found == statuses.end() ? 0 : found->second;
}

double LocalizationRun::share_of(LocalizationStatus status) const {
    return scans == 0 ? 0.0 : static_cast<double>(with(status)) / static_cast<double>(scans);
}

double LocalizationRun::mean_of(double sum) const {
    return trusted == 0 ? 0.0 : sum / static_cast<double>(trusted);
}

PlaceVerdict LocalizationRun::why_not_found() const {
    std::size_t all = 0;
    for (const auto& [verdict, count] : searches) {
        all += count;
    }
    if (all == 0) {
        return PlaceVerdict::kUnfinished;
    }
    const auto missed = searches.find(PlaceVerdict::kNotInMap);
    return missed != searches.end() && 2 * missed->second > all ? PlaceVerdict::kNotInMap
                                                                : PlaceVerdict::kAmbiguous;
}

LocalizationRun run_localization(Input& input, Localizer& localizer, LocalizationLog& log,
                                 LocalizationMonitor& monitor, LocalizationListener* listener) {
    const Stopwatch clock;
    const double cpu_at_start = cpu_seconds();
    Runner runner(input, localizer, log, monitor, listener);
    LocalizationRun run = runner.run();
    if (!runner.saw_anything() && !run.interrupted) {
        throw Error(monitor.name() + ": no usable scan in it");
    }
    run.name = monitor.name();
    run.total = clock.seconds();
    run.cpu = cpu_seconds() - cpu_at_start;
    return run;
}

}  // namespace hybrid_slam::tools
