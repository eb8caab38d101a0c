// SPDX-License-Identifier: Apache-2.0
#include <fmt/ostream.h>

#include <cmath>

#include "hybrid_slam/core/stopwatch.hpp"
#include "hybrid_slam/localization/localizer.hpp"
#include "localization.hpp"

namespace hybrid_slam {
namespace {

constexpr double kStep = 0.08;           ///< seconds between scans
constexpr double kOdometryShare = 0.01;  ///< of each step, by which wheels err
constexpr double kRackDrive = 10.0;      ///< metres
constexpr double kAskedRacks = 97.0;     ///< percent
constexpr std::size_t kWallStarts = 200;
constexpr double kWallDrive = 2.0;  ///< metres

/// What the forklift sees that drives through these poses, with wheel odometry.
std::vector<Frame> frames_at(const World& world, const std::vector<Pose2d>& poses,
                             std::mt19937& random) {
    const Pose2d robot_from_laser = RobotConfig().lidar.robot_from_laser();
    std::normal_distribution<double> error(0.0, kOdometryShare);
    std::vector<Frame> frames;
    Pose2d odom_from_robot;
    for (std::size_t i = 0; i < poses.size(); ++i) {
        if (i > 0) {
            const Eigen::Vector3d step = between(poses[i - 1], poses[i]).log();
            const Eigen::Vector3d noise(error(random), error(random), error(random));
            odom_from_robot =
                odom_from_robot * Pose2d::exp(step.cwiseProduct(Eigen::Vector3d::Ones() + noise));
        }
        Frame frame;
        frame.scan = scan_at(world, poses[i], robot_from_laser, 0.02, 0.0, random);
        frame.scan.stamp = kStep * static_cast<double>(i);
        frame.odom_from_robot = odom_from_robot;
        frames.push_back(std::move(frame));
    }
    return frames;
}

/// Straight on from `start` at `speed` (m/s), backwards when negative.
std::vector<Pose2d> straight(const Pose2d& start, double speed, double distance) {
    std::vector<Pose2d> poses;
    const auto steps = static_cast<std::size_t>(distance / (std::abs(speed) * kStep));
    for (std::size_t i = 0; i <= steps; ++i) {
        poses.push_back(start * Pose2d(speed * kStep * static_cast<double>(i), 0.0, 0.0));
    }
    return poses;
}

/// Along a path of legs from a place `begin` metres on it, turning on the spot.
std::vector<Pose2d> along(const Points& path, double begin, double distance, double speed,
                          double turn_rate) {
    std::vector<Pose2d> poses;
    double passed = 0.0;
    double driven = 0.0;
    for (std::size_t leg = 0; driven < distance; ++leg) {
        const Point2& from = path[leg % (path.size() - 1)];
        const Point2& to = path[leg % (path.size() - 1) + 1];
        const double length = (to - from).norm();
        const double heading = std::atan2((to - from).y(), (to - from).x());
        if (!poses.empty()) {
            const double turn = normalize_angle(heading - poses.back().heading);
            const auto steps = static_cast<int>(std::abs(turn) / (turn_rate * kStep));
            const Pose2d corner(from, poses.back().heading);
            for (int i = 1; i <= steps; ++i) {
                poses.push_back(corner * Pose2d(0.0, 0.0, turn * i / steps));
            }
        }
        const double first = std::max(0.0, begin - passed);
        for (double at = first; at < length && driven < distance; at += speed * kStep) {
            poses.emplace_back(from + at / length * (to - from), heading);
            driven += poses.size() > 1 ? speed * kStep : 0.0;
        }
        passed += length;
    }
    return poses;
}

/// How a drive from an unknown start ends.
struct DriveEnd {
    bool known = false;  ///< a place is held in the end
    bool right = false;
    bool wrong = false;  ///< a wrong place was held at any time
};

DriveEnd localize(const MappedWorld& mapped, const std::vector<Pose2d>& poses,
                  std::mt19937& random) {
    Localizer localizer(mapped.reference, LocalizationConfig());
    const std::vector<Frame> frames = frames_at(mapped.world, poses, random);
    DriveEnd end;
    for (std::size_t i = 0; i < frames.size(); ++i) {
        const LocalizationResult result = localizer.process(frames[i]);
        const bool held = result.status == LocalizationStatus::kTracking ||
                          result.status == LocalizationStatus::kDegraded;
        end.known = held && result.map_from_robot.has_value();
        end.right = end.known && is_there(*result.map_from_robot, mapped.expected(poses[i]));
        end.wrong = end.wrong || (end.known && !end.right);
    }
    return end;
}

struct DriveTally {
    std::size_t asked = 0;
    std::size_t right = 0;
    std::size_t wrong = 0;
    std::size_t unknown = 0;

    void take(const DriveEnd& end) {
        ++asked;
        right += end.right ? 1 : 0;
        wrong += end.wrong ? 1 : 0;
        unknown += end.known ? 0 : 1;
    }
    double share() const {
        return 100.0 * static_cast<double>(right) /
               static_cast<double>(std::max<std::size_t>(1, asked));
    }
};

double length_of(const Points& path) {
    double length = 0.0;
    for (std::size_t i = 1; i < path.size(); ++i) {
        length += (path[i] - path[i - 1]).norm();
    }
    return length;
}

}  // namespace

namespace {

/// Whether a drive sees anything that is otherwise in the same hall turned by half a turn. Nobody
/// can say where it was otherwise.
bool is_told_apart(const World& world, const std::vector<Pose2d>& poses, const Pose2d& half_turn) {
    constexpr double kOtherwise = 0.1;  // metres
    constexpr double kShare = 0.005;    // of the beams
    const Pose2d robot_from_laser = RobotConfig().lidar.robot_from_laser();
    std::mt19937 random(1);
    std::size_t beams = 0;
    std::size_t others = 0;
    for (std::size_t i = 0; i < poses.size(); i += 5) {
        const Scan here = scan_at(world, poses[i], robot_from_laser, 1e-6, 0.0, random);
        const Scan there =
            scan_at(world, half_turn * poses[i], robot_from_laser, 1e-6, 0.0, random);
        for (std::size_t beam = 0; beam < here.ranges.size(); ++beam) {
            const auto range = [&](const Scan& scan) {
                return scan.is_return(scan.ranges[beam]) ? scan.ranges[beam] : scan.range_max;
            };
            others += std::abs(range(here) - range(there)) > kOtherwise ? 1 : 0;
            ++beams;
        }
    }
    return static_cast<double>(others) > kShare * static_cast<double>(beams);
}

struct RackTally {
    DriveTally all;
    DriveTally told_apart;
};

RackTally drive_among(const World& world, std::size_t drives) {
    const Pose2d half_turn(50.0, 30.0, kPi);  // of warehouse.yaml, but for its gate
    const MappedWorld mapped = map_truly(world, "all_aisles");
    const Points& path = world.path_named("all_aisles");
    std::mt19937 random(7);
    std::uniform_real_distribution<double> begin(0.0, length_of(path) - kRackDrive);
    RackTally tally;
    for (std::size_t i = 0; i < drives; ++i) {
        const std::vector<Pose2d> poses = along(path, begin(random), kRackDrive, 1.0, 1.0);
        const DriveEnd end = localize(mapped, poses, random);
        tally.all.take(end);
        if (is_told_apart(world, poses, half_turn)) {
            tally.told_apart.take(end);
        }
    }
    return tally;
}

}  // namespace

int measure_rack_drives(const LocalizationOptions& options, std::ostream& out) {
    const std::size_t drives = std::max<std::size_t>(1, options.poses / 10);
    const Stopwatch clock;
    const DriveTally tally = drive_among(read_world(options.worlds / "racks.yaml"), drives).all;
    const bool good = tally.share() >= kAskedRacks && tally.wrong == 0;
    fmt::print(
        out,
        "{} drives of {:g} m among look-alike racks (racks.yaml) from unknown starts: found and "
        "right {:.1f} %, ever wrong but sure {}, still unknown {}   asked {:g} %, 0   {} ({:.1f} s "
        "a drive)\n",
        drives, kRackDrive, tally.share(), tally.wrong, tally.unknown, kAskedRacks,
        good ? "ok" : "MISS", clock.seconds() / static_cast<double>(drives));
    const RackTally same = drive_among(read_world(options.worlds / "warehouse.yaml"), drives);
    const bool never_wrong = same.all.wrong == 0;
    fmt::print(
        out,
        "the same among racks that are all the same (warehouse.yaml): found and right {:.1f} "
        "%, ever wrong but sure {}; in {} of the {} drives anything was seen that tells the "
        "hall from itself turned by half a turn, of these found and right {:.1f} %   asked "
        "never wrong   {}\n\n",
        same.all.share(), same.all.wrong, same.told_apart.asked, drives, same.told_apart.share(),
        never_wrong ? "ok" : "MISS");
    return (good ? 0 : 1) + (never_wrong ? 0 : 1);
}

/// The thesis's unsolved case, section 5.3.
int measure_walls(const LocalizationOptions& options, std::ostream& out) {
    const World world = read_world(options.worlds / "thesis_hall.yaml");
    const MappedWorld mapped = map_truly(world, "");
    const Pose2d robot_from_laser = RobotConfig().lidar.robot_from_laser();
    RelocalizationConfig config;
    const Relocalizer relocalizer(mapped.reference, config, IcpConfig());
    std::mt19937 random(11);
    const auto uniform = [&](double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(random);
    };
    // The long straight walls: far enough from their ends that there is room to back out.
    Tally one;
    DriveTally after;
    for (std::size_t i = 0; i < kWallStarts; ++i) {
        const double away = uniform(0.15, 0.5);
        const double turned = uniform(-0.35, 0.35);
        const Pose2d walls[4] = {Pose2d(uniform(-2.8, 2.8), 3.6 - away, kPi / 2.0 + turned),
                                 Pose2d(uniform(-2.8, 2.8), -3.6 + away, -kPi / 2.0 + turned),
                                 Pose2d(-5.0 + away, uniform(-1.8, 1.6), kPi + turned),
                                 Pose2d(5.0 - away, uniform(-1.8, 1.6), turned)};
        const Pose2d start = walls[i % 4] * robot_from_laser.inverse();
        const Query query{sweep_at(world, start, robot_from_laser, 0.02, 0.0, random)};
        const Stopwatch clock;
        const Relocalization found = relocalizer.find(query);
        one.take(found, mapped.expected(start), clock.seconds());
        after.take(localize(mapped, straight(start, -0.3, kWallDrive), random));
    }
    const bool good = one.wrong == 0 && after.wrong == 0 && after.right == after.asked;
    fmt::print(
        out,
        "{} starts within 0.5 m of a wall and facing it\none scan        {}\n"
        "after {:g} m back: found and right {:.1f} %, ever wrong but sure {}, still unknown {}"
        "   asked all, never wrong but sure   {}\n\n",
        kWallStarts, one.text(), kWallDrive, after.share(), after.wrong, after.unknown,
        good ? "ok" : "MISS");
    return good ? 0 : 1;
}

}  // namespace hybrid_slam
