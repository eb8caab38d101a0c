// SPDX-License-Identifier: Apache-2.0
#include <fmt/ostream.h>

#include <algorithm>
#include <ctime>

#include "hybrid_slam/sensors/sensor_source.hpp"
#include "vision.hpp"

namespace hybrid_slam {
namespace {

constexpr double kDistance = 10.0;  ///< metres
constexpr double kAsked = 60.0;     ///< images per second

double cpu_seconds() {
    return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

/// Yields what was drawn before, so that drawing is not in the way of what is measured.
class Events : public SensorStream {
  public:
    explicit Events(SensorStream& stream) {
        while (auto event = stream.next()) {
            events_.push_back(std::move(*event));
        }
    }
    std::optional<SensorEvent> next() override {
        return place_ < events_.size() ? std::optional(events_[place_++]) : std::nullopt;
    }
    void rewind() { place_ = 0; }

  private:
    std::vector<SensorEvent> events_;
    std::size_t place_ = 0;
};

/// Processor seconds of all threads for the images of a drive.
struct Cost {
    double decoding = 0.0;
    double tracking = 0.0;
    double slowest = 0.0;  ///< image
    std::size_t images = 0;
};

Cost cost_of(Events& events, const RobotConfig& robot, const VisualOdometryConfig& config) {
    events.rewind();
    SensorSource source(events, robot, SensorSource::Images::kGray);
    VisualOdometry viewer(robot.camera.model, robot.camera.mounting, config);
    Cost cost;
    for (;;) {
        const double start = cpu_seconds();
        const auto measurement = source.next();
        if (!measurement) {
            return cost;
        }
        const double there = cpu_seconds();
        if (const auto* scan = std::get_if<Scan>(&*measurement)) {
            viewer.see(*scan);
        } else {
            viewer.track(std::get<Image>(*measurement));
            cost.decoding += there - start;
            ++cost.images;
        }
        const double seconds = cpu_seconds() - there;
        cost.tracking += seconds;
        cost.slowest = std::max(cost.slowest, seconds);
    }
}

}  // namespace

int measure_vision_speed(const VisionOptions& options, std::ostream& out) {
    const RobotConfig robot;
    SimulatedDriveConfig drive;
    drive.distance = kDistance;
    SimulatedVehicle vehicle(read_world(options.worlds / "thesis_hall.yaml"), "figure_eight", robot,
                             drive);
    Events events(vehicle);
    fmt::print(out,
               "Speed: thesis hall, figure_eight, {:g} m at {:g} m/s, seed {}, images of {} x {}; "
               "by processor time of all threads\n",
               kDistance, drive.speed, drive.seed, robot.camera.model.width,
               robot.camera.model.height);
    int misses = 0;
    for (const VisualMethod method : {VisualMethod::kThesis, VisualMethod::kJoint}) {
        VisualOdometryConfig config = read_way({}, options.overrides).vo;
        config.method = method;
        const Cost cost = cost_of(events, robot, config);
        const auto images = static_cast<double>(cost.images);
        const double rate = images / cost.tracking;
        const bool good = method == VisualMethod::kThesis || rate >= kAsked;
        misses += good ? 0 : 1;
        fmt::print(out,
                   "VO, {:<7} {:>6.0f} images/s ({:.2f} ms, slowest {:.2f} ms)   asked {:g}   {}   "
                   "JPEG decoding beside {:.2f} ms\n",
                   to_string(method), rate, 1e3 * cost.tracking / images, 1e3 * cost.slowest,
                   kAsked, good ? "ok" : "MISS", 1e3 * cost.decoding / images);
    }
    fmt::print(out, "\n");
    return misses;
}

}  // namespace hybrid_slam
