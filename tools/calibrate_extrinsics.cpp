// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "calibrate.hpp"
#include "hybrid_slam/calibration/extrinsics.hpp"
#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/recording/recording.hpp"
#include "hybrid_slam/vision/visual_source.hpp"
#include "input.hpp"
#include "interrupt.hpp"
#include "messages.hpp"
#include "progress.hpp"
#include "settings.hpp"
#include "table.hpp"
#include "visual_input.hpp"

namespace hybrid_slam::tools {
namespace {

using Json = nlohmann::ordered_json;

struct ExtrinsicsOptions {
    CommonOptions common;
    std::filesystem::path drive;
    std::filesystem::path robot;
    std::filesystem::path out;
    std::filesystem::path config;
    Overrides overrides;
};

constexpr auto kFooter =
    R"(Estimates from one drive, and writes into a copy of the robot's file:
  lidar.x, lidar.yaw_deg, camera.mounting.x, .y, .yaw_deg, camera.latency
Kept as they are: lidar.y, since sliding along the axle changes nothing that is seen (measure it; camera.mounting.y
is found relative to it), and height, pitch and roll of the camera, which 'calibrate ground' finds.
What to drive: two or more figures of eight of some metres, slowly (0.2 to 0.5 m/s), turning to both sides and
straight in between, for one to three minutes; walls all around within reach of the lidar; floor with texture
(joints, stains, marks) ahead of the camera, good light, nobody walking. No wheel may spin or slide. Start from a
robot file that is right to some 20 deg, 30 cm and 0.2 s.
Exit code 4: the drive does not tell enough; what is missing is said, and nothing is written.
Examples:
  hybrid-slam calibrate extrinsics drive1/ --out forklift.yaml
  hybrid-slam calibrate extrinsics drive1/ --robot config/robots/forklift.yaml --out forklift.yaml --json
)";

/// The drive is gone through again from the corrected file until little changes: what is floor in
/// an image, and which way is not sideways, depends on where the camera is thought to be.
constexpr int kMostPasses = 4;
constexpr double kSettled = 1.0;  ///< sigmas by which a pass may still have moved something

struct Outcome {
    ExtrinsicsResult result;
    std::size_t scans = 0;
    std::size_t unaligned = 0;
    std::uint64_t images = 0;
    std::vector<std::string> warnings;
};

/// Lidar and camera of one recording, each by itself.
class Pass {
  public:
    Pass(const std::filesystem::path& folder, const RobotConfig& robot, const Settings& settings)
        : reader_(folder),
          sensors_(reader_, robot, SensorSource::Images::kGray),
          vision_(visual_odometry_of(robot.camera, settings.vision)),
          source_(sensors_, vision_),
          matching_(lidar_only(settings.slam.odometry)) {
        drive_.robot_from_laser = robot.lidar.robot_from_laser();
        const CameraMounting& camera = robot.camera.mounting;
        drive_.robot_from_camera = {camera.x, camera.y, camera.yaw};
    }

    /// Empty when interrupted.
    std::optional<Outcome> run(Progress& progress) {
        while (auto measurement = source_.next()) {
            take(std::move(*measurement));
            if (interrupted()) {
                return std::nullopt;
            }
            progress.update(source_.progress(), outcome_.scans, latest_ - earliest_);
        }
        progress.say("aligning the motions");
        outcome_.result = calibrate_extrinsics(drive_);
        outcome_.images = source_.counts().images;
        outcome_.warnings = warnings();
        return std::move(outcome_);
    }

  private:
    /// Vision as a prior would make the two agree by themselves.
    static OdometryConfig lidar_only(OdometryConfig config) {
        config.prior.kind = PriorKind::kConstantVelocity;
        config.reference = ReferenceKind::kLocalMap;
        return config;
    }

    void take(Measurement&& measurement) {
        if (const auto* motion = std::get_if<VisualMotion>(&measurement)) {
            drive_.vision.push_back(*motion);
        }
        if (auto* scan = std::get_if<Scan>(&measurement)) {
            Frame frame;
            frame.scan = std::move(*scan);
            const OdometryResult found = matching_.register_frame(frame);
            latest_ = frame.scan.stamp;
            earliest_ = outcome_.scans == 0 ? latest_ : earliest_;
            ++outcome_.scans;
            if (found.status == OdometryStatus::kPriorOnly) {
                ++outcome_.unaligned;
            } else {
                drive_.lidar.push_back({latest_, found.local_from_robot});
            }
        }
    }

    std::vector<std::string> warnings() const {
        std::vector<Loss> losses = losses_of(sensors_.counts());
        losses.push_back({reader_.damaged_bytes(), "", "damaged bytes of the recording"});
        losses.push_back({outcome_.unaligned, "", "scans that fit nowhere"});
        std::vector<std::string> warnings = warnings_of(losses);
        const std::vector<std::string> of_images = warnings_of(source_.counts());
        warnings.insert(warnings.end(), of_images.begin(), of_images.end());
        return warnings;
    }

    RecordingReader reader_;
    SensorSource sensors_;
    VisualOdometry vision_;
    VisualSource source_;
    Odometry matching_;
    ExtrinsicsDrive drive_;
    Outcome outcome_;
    double earliest_ = 0.0;
    double latest_ = 0.0;
};

/// To 0.1 mm, 0.1 ms and 0.001 deg, which is below what can be known, for whoever reads the file.
double tidy(double value) {
    return std::round(value * 1e4) / 1e4;
}
double tidy_angle(double value) {
    return radians(std::round(degrees(value) * 1e3) / 1e3);
}

RobotConfig corrected(RobotConfig robot, const ExtrinsicsResult& result) {
    robot.lidar.x = tidy(result.robot_from_laser.x());
    robot.lidar.yaw = tidy_angle(result.robot_from_laser.heading);
    CameraMounting& camera = robot.camera.mounting;
    camera.x = tidy(result.robot_from_camera.x());
    camera.y = tidy(result.robot_from_camera.y());
    camera.yaw = tidy_angle(result.robot_from_camera.heading);
    // stamp = arrival - latency. Only their difference is known: where an image would have come
    // before it was taken, the scans are late.
    const double latency = tidy(robot.camera.latency - result.camera_time);
    robot.camera.latency = std::max(0.0, latency);
    robot.lidar.latency += std::max(0.0, -latency);
    return robot;
}

struct Parameter {
    const char* key;
    double before;
    double after;
    double sigma;
    const char* unit;
    int digits;
};

/// Over all passes: what the stamps of images are moved by against those of scans.
double camera_time(const RobotConfig& before, const RobotConfig& after) {
    return before.camera.latency - after.camera.latency + after.lidar.latency -
           before.lidar.latency;
}

std::vector<Parameter> parameters_of(const RobotConfig& before, const RobotConfig& after,
                                     const ExtrinsicsResult& result) {
    const auto sigma = [&](Extrinsic of, double factor) { return factor * result.sigma(of); };
    const auto& a = before.camera.mounting;
    const auto& b = after.camera.mounting;
    const double angle = degrees(1.0);
    std::vector<Parameter> parameters = {
        {"lidar.x", before.lidar.x, after.lidar.x, sigma(Extrinsic::kLaserX, 1.0), "m", 4},
        {"lidar.yaw_deg", degrees(before.lidar.yaw), degrees(after.lidar.yaw),
         sigma(Extrinsic::kLaserYaw, angle), "deg", 3},
        {"camera.mounting.x", a.x, b.x, sigma(Extrinsic::kCameraX, 1.0), "m", 4},
        {"camera.mounting.y", a.y, b.y, sigma(Extrinsic::kCameraY, 1.0), "m", 4},
        {"camera.mounting.yaw_deg", degrees(a.yaw), degrees(b.yaw),
         sigma(Extrinsic::kCameraYaw, angle), "deg", 3},
        {"camera.latency", before.camera.latency, after.camera.latency,
         sigma(Extrinsic::kTime, 1.0), "s", 4}};
    if (after.lidar.latency != before.lidar.latency) {
        parameters.push_back({"lidar.latency", before.lidar.latency, after.lidar.latency,
                              sigma(Extrinsic::kTime, 1.0), "s", 4});
    }
    return parameters;
}

std::string table_text(const std::vector<Parameter>& parameters) {
    Table table({"parameter", "before", "after", "sigma", "unit"});
    for (const Parameter& p : parameters) {
        table.add_row({p.key, fmt::format("{:.{}f}", p.before, p.digits),
                       fmt::format("{:.{}f}", p.after, p.digits),
                       fmt::format("{:.{}f}", p.sigma, p.digits), p.unit});
    }
    return table.text();
}

std::string drive_text(const Outcome& outcome) {
    const ExtrinsicsResult& r = outcome.result;
    return fmt::format(
        "drive      {:.1f} m, turned {:.0f} deg to the left and {:.0f} deg to the right\n"
        "intervals  {} compared ({} of them outliers), {} without motion, {} without vision\n"
        "residuals  {:.1f} mm and {:.2f} deg between lidar and camera, {:.1f} mm sideways",
        r.distance, degrees(r.turned_left), degrees(r.turned_right), r.intervals, r.outliers,
        r.standing, r.blind, 1e3 * r.rms_translation, degrees(r.rms_heading), 1e3 * r.rms_slip);
}

Json to_json(const Outcome& outcome, const std::vector<Parameter>& parameters) {
    const ExtrinsicsResult& r = outcome.result;
    Json table = Json::object();
    for (const Parameter& p : parameters) {
        table[p.key] = {{"before", rounded(p.before)},
                        {"after", rounded(p.after)},
                        {"sigma", rounded(p.sigma)},
                        {"unit", p.unit}};
    }
    return {{"fit", r.fit()},
            {"missing", r.missing},
            {"parameters", table},
            {"visual_scale",
             {{"value", rounded(r.visual_scale)}, {"sigma", rounded(r.sigma(Extrinsic::kScale))}}},
            {"scans", outcome.scans},
            {"unaligned_scans", outcome.unaligned},
            {"images", outcome.images},
            {"intervals", r.intervals},
            {"outliers", r.outliers},
            {"standing", r.standing},
            {"blind", r.blind},
            {"rms_translation_m", rounded(r.rms_translation)},
            {"rms_heading_deg", rounded(degrees(r.rms_heading))},
            {"rms_slip_m", rounded(r.rms_slip)},
            {"distance_m", rounded(r.distance)},
            {"turned_left_deg", rounded(degrees(r.turned_left))},
            {"turned_right_deg", rounded(degrees(r.turned_right))},
            {"turn_rate_spread_deg_s", rounded(degrees(r.rate_spread))}};
}

/// Before the work, so that it is not lost for this: what is there must be a robot's file.
void check_replaceable(const std::filesystem::path& out) {
    if (!std::filesystem::exists(out)) {
        return;
    }
    if (!std::filesystem::is_regular_file(out)) {
        throw Error(out.string() + ": is there and no file; not replaced");
    }
    try {
        read_robot(out);
    } catch (const Error& error) {
        throw Error(out.string() + ": is there and no robot's file, so it is not replaced (" +
                    error.what() + ")");
    }
}

RobotConfig robot_before(const ExtrinsicsOptions& options) {
    if (!is_recording(options.drive)) {
        throw Error(options.drive.string() + ": is no recording");
    }
    RobotConfig robot = options.robot.empty() ? RecordingReader(options.drive, false).robot()
                                              : read_robot(options.robot);
    if (!robot.camera.enabled) {
        throw Error(options.drive.string() + ": camera.enabled is false, so there is no camera");
    }
    return robot;
}

void warn_of_scale(const ExtrinsicsResult& result) {
    constexpr double kWorthIt = 0.01;
    const double off = result.ways_too_long().value_or(0.0);
    if (std::abs(off) > kWorthIt &&
        std::abs(result.visual_scale - 1.0) > 2.0 * result.sigma(Extrinsic::kScale)) {
        print_warning(fmt::format(
            "the camera sees ways {:.1f} % too {}: its height or pitch is wrong; as it looks now "
            "it is {:.3f} +- {:.3f} times as high as camera.mounting.z says. Run 'hybrid-slam "
            "calibrate ground', then this again",
            100.0 * std::abs(off), off > 0.0 ? "long" : "short", result.visual_scale,
            result.sigma(Extrinsic::kScale)));
    }
}

void print_outcome(const ExtrinsicsOptions& options, const Outcome& outcome,
                   const RobotConfig& before, const RobotConfig& after) {
    const ExtrinsicsResult& result = outcome.result;
    if (options.common.json) {
        Json json = to_json(outcome, parameters_of(before, after, result));
        json["camera_time_s"] = rounded(camera_time(before, after));
        json["out"] = result.fit() ? options.out.string() : "";
        print_json(json);
        return;
    }
    if (!result.fit()) {
        print_result(drive_text(outcome));
        return;
    }
    print_result(fmt::format("{}\n\nvisual scale {:.4f} +- {:.4f}, lidar.y kept\n{}\nrobot      {}",
                             table_text(parameters_of(before, after, result)), result.visual_scale,
                             result.sigma(Extrinsic::kScale), drive_text(outcome),
                             options.out.string()));
}

bool settled(const std::vector<Parameter>& parameters) {
    return std::all_of(parameters.begin(), parameters.end(), [](const Parameter& p) {
        return std::abs(p.after - p.before) < kSettled * p.sigma;
    });
}

/// Empty when interrupted. Later passes are in vain where the first one did not fit.
std::optional<Outcome> estimate(const ExtrinsicsOptions& options, const Settings& settings,
                                RobotConfig& robot) {
    std::optional<Outcome> outcome;
    for (int pass = 1; pass <= kMostPasses; ++pass) {
        Progress progress(fmt::format("{}, pass {}", name_of(options.drive), pass),
                          options.common.quiet);
        outcome = Pass(options.drive, robot, settings).run(progress);
        if (!outcome || !outcome->result.fit()) {
            return outcome;
        }
        const RobotConfig before = std::exchange(robot, corrected(robot, outcome->result));
        if (settled(parameters_of(before, robot, outcome->result))) {
            break;
        }
    }
    return outcome;
}

int run_extrinsics(const ExtrinsicsOptions& options) {
    const Settings settings = load_settings(options.config, options.overrides);
    const RobotConfig before = robot_before(options);
    check_replaceable(options.out);
    catch_interrupts();
    RobotConfig after = before;
    std::optional<Outcome> outcome = estimate(options, settings, after);
    if (!outcome) {
        print_warning("interrupted; nothing was written");
        return kInterrupted;
    }
    ExtrinsicsResult& result = outcome->result;
    if (outcome->images == 0) {
        result.missing.insert(result.missing.begin(), "no images");
    }
    if (!outcome->warnings.empty()) {
        print_info(
            fmt::format("{}: {}", name_of(options.drive), fmt::join(outcome->warnings, "; ")));
    }
    warn_of_scale(result);
    if (result.fit()) {
        write_text(options.out, to_yaml(after));
    }
    print_outcome(options, *outcome, before, after);
    if (!result.fit()) {
        print_error(fmt::format("{}: this drive does not tell where the sensors sit: {}",
                                name_of(options.drive), fmt::join(result.missing, "; ")));
    }
    return result.fit() ? kOk : kNotFit;
}

}  // namespace

void add_calibrate_extrinsics_command(CLI::App& calibrate, Action& action) {
    const auto options = std::make_shared<ExtrinsicsOptions>();
    CLI::App* command = calibrate.add_subcommand(
        "extrinsics", "Find where lidar and camera sit, and the camera's delay, from a drive");
    command->add_option("DRIVE", options->drive, "Folder of a recording with images")
        ->required()
        ->type_name("");
    command
        ->add_option("--robot", options->robot,
                     "Robot (YAML) to start from, in place of the recorded one")
        ->type_name("FILE");
    command
        ->add_option("-o,--out", options->out, "Robot (YAML) to write; a robot's file is replaced")
        ->required()
        ->type_name("FILE");
    add_config_option(*command, options->config, " of scan matching and visual odometry");
    add_set_option(*command, options->overrides, "vo.features=300");
    add_common_options(*command, options->common);
    command->footer(kFooter);
    command->callback(
        [options, &action] { action = [options] { return run_extrinsics(*options); }; });
}

}  // namespace hybrid_slam::tools
