// SPDX-License-Identifier: Apache-2.0
#include <fmt/ostream.h>

#include <algorithm>

#include "vision.hpp"

namespace hybrid_slam {
namespace {

constexpr int kSeed = 1;
constexpr double kDistance = 30.0;    ///< metres
constexpr double kFaultBegin = 50.0;  ///< seconds of about 105
constexpr double kCoveredFor = 5.0;   ///< seconds
constexpr double kDimmedFor = 30.0;   ///< seconds
constexpr double kAskedError = 0.02;  ///< metres, or twice that of the clean drive
constexpr double kAskedTold = 0.9;    ///< share of the covered images

struct Fault {
    std::string name;
    std::string world;
    RenderConfig render;
    double least_unusable = 0.0;  ///< images that have to be told unusable
};

std::vector<Fault> faults() {
    const double rate = RobotConfig().camera.rate;
    std::vector<Fault> all{{"clean", "thesis_hall.yaml", {}},
                           {"camera covered for 5 s", "thesis_hall.yaml", {}},
                           {"half the light for 30 s", "thesis_hall.yaml", {}},
                           {"a person walking", "thesis_hall_person.yaml", {}}};
    all[1].render.covered = {kFaultBegin, kFaultBegin + kCoveredFor};
    all[1].least_unusable = kAskedTold * kCoveredFor * rate;
    all[2].render.dimmed = {kFaultBegin, kFaultBegin + kDimmedFor};
    return all;
}

std::size_t unusable(const std::map<VisualStatus, std::size_t>& statuses) {
    std::size_t images = 0;
    for (const auto& [status, count] : statuses) {
        VisualMotion motion;
        motion.status = status;
        images += motion.usable() ? 0 : count;
    }
    return images;
}

}  // namespace

int measure_faults(const VisionOptions& options, std::ostream& out) {
    const std::vector<Way> ways = comparison_ways(options);
    fmt::print(
        out,
        "Faults: figure_eight, {:g} m at 0.3 m/s from second {:g} on, seed {}; VO-seeded ICP "
        "+ graph; asked: no ICP failure, told by the status, errors within the larger of "
        "{:g} cm and twice the clean ones\n{:<24} {:>8} {:>8} {:>8} {:>8}\n",
        kDistance, kFaultBegin, kSeed, 100.0 * kAskedError, "cm", "RMSE", "at end", "greatest",
        "failures");
    int misses = 0;
    DriveErrors clean;
    for (const Fault& fault : faults()) {
        DriveChoice choice{read_world(options.worlds / fault.world), "figure_eight", {}};
        choice.config.distance = kDistance;
        choice.config.render = fault.render;
        choice.config.seed = kSeed;
        const SeenDrive drive = see_drive(choice, ways[kSeededGraph].vo);
        const DriveErrors errors = errors_of(replay(drive, ways[kSeededGraph]), drive.truth);
        clean = fault.name == "clean" ? errors : clean;
        const auto& statuses = drive.statuses.at(ways[kSeededGraph].vo.method);
        const bool good = errors.icp_failures == 0 &&
                          errors.rmse <= std::max(kAskedError, 2.0 * clean.rmse) &&
                          errors.at_end <= std::max(kAskedError, 2.0 * clean.at_end) &&
                          static_cast<double>(unusable(statuses)) >= fault.least_unusable;
        misses += good ? 0 : 1;
        fmt::print(out, "{:<24} {:>8.2f} {:>8.2f} {:>8.2f} {:>8}   {:<4}   images: {}\n",
                   fault.name, 100.0 * errors.rmse, 100.0 * errors.at_end, 100.0 * errors.greatest,
                   errors.icp_failures, good ? "ok" : "MISS", words_of(statuses));
        out.flush();
    }
    fmt::print(out, "\n");
    return misses;
}

}  // namespace hybrid_slam
