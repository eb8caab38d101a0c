// SPDX-License-Identifier: Apache-2.0
#include <fmt/ostream.h>

#include <algorithm>
#include <cmath>

#include "hybrid_slam/core/stopwatch.hpp"
#include "localization.hpp"

namespace hybrid_slam {
namespace {

constexpr double kAskedMean = 0.007;  ///< metres
constexpr double kAskedMeanHeading_deg = 0.10;
constexpr double kAskedWorst = 0.015;  ///< metres
constexpr double kAskedWorstHeading_deg = 0.3;
constexpr double kMostBias = 0.02;      ///< metres
constexpr double kAskedListed = 99.0;   ///< percent
constexpr double kAskedMemory = 100.0;  ///< MB

/// Table 4.25 of the thesis: cm and its heading, which counts from +y.
std::vector<Pose2d> table_poses() {
    const double thesis[12][3] = {{-240, 160, 45}, {-240, -160, 135}, {240, -160, 225},
                                  {240, 160, 315}, {-240, 160, 225},  {-240, -160, 315},
                                  {240, -160, 45}, {240, 160, 135},   {0, 0, 0},
                                  {0, 0, 90},      {0, 0, 180},       {0, 0, 270}};
    std::vector<Pose2d> poses;
    for (const auto& [x, y, heading] : thesis) {
        poses.emplace_back(0.01 * x, 0.01 * y, normalize_angle(radians(heading + 90.0)));
    }
    return poses;
}

SimulatedDriveConfig drive_of(double speed, double distance, double bias, int seed) {
    SimulatedDriveConfig config;
    config.speed = speed;
    config.distance = distance;
    config.range_sigma = 0.02;
    config.range_bias = bias;
    config.seed = seed;
    return config;
}

Relocalizer relocalizer_of(const MappedWorld& mapped, RelocalizationMethod method,
                           double grid = 0.0) {
    RelocalizationConfig config;
    config.method = method;
    config.heading_grid = grid;
    return Relocalizer(mapped.reference, config, IcpConfig());
}

struct PoseErrors {
    std::size_t asked = 0;
    std::size_t found = 0;
    std::size_t wrong = 0;
    double distance = 0.0;  ///< metres, sum over those found and right
    double heading = 0.0;
    double worst_distance = 0.0;
    double worst_heading = 0.0;

    void take(const Relocalization& result, const Pose2d& expected) {
        ++asked;
        if (result.verdict != PlaceVerdict::kFound) {
            return;
        }
        const Pose2d off = between(expected, result.places.front().map_from_robot);
        if (!is_there(result.places.front().map_from_robot, expected)) {
            ++wrong;
            return;
        }
        ++found;
        distance += off.translation.norm();
        heading += std::abs(off.heading);
        worst_distance = std::max(worst_distance, off.translation.norm());
        worst_heading = std::max(worst_heading, std::abs(off.heading));
    }
    double mean_cm() const { return 100.0 * distance / static_cast<double>(found); }
    double mean_deg() const { return degrees(heading) / static_cast<double>(found); }
    std::string text() const {
        return fmt::format(
            "{} of {} right, {} wrong; mean {:.2f} cm / {:.3f} deg, worst {:.2f} cm / {:.3f} deg",
            found, asked, wrong, mean_cm(), mean_deg(), 100.0 * worst_distance,
            degrees(worst_heading));
    }
};

}  // namespace

int measure_table_poses(const LocalizationOptions& options, std::ostream& out) {
    const World world = read_world(options.worlds / "thesis_hall.yaml");
    const Pose2d robot_from_laser = RobotConfig().lidar.robot_from_laser();
    PoseErrors search;
    PoseErrors headings;
    PoseErrors biased;
    PoseErrors biased_headings;
    for (int seed = 1; seed <= options.seeds; ++seed) {
        std::mt19937 random(static_cast<unsigned>(seed));
        const MappedWorld mapped = map_world(world, "", drive_of(0.3, 60.0, 0.0, seed));
        const double bias = std::uniform_real_distribution<double>(-kMostBias, kMostBias)(random);
        for (const Pose2d& pose : table_poses()) {
            const Pose2d expected = mapped.map_from_world * pose;
            const Query clean{sweep_at(world, pose, robot_from_laser, 0.02, 0.0, random)};
            const Query off{sweep_at(world, pose, robot_from_laser, 0.02, bias, random)};
            const Relocalizer ours = relocalizer_of(mapped, RelocalizationMethod::kSearch);
            const Relocalizer thesis = relocalizer_of(mapped, RelocalizationMethod::kHeadings);
            search.take(ours.find(clean), expected);
            headings.take(thesis.find(clean), expected);
            biased.take(ours.find(off), expected);
            biased_headings.take(thesis.find(off), expected);
        }
    }
    const bool good = search.found == search.asked && search.mean_cm() <= 100.0 * kAskedMean &&
                      search.mean_deg() <= kAskedMeanHeading_deg &&
                      search.worst_distance <= kAskedWorst &&
                      degrees(search.worst_heading) <= kAskedWorstHeading_deg;
    fmt::print(
        out,
        "Table 4.25: 12 poses in the thesis hall, map by our own mapping (60 m at 0.3 m/s), "
        "range sigma 2 cm; map and world by best fit of the mapping drive; seeds 1 to {}\n"
        "search               {}   asked all, {:g} cm / {:g} deg, worst {:g} cm / {:g} deg   {}\n"
        "72 headings (thesis) {}\n"
        "bias up to +-2 cm:\n"
        "search               {}\n"
        "72 headings (thesis) {}\n\n",
        options.seeds, search.text(), 100.0 * kAskedMean, kAskedMeanHeading_deg,
        100.0 * kAskedWorst, kAskedWorstHeading_deg, good ? "ok" : "MISS", headings.text(),
        biased.text(), biased_headings.text());
    return good ? 0 : 1;
}

namespace {

/// The thesis's headings from the middle of the map, and from a grid of places too.
enum class Baselines { kOne, kBoth };

/// Each pose with the default search, and every tenth with the baselines.
struct Tallies {
    Tally search;
    Tally headings;
    Tally grid;
};

Tallies ask(const MappedWorld& mapped, const std::vector<Pose2d>& poses, unsigned seed,
            Baselines baselines) {
    const Pose2d robot_from_laser = RobotConfig().lidar.robot_from_laser();
    const Relocalizer ours = relocalizer_of(mapped, RelocalizationMethod::kSearch);
    const Relocalizer thesis = relocalizer_of(mapped, RelocalizationMethod::kHeadings);
    const Relocalizer grid = relocalizer_of(mapped, RelocalizationMethod::kHeadings, 2.0);
    std::mt19937 random(seed);
    Tallies tallies;
    for (std::size_t i = 0; i < poses.size(); ++i) {
        const Query query{sweep_at(mapped.world, poses[i], robot_from_laser, 0.02, 0.0, random)};
        const Pose2d expected = mapped.expected(poses[i]);
        const auto timed = [&](const Relocalizer& relocalizer, Tally& tally) {
            const Stopwatch clock;
            const Relocalization found = relocalizer.find(query);
            tally.take(found, expected, clock.seconds());
        };
        timed(ours, tallies.search);
        if (i % 10 == 0) {
            timed(thesis, tallies.headings);
            if (baselines == Baselines::kBoth) {
                timed(grid, tallies.grid);
            }
        }
    }
    return tallies;
}

void print(const Tallies& tallies, std::ostream& out) {
    fmt::print(out, "search                      {}\n72 headings (thesis)        {}\n",
               tallies.search.text(), tallies.headings.text());
    if (tallies.grid.asked > 0) {
        fmt::print(out, "72 headings, grid of 2 m    {}\n", tallies.grid.text());
    }
}

}  // namespace

int measure_hall_poses(const LocalizationOptions& options, std::ostream& out) {
    const World world = read_world(options.worlds / "thesis_hall.yaml");
    const MappedWorld mapped = map_world(world, "", drive_of(0.3, 60.0, 0.0, 1));
    const Tallies tallies =
        ask(mapped, random_poses(mapped, options.poses, RobotConfig().lidar.robot_from_laser(), 1),
            2, Baselines::kBoth);
    const double share = 100.0 * static_cast<double>(tallies.search.right) /
                         static_cast<double>(tallies.search.asked);
    const bool good = share >= 99.5 && tallies.search.wrong == 0;
    fmt::print(out, "{} random poses in the thesis hall, one scan\n", options.poses);
    print(tallies, out);
    fmt::print(out, "asked 99.5 % found and right, none wrong but sure   {}\n\n",
               good ? "ok" : "MISS");
    return good ? 0 : 1;
}

int measure_racks(const LocalizationOptions& options, std::ostream& out) {
    int misses = 0;
    for (const char* name : {"racks", "warehouse"}) {
        const World world = read_world(options.worlds / (std::string(name) + ".yaml"));
        const MappedWorld mapped = map_truly(world, "all_aisles");
        const Tallies tallies = ask(
            mapped, random_poses(mapped, options.poses, RobotConfig().lidar.robot_from_laser(), 1),
            2, Baselines::kOne);
        const Tally& search = tallies.search;
        const double listed = 100.0 * static_cast<double>(search.listed + search.right) /
                              static_cast<double>(search.asked);
        const bool good = listed >= kAskedListed && search.wrong == 0;
        fmt::print(out, "{} random poses in {} (50 x 30 m), one scan\n", options.poses, name);
        print(tallies, out);
        fmt::print(out,
                   "found, or ambiguous with the true place in the list: {:.1f} %, asked {:g} %, "
                   "none wrong but sure   {}\n\n",
                   listed, kAskedListed, good ? "ok" : "MISS");
        misses += good ? 0 : 1;
    }
    return misses;
}

namespace {

/// 30 m long with niches and a cupboard, so that every place in it is another one.
World corridor() {
    World world;
    world.name = "twin corridors";
    const Points corners{{0, 0},    {6, 0},    {6, -0.6}, {7.5, -0.6}, {7.5, 0},  {19, 0},
                         {19, -1},  {20, -1},  {20, 0},   {30, 0},     {30, 2.4}, {12, 2.4},
                         {12, 2.9}, {10, 2.9}, {10, 2.4}, {0, 2.4}};
    for (std::size_t i = 0; i < corners.size(); ++i) {
        world.walls.push_back({corners[i], corners[(i + 1) % corners.size()]});
    }
    world.path = {{1.2, 1.2}, {28.8, 1.2}, {1.2, 1.2}};
    return world;
}

/// `copies` of a world in a row, all of them on the path.
World side_by_side(const World& world, const std::string& path, int copies) {
    Point2 upper = world.walls.front().start;
    Point2 lower = upper;
    for (const Segment& wall : world.walls) {
        lower = lower.cwiseMin(wall.start.cwiseMin(wall.end));
        upper = upper.cwiseMax(wall.start.cwiseMax(wall.end));
    }
    World row;
    row.name = world.name;
    for (int copy = 0; copy < copies; ++copy) {
        const Point2 shift(0.0, copy * (upper.y() - lower.y() + 1.0));
        for (const Segment& wall : world.walls) {
            row.walls.push_back({wall.start + shift, wall.end + shift});
        }
        for (const Circle& post : world.posts) {
            row.posts.push_back({post.center + shift, post.radius});
        }
        for (const Point2& place : world.path_named(path)) {
            row.path.push_back(place + shift);
        }
    }
    return row;
}

double free_area(const ReferenceMap& map) {
    const StateGrid& grid = map.grid();
    const auto cells = std::count(grid.states.begin(), grid.states.end(), CellState::kFree);
    return static_cast<double>(cells) * grid.geometry.resolution * grid.geometry.resolution;
}

World square_room() {
    World world;
    world.name = "square";
    const Points corners{{-4, -4}, {4, -4}, {4, 4}, {-4, 4}};
    for (std::size_t i = 0; i < 4; ++i) {
        world.walls.push_back({corners[i], corners[(i + 1) % 4]});
    }
    world.path = {{-2, -2}, {2, -2}, {2, 2}, {-2, 2}, {-2, -2}};
    return world;
}

}  // namespace

int measure_symmetric(const LocalizationOptions& options, std::ostream& out) {
    int misses = 0;
    for (const World& world : {square_room(), side_by_side(corridor(), "", 2)}) {
        const MappedWorld mapped = map_truly(world, "");
        const std::size_t poses = std::max<std::size_t>(1, options.poses / 5);
        const Tallies tallies =
            ask(mapped, random_poses(mapped, poses, RobotConfig().lidar.robot_from_laser(), 1), 2,
                Baselines::kOne);
        const bool good = tallies.search.ambiguous == tallies.search.asked;
        fmt::print(out, "{}, {} random poses, one scan\n", world.name, poses);
        print(tallies, out);
        fmt::print(out, "asked ambiguous in all   {}\n\n", good ? "ok" : "MISS");
        misses += good ? 0 : 1;
    }
    return misses;
}

int measure_search_speed(const LocalizationOptions& options, std::ostream& out) {
    const Pose2d robot_from_laser = RobotConfig().lidar.robot_from_laser();
    struct Asked {
        const char* world;
        const char* path;
        int copies;  ///< side by side
        double ms;
    };
    int misses = 0;
    for (const Asked& asked :
         {Asked{"thesis_hall", "", 1, 20.0}, Asked{"warehouse", "all_aisles", 1, 150.0},
          Asked{"warehouse", "all_aisles", 4, 1000.0}}) {
        const World world =
            side_by_side(read_world(options.worlds / (std::string(asked.world) + ".yaml")),
                         asked.path, asked.copies);
        MappedWorld mapped = map_truly(world, "");
        mapped.reference.reset();
        MemoryGrowth memory;
        mapped.reference = reference_of(mapped.map);
        const Relocalizer relocalizer = relocalizer_of(mapped, RelocalizationMethod::kSearch);
        const double making = memory.peak_mb();
        const double held = memory.held_mb();
        std::mt19937 random(3);
        Tally tally;
        for (const Pose2d& pose : random_poses(mapped, 40, robot_from_laser, 5)) {
            const Query query{sweep_at(world, pose, robot_from_laser, 0.02, 0.0, random)};
            const Stopwatch clock;
            const Relocalization found = relocalizer.find(query);
            tally.take(found, mapped.expected(pose), clock.seconds());
        }
        const double ms = 1e3 * tally.seconds / static_cast<double>(tally.asked);
        const double mb = memory.peak_mb();
        const bool good = ms <= asked.ms && mb <= kAskedMemory;
        fmt::print(
            out,
            "{} x {}: {:.0f} m2 of free space, a search takes {:.1f} ms (worst {:.1f} ms); "
            "map and search hold {:.0f} MB, with searches {:.0f} MB at most ({:.0f} MB while the "
            "map is made of its keyframes)   asked {:g} ms, {:g} MB   {}\n",
            asked.world, asked.copies, free_area(*mapped.reference), ms, 1e3 * tally.worst_seconds,
            held, mb, making, asked.ms, kAskedMemory, good ? "ok" : "MISS");
        misses += good ? 0 : 1;
    }
    fmt::print(out, "\n");
    return misses;
}

}  // namespace hybrid_slam
