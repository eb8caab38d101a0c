// SPDX-License-Identifier: Apache-2.0
#include "place_query.hpp"

#include <fmt/format.h>

#include <cmath>
#include <optional>
#include <utility>

#include "frame_stream.hpp"
#include "hybrid_slam/core/error.hpp"
#include "interrupt.hpp"
#include "messages.hpp"

namespace hybrid_slam::tools {
namespace {

constexpr std::size_t kLeastPoints = 20;  ///< of a scan that is good enough to ask about

/// Keeps the scans of a drive that are far enough from each other.
class Collector {
  public:
    explicit Collector(const LocalizationConfig& config)
        : config_(config), odometry_(config.odometry) {}

    void add(const Frame& frame) {
        OdometryResult odometry = odometry_.register_frame(frame);
        if (odometry.surface.size() < kLeastPoints) {
            return;  // somebody stands before the scanner: there is nothing to ask about
        }
        newest_ = {odometry.local_from_robot,
                   {frame.scan.robot_from_laser.translation, std::move(odometry.surface)}};
        scan_ = frame.scan;
        if (kept_.empty()) {
            kept_.push_back(*newest_);
        } else if (is_far_enough()) {
            path_ += step().translation.norm();
            kept_.push_back(*newest_);
        }
    }

    bool started() const { return !kept_.empty(); }
    double path() const { return path_ + (kept_.empty() ? 0.0 : step().translation.norm()); }

    PlaceQuery finish() const {
        PlaceQuery query;
        query.scan = scan_;
        query.path = path();
        query.query.push_back(newest_->sweep);
        for (auto kept = kept_.rbegin(); kept != kept_.rend(); ++kept) {
            const Pose2d newest_from_kept =
                between(newest_->local_from_robot, kept->local_from_robot);
            if (kept != kept_.rbegin() || is_far_enough()) {
                query.query.push_back(transform(newest_from_kept, kept->sweep));
            }
        }
        return query;
    }

  private:
    struct Stand {
        Pose2d local_from_robot;
        Sweep sweep;
    };

    Pose2d step() const {
        return between(kept_.back().local_from_robot, newest_->local_from_robot);
    }
    bool is_far_enough() const {
        return step().translation.norm() >= config_.query_spacing ||
               std::abs(step().heading) >= config_.query_angle;
    }

    LocalizationConfig config_;
    Odometry odometry_;
    std::optional<Stand> newest_;
    Scan scan_;
    std::vector<Stand> kept_;
    double path_ = 0.0;
};

}  // namespace

PlaceQuery query_of(const Scan& scan, const LocalizationConfig& config) {
    PlaceQuery query;
    query.scan = scan;
    query.query.push_back(
        {scan.robot_from_laser.translation, to_surface(scan, config.odometry.filter)});
    return query;
}

void expect_enough(const PlaceQuery& query, const std::string& name) {
    const std::size_t points = query.query.front().surface.size();
    if (points == 0) {
        throw Error(name + ": no beam of the scan returned");
    }
    if (points < kLeastPoints) {
        throw Error(fmt::format("{}: key 'ranges' has {} of use, at least {} are needed", name,
                                counted(points, "return"), kLeastPoints));
    }
}

PlaceQuery collect_query(Input& input, const std::string& name, const LocalizationConfig& config,
                         const QuerySpan& span) {
    FrameStream stream(input);
    Collector collector(config);
    std::optional<double> first;
    while (!interrupted()) {
        const std::optional<DriveStep> step = stream.next();
        if (!step) {
            break;
        }
        if (!step->frame) {
            continue;
        }
        const double stamp = step->frame->scan.stamp;
        first = first.value_or(stamp);
        if (stamp < *first + span.at) {
            continue;
        }
        collector.add(*step->frame);
        if (collector.started() && collector.path() >= span.drive) {
            return collector.finish();
        }
    }
    if (interrupted()) {
        return {};
    }
    if (!collector.started()) {
        throw Error(fmt::format("{}: no usable scan in it{}", name,
                                span.at > 0.0 ? fmt::format(" from {:g} s on", span.at) : ""));
    }
    PlaceQuery query = collector.finish();
    query.complete = false;
    return query;
}

}  // namespace hybrid_slam::tools
