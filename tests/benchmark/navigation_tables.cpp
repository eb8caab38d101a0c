// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>

#include "hybrid_slam/core/error.hpp"
#include "navigation.hpp"
#include "navigation/tour.hpp"

namespace hybrid_slam {
namespace {

using test::TourErrors;
using test::TourResult;

constexpr double kDuration = 75.0;  ///< seconds of the simulator's clock; the tour takes 31 to 50

struct Worst {
    TourErrors errors;
    double passed = 0.0;
    double missed = 0.0;
    int contacts = 0;
    int not_arrived = 0;
    std::string why;

    void take(const TourErrors& other) {
        errors.start = std::max(errors.start, other.start);
        errors.first = std::max(errors.first, other.first);
        errors.second = std::max(errors.second, other.second);
    }
    void take(const TourResult& result) {
        take(result.slam);
        passed = std::max(passed, result.passed);
        missed = std::max(missed, result.missed);
        contacts += result.contacts;
        not_arrived += result.arrived ? 0 : 1;
        why += result.arrived ? "" : result.why + "; ";
    }
};

/// The same scans by the plain ICP of the thesis's table 4.33: no map, placed at the true start.
TourErrors by_plain_icp(const test::ClosedLoop& loop, const test::LoopMap& map, int seed,
                        const std::filesystem::path& configs) {
    const auto recording = loop.folder() / "again";
    test::record_again(loop, map, seed, recording);
    const auto out = loop.folder() / "plain";
    const int code = test::run_process(
        {map.program, "map", recording, "--config", configs / "plain_icp.yaml", "--out", out, "-q"},
        loop.folder(), loop.folder() / "plain.txt");
    if (code != 0) {
        throw Error("map: " + test::contents_of(loop.folder() / "plain.txt"));
    }
    Trajectory estimate = read_tum(out / "trajectory.tum");
    const Pose2d world_from_map = test::kTourStart * estimate.front().pose.inverse();
    for (StampedPose& pose : estimate) {
        pose.pose = world_from_map * pose.pose;
    }
    return test::tour_errors(estimate, loop.truth());
}

struct Tables {
    Worst slam;
    Worst plain;
};

Tables drive_tours(const NavigationOptions& options, const test::LoopMap& map, bool camera) {
    Tables tables;
    for (int seed = 1; seed <= options.seeds; ++seed) {
        test::LoopOptions loop_options;
        loop_options.world_from_start = test::kTourStart;
        loop_options.seed = seed;
        loop_options.lockstep = true;
        loop_options.camera = camera;
        loop_options.duration = kDuration;
        test::ClosedLoop loop(map, loop_options);
        loop.send_goals(test::kTourPlaces);
        const test::Trip trip = loop.wait_for_arrival(600.0);
        loop.wait_for_end(600.0);
        tables.slam.take(test::judge_tour(loop, map, trip));
        if (!camera) {
            tables.plain.take(by_plain_icp(loop, map, seed, options.worlds.parent_path()));
        }
    }
    return tables;
}

void print_errors(const char* name, const TourErrors& errors, std::ostream& out) {
    out << fmt::format("  {:32} {:6.1f} {:8.1f} {:8.1f}\n", name, 100.0 * errors.start,
                       100.0 * errors.first, 100.0 * errors.second);
}

int print_slam(const char* name, const Worst& worst, std::ostream& out) {
    print_errors(name, worst.errors, out);
    out << fmt::format(
        "      the truck stops {:.1f} cm from the last place (asked 2) and passes the first at "
        "{:.1f} cm; contacts {}, not arrived {} {}\n",
        100.0 * worst.missed, 100.0 * worst.passed, worst.contacts, worst.not_arrived, worst.why);
    const double error = std::max({worst.errors.start, worst.errors.first, worst.errors.second});
    return error > 0.01 || worst.missed > 0.02 || worst.contacts + worst.not_arrived > 0 ? 1 : 0;
}

}  // namespace

int measure_tables(const NavigationOptions& options, const test::LoopMap& map, std::ostream& out) {
    out << fmt::format(
        "\nTables 4.26 to 4.29: kidnapped to (0, 160) cm, past (130, -15) to (-240, -160) cm, "
        "sigma "
        "2 cm; lockstep, worst of {} seeds, cm off the truth\n"
        "  {:32} {:>6} {:>8} {:>8}\n",
        options.seeds, "", "start", "place 1", "place 2");
    print_errors("asked", {0.01, 0.01, 0.01}, out);
    print_errors("thesis", {0.079, 0.012, 0.124}, out);
    const Tables lidar = drive_tours(options, map, false);
    int misses = print_slam("lidar only", lidar.slam, out);
    out.flush();
    misses += print_slam("lidar and camera", drive_tours(options, map, true).slam, out);
    print_errors("thesis, plain ICP (4.33)", {0.06, 0.21, 2.95}, out);
    print_errors("plain ICP, the same lidar scans", lidar.plain.errors, out);
    return misses;
}

}  // namespace hybrid_slam
