// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "calibrate.hpp"
#include "calibration_files.hpp"
#include "calibration_pictures.hpp"
#include "corner_window.hpp"
#include "hybrid_slam/calibration/ground_calibration.hpp"
#include "hybrid_slam/core/error.hpp"
#include "messages.hpp"

namespace hybrid_slam::tools {
namespace {

using Json = nlohmann::ordered_json;

struct GroundOptions {
    CommonOptions common;
    std::filesystem::path image;
    std::filesystem::path camera;
    double tile = 0.0;
    std::vector<std::string> corner_texts;
    std::vector<Pixel> corners;
    std::string board_text;
    double square = 0.0;
    std::optional<Chessboard> board;
    std::string tile_pose_text;
    std::optional<Pose2d> robot_from_patch;
    std::filesystem::path out;
    std::filesystem::path picture;
};

constexpr auto kFooter =
    R"(One photo of the floor, by the camera at its place on the vehicle, with a square tile (or four marks in a square)
or a chessboard that lies flat, tells how high the camera sits and how it is tilted. The larger and the nearer the
tile, the better; its edges should point roughly ahead and across.
--corners: the four corners in pixels of the photo as it came (distorted), from the left and from the top; the usual
order is near left, near right, far right, far left, but any will do. Without --corners and --board a window opens
to click them in: right click takes the last one back, Enter ends.
--tile-pose: where the middle of the tile (or of the board's inner corners) lies in the robot's frame, x ahead and y
to the left of its origin in m, and how the tile is turned to the left in degrees; 0 when its edges point straight
ahead. With it x, y and yaw of the camera are found as well; without it they stay what --out (or else --camera)
says.
--camera may be a file of ours, of OpenCV or of ROS (camera_info, plumb_bob). When --out (or else --camera) is a
robot file, all of it but camera.model and camera.mounting stays (comments go).
Examples:
  hybrid-slam calibrate ground floor.png --camera camera.yaml --tile 0.6 --out camera.yaml
  hybrid-slam calibrate ground floor.png --camera camera.yaml --tile 0.6 --corners 180,410 470,412 420,300 225,299 \
      --tile-pose 2.5,0,0 --out camera.yaml --picture floor_seen.png
  hybrid-slam calibrate ground floor.png --camera ost.yaml --board 9x6 --square 0.025 --out forklift.yaml
)";

/// Throws Error when the file says nothing of the optics.
CameraFile read_camera(const std::filesystem::path& file) {
    CameraFile camera = read_camera_file(file);
    if (!camera.has_model) {
        throw Error(file.string() + ": key 'camera.model': is missing");
    }
    return camera;
}

Image read_floor(const GroundOptions& options, const CameraModel& model) {
    Image image = read_photo(options.image);
    if (image.width != model.width || image.height != model.height) {
        throw Error(fmt::format("{}: is {} x {} pixels, but {} is of a camera with {} x {}",
                                options.image.string(), image.width, image.height,
                                options.camera.string(), model.width, model.height));
    }
    return image;
}

std::vector<FloorPoint> points_of(const GroundOptions& options, const CameraModel& model,
                                  const Image& image) {
    if (options.board) {
        const auto sight = find_board(image, *options.board);
        if (!sight) {
            throw Error(fmt::format("{}: no board of {} x {} inner corners", options.image.string(),
                                    options.board->columns, options.board->rows));
        }
        return board_points(sight->corners, *options.board);
    }
    return tile_points(model, options.corners.empty() ? pick_corners(image) : options.corners,
                       options.tile);
}

/// Throws Error for a result that no camera on a vehicle can have.
void check_plausible(const GroundOptions& options, const CameraModel& model,
                     const GroundCalibration& ground) {
    constexpr double kMostError = 5.0 / 640.0;  // of the width
    constexpr double kMostHeight = 20.0;        // metres
    const double most_error = kMostError * model.width;
    const CameraMounting& found = ground.mounting;
    if (!(ground.rms <= most_error)) {
        throw Error(fmt::format(
            "{}: the corners are {:.1f} pixels off, {:.1f} are allowed: {}, or the camera is "
            "another one",
            options.image.string(), ground.rms, most_error,
            options.board ? "the board is bent" : "not those of a square tile"));
    }
    if (!(found.z > 0.0 && found.z <= kMostHeight) ||
        !(std::abs(found.roll) <= radians(45.0) && std::abs(found.pitch) <= radians(85.0))) {
        throw Error(fmt::format(
            "{}: the camera would be {:.2f} m high, {:.1f} deg down and {:.1f} deg clockwise, but "
            "at most {:.0f} m, 85 deg and 45 deg can be: check the corners and the size",
            options.image.string(), found.z, degrees(found.pitch), degrees(found.roll),
            kMostHeight));
    }
}

std::vector<std::string> warnings_of(const GroundOptions& options,
                                     const GroundCalibration& ground) {
    constexpr double kMostError = 2.0;  // pixels
    std::vector<std::string> warnings;
    if (ground.rms > kMostError) {
        warnings.push_back(fmt::format(
            "the corners are {:.1f} pixels off: {}, or the camera is another one", ground.rms,
            options.board ? "the board is bent" : "not those of a square tile"));
    }
    // Of a click that is off by a pixel: more than this spoils the way driven by 2 %.
    if (!options.board && ground.height_per_pixel > 0.02 * ground.mounting.z) {
        warnings.push_back(
            fmt::format("a corner that is off by one pixel moves the height by {:.0f} "
                        "mm: take a larger tile, or a nearer one",
                        1000.0 * ground.height_per_pixel));
    }
    return warnings;
}

Json json_of(const GroundOptions& options, const std::vector<FloorPoint>& points,
             const GroundCalibration& ground, const CameraMounting& mounting) {
    Json corners = Json::array();
    for (const FloorPoint& point : points) {
        corners.push_back({rounded(point.pixel.x()), rounded(point.pixel.y())});
    }
    Json homography = Json::array();
    for (Eigen::Index row = 0; row < 3; ++row) {
        homography.push_back({ground.patch_from_image(row, 0), ground.patch_from_image(row, 1),
                              ground.patch_from_image(row, 2)});
    }
    return {{"image", options.image.string()},
            {"corners", corners},
            {"rms_px", ground.rms},
            {"homography_rms_px", ground.homography_rms},
            {"homography", homography},
            {"height_m", ground.mounting.z},
            {"pitch_deg", degrees(ground.mounting.pitch)},
            {"roll_deg", degrees(ground.mounting.roll)},
            {"per_pixel",
             {{"height_m", ground.height_per_pixel},
              {"pitch_deg", degrees(ground.pitch_per_pixel)},
              {"roll_deg", degrees(ground.roll_per_pixel)}}},
            {"mounting", to_json(mounting)},
            {"warnings", warnings_of(options, ground)},
            {"out", options.out.string()}};
}

std::string text_of(const GroundOptions& options, const GroundCalibration& ground,
                    const CameraMounting& mounting) {
    std::string text = fmt::format(
        "height {:.3f} m, pitch {:.2f} deg down, roll {:.2f} deg clockwise; error {:.2f} pixels\n"
        "one pixel off would mean {:.0f} mm, {:.2f} deg and {:.2f} deg",
        mounting.z, degrees(mounting.pitch), degrees(mounting.roll), ground.rms,
        1000.0 * ground.height_per_pixel, degrees(ground.pitch_per_pixel),
        degrees(ground.roll_per_pixel));
    if (options.robot_from_patch) {
        text += fmt::format("\nx {:.3f} m, y {:.3f} m, yaw {:.2f} deg to the left", mounting.x,
                            mounting.y, degrees(mounting.yaw));
    }
    return text + "\ncamera  " + options.out.string();
}

int run_ground(const GroundOptions& options) {
    const CameraFile camera = read_camera(options.camera);
    const CalibrationFile file(options.out, camera.format == CameraFormat::kRobot
                                                ? options.camera
                                                : std::filesystem::path());
    const Image image = read_floor(options, camera.model);
    const std::vector<FloorPoint> points = points_of(options, camera.model, image);
    const GroundCalibration ground = calibrate_ground(camera.model, points);
    check_plausible(options, camera.model, ground);
    if (options.robot_from_patch && ground.cornerwise()) {
        throw Error(
            "the tile lies cornerwise before the camera, so that --tile-pose could mean "
            "either of two edges: turn the tile");
    }
    const CameraMounting before = file.mounting().value_or(camera.mounting);
    const CameraMounting mounting = mounting_on_robot(ground, before, options.robot_from_patch);
    for (const std::string& warning : warnings_of(options, ground)) {
        print_warning(warning);
    }
    if (!options.picture.empty()) {
        draw_ground({image, camera.model, points, ground, mounting}).write_png(options.picture);
        print_info("wrote " + options.picture.string());
    }
    file.write(camera.model, mounting,
               fmt::format("camera.mounting by 'hybrid-slam calibrate ground': error {:.2f} "
                           "pixels{}",
                           ground.rms,
                           options.robot_from_patch || file.mounting()
                               ? ""
                               : "; x, y and yaw_deg are not measured yet"));
    if (options.common.json) {
        print_json(json_of(options, points, ground, mounting));
    } else {
        print_result(text_of(options, ground, mounting));
    }
    return kOk;
}

/// What the options say in words of their own. Throws CLI::ValidationError.
void take_apart(GroundOptions& options) {
    if ((options.tile > 0.0) == !options.board_text.empty()) {
        throw CLI::RequiredError("either --tile or --board");
    }
    if (!options.board_text.empty()) {
        options.board = parse_board(options.board_text, options.square);
        if (!options.board || options.square <= 0.0) {
            throw CLI::ValidationError("--board: must look like 9x6, with --square beside it");
        }
        if (!options.corner_texts.empty()) {
            throw CLI::ValidationError("--corners: go with --tile; those of a board are found");
        }
    }
    for (const std::string& text : options.corner_texts) {
        const std::vector<double> corner = parse_numbers(text, 2);
        if (corner.empty()) {
            throw CLI::ValidationError("--corners: must look like u,v, not '" + text + "'");
        }
        options.corners.emplace_back(corner[0], corner[1]);
    }
    if (!options.tile_pose_text.empty()) {
        const std::vector<double> pose = parse_numbers(options.tile_pose_text, 3);
        if (pose.empty()) {
            throw CLI::ValidationError("--tile-pose: must look like x,y,yaw, not '" +
                                       options.tile_pose_text + "'");
        }
        options.robot_from_patch = Pose2d(pose[0], pose[1], radians(pose[2]));
    }
}

void add_floor_options(CLI::App& command, GroundOptions& options) {
    command.add_option("--tile", options.tile, "Side of a square tile on the floor")
        ->check(CLI::Range(0.01, 100.0).description(""))
        ->type_name("M");
    command
        .add_option("--corners", options.corner_texts,
                    "Its four corners in the photo; a window opens without")
        ->expected(4)
        ->type_name("U,V");
    command.add_option("--board", options.board_text, "A board on the floor instead: e.g. 9x6")
        ->type_name("CxR");
    command.add_option("--square", options.square, "Side of a square of the board")
        ->check(CLI::Range(1e-4, 10.0).description(""))
        ->type_name("M");
    command
        .add_option("--tile-pose", options.tile_pose_text,
                    "Middle of tile or board on the robot, m and deg: x, y, yaw too")
        ->type_name("X,Y,YAW");
}

}  // namespace

void add_calibrate_ground_command(CLI::App& calibrate, Action& action) {
    const auto options = std::make_shared<GroundOptions>();
    CLI::App* command = calibrate.add_subcommand(
        "ground", "Find the camera's height and tilt from a tile or board on the floor");
    command->add_option("IMAGE", options->image, "Photo of the floor (JPEG, PNG, PNM)")
        ->required()
        ->type_name("");
    command
        ->add_option("--camera", options->camera,
                     "Optics: camera or robot file, OpenCV or ROS (YAML)")
        ->required()
        ->type_name("FILE");
    add_floor_options(*command, *options);
    command->add_option("-o,--out", options->out, "Camera or robot file (YAML) to write")
        ->required()
        ->type_name("FILE");
    command
        ->add_option("--picture", options->picture, "Draws the floor as it is seen into this PNG")
        ->type_name("FILE");
    add_common_options(*command, options->common);
    command->footer(kFooter);
    command->callback([options, &action] {
        take_apart(*options);
        check_picture(options->picture, options->out, {options->image});
        action = [options] { return run_ground(*options); };
    });
}

}  // namespace hybrid_slam::tools
