// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <future>
#include <iostream>
#include <mutex>
#include <random>
#include <thread>

#include "navigation.hpp"
#include "navigation/tour.hpp"

namespace hybrid_slam {
namespace {

constexpr double kClear = 0.5;     ///< metres, of the truck's outline wherever it starts and stops
constexpr double kReached = 0.03;  ///< metres: the follower's tolerance and what SLAM is off
constexpr double kPatience = 900.0;  ///< seconds of the wall clock

struct Draw {
    Pose2d start;
    std::vector<Eigen::Vector2d> places;
};

struct Trial {
    test::Trip trip;
    double missed = 0.0;  ///< metres
    double metres = 0.0;  ///< driven
    int contacts = 0;
};

Pose2d draw_pose(const World& world, std::mt19937& random) {
    const auto uniform = [&](double most) {
        return std::uniform_real_distribution<double>(-most, most)(random);
    };
    for (;;) {
        const double x = uniform(5.0);
        const double y = uniform(3.6);
        const Pose2d pose(x, y, uniform(kPi));
        if (test::true_clearance(world, VehicleConfig(), pose) >= kClear) {
            return pose;
        }
    }
}

/// By its number alone, whoever drives it.
Draw draw_trip(const World& world, int number) {
    std::mt19937 random(static_cast<unsigned>(number));
    Draw draw;
    draw.start = draw_pose(world, random);
    for (int i = 0; i < 2; ++i) {
        draw.places.push_back(draw_pose(world, random).translation);
    }
    return draw;
}

Trial drive_trip(const test::LoopMap& map, const Draw& draw, int seed, bool real_time) {
    test::LoopOptions options;
    options.world_from_start = draw.start;
    options.seed = seed;
    options.lockstep = !real_time;
    options.camera = real_time;
    test::ClosedLoop loop(map, options);
    loop.send_goals(draw.places);
    Trial trial;
    trial.trip = loop.wait_for_arrival(real_time ? 200.0 : kPatience);
    loop.end();
    const test::Json summary = loop.summary();
    trial.missed = (loop.truth().back().pose.translation - draw.places.back()).norm();
    trial.contacts = summary["contacts"].get<int>();
    trial.metres = summary["distance_m"].get<double>();
    return trial;
}

/// Trips that several loops share.
class Trips {
  public:
    Trips(const test::LoopMap& map, int count, bool real_time)
        : map_(map), world_(read_world(map.world)), count_(count), real_time_(real_time) {}

    void work() {
        for (;;) {
            const int number = take_number();
            if (number == 0) {
                return;
            }
            Trial trial = drive_trip(map_, draw_trip(world_, number), number, real_time_);
            const std::lock_guard<std::mutex> lock(mutex_);
            keep(number, trial);
        }
    }
    int print(std::ostream& out) const {
        out << fmt::format(
            "  {}: {} of {} reached (asked all), {} contacts (asked 0); stands {:.1f} cm from the "
            "place at most, {:.1f} cm mean; {:.0f} m driven\n",
            real_time_ ? "real time, with camera" : "lockstep, lidar only", reached_, count_,
            contacts_, 100.0 * worst_, 100.0 * sum_ / std::max(1, arrived_), metres_);
        for (const std::string& story : stories_) {
            out << "      " << story << '\n';
        }
        return reached_ < count_ || contacts_ > 0 ? 1 : 0;
    }

  private:
    int take_number() {
        const std::lock_guard<std::mutex> lock(mutex_);
        std::cerr << fmt::format("\r  {} of {} trips begun, {} reached ", next_, count_, reached_)
                  << std::flush;
        return next_ < count_ ? ++next_ : 0;
    }
    void keep(int number, const Trial& trial) {
        contacts_ += trial.contacts;
        metres_ += trial.metres;
        if (trial.trip.end == test::TripEnd::kArrived) {
            ++arrived_;
            reached_ += trial.missed <= kReached ? 1 : 0;
            worst_ = std::max(worst_, trial.missed);
            sum_ += trial.missed;
        }
        if (trial.trip.end != test::TripEnd::kArrived || trial.missed > kReached ||
            trial.contacts > 0) {
            static constexpr std::array kEnds{"arrived", "refused", "given up", "out of time"};
            stories_.push_back(fmt::format("trip {}: {}, {:.2f} m from the place, {} contacts: {}",
                                           number, kEnds[static_cast<std::size_t>(trial.trip.end)],
                                           trial.missed, trial.contacts, trial.trip.why));
        }
    }

    const test::LoopMap& map_;
    World world_;
    int count_;
    bool real_time_;
    std::mutex mutex_;
    int next_ = 0;
    int reached_ = 0;
    int arrived_ = 0;
    int contacts_ = 0;
    double worst_ = 0.0;
    double sum_ = 0.0;
    double metres_ = 0.0;
    std::vector<std::string> stories_;
};

int drive_trips(const test::LoopMap& map, int count, bool real_time, std::ostream& out) {
    Trips trips(map, count, real_time);
    const unsigned loops = real_time ? 1 : std::min(2U, std::thread::hardware_concurrency());
    std::vector<std::future<void>> workers;
    for (unsigned i = 0; i < loops; ++i) {
        workers.push_back(std::async(std::launch::async, [&] { trips.work(); }));
    }
    for (std::future<void>& worker : workers) {
        worker.get();
    }
    std::cerr << '\n';
    return trips.print(out);
}

}  // namespace

int measure_random_trips(const NavigationOptions& options, const test::LoopMap& map,
                         std::ostream& out) {
    const int count = options.runs > 0 ? options.runs : 100;
    out << fmt::format(
        "\nRandom kidnapped starts, two random places each, the truck's outline {} m clear of true "
        "walls at all three; reached: truly within {:.0f} cm\n",
        kClear, 100.0 * kReached);
    const int misses = drive_trips(map, count, false, out);
    out.flush();
    return misses + drive_trips(map, std::min(3, count), true, out);
}

}  // namespace hybrid_slam
