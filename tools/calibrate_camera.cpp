// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "calibrate.hpp"
#include "calibration_files.hpp"
#include "calibration_pictures.hpp"
#include "hybrid_slam/calibration/camera_calibration.hpp"
#include "hybrid_slam/core/error.hpp"
#include "messages.hpp"
#include "progress.hpp"
#include "table.hpp"

namespace hybrid_slam::tools {
namespace {

using Json = nlohmann::ordered_json;

struct CameraOptions {
    CommonOptions common;
    std::vector<std::filesystem::path> photos;
    std::string board_text;
    double square = 0.0;
    Chessboard board;
    double most_edge_width = BoardPhotos::kMostEdgeWidth;
    CameraCalibrationConfig config;
    std::filesystem::path out;
    std::filesystem::path picture;
};

constexpr auto kFooter =
    R"(Take 10 to 20 sharp photos of a flat chessboard with the camera of the vehicle, at the size and focus that it
will have: near and far, in the middle and in the corners of the image, tilted by 30 to 45 degrees to all sides.
--board counts inner corners, where four squares meet: a board of 10 x 7 squares is 9x6.
Photos without a board, blurred ones, and those of another size are refused by name. The error is that of the
corners seen, against where the camera that was found would see them: 0.1 to 0.5 pixels are usual.
The result is the section 'camera' of a robot file, which --robot takes as it is. When --out names a robot file
of yours, all but camera.model stays (comments go). Next: 'hybrid-slam calibrate ground'.
Examples:
  hybrid-slam calibrate camera boards/*.jpg --board 9x6 --square 0.025 --out camera.yaml
  hybrid-slam calibrate camera boards/ --board 9x6 --square 0.025 --no-k3 --out forklift.yaml --picture fit.png
)";

BoardPhotos look_for_boards(const CameraOptions& options) {
    BoardPhotos photos(options.board, options.most_edge_width);
    const std::vector<std::filesystem::path> files = photos_in(options.photos);
    Progress progress("boards", options.common.quiet);
    for (const std::filesystem::path& file : files) {
        progress.say(file.filename().string());
        try {
            photos.add(file.string(), read_photo(file));
        } catch (const Error& error) {
            const std::string what = error.what();
            const std::string place = file.string() + ": ";
            photos.refuse(file.string(),
                          what.rfind(place, 0) == 0 ? what.substr(place.size()) : what);
        }
    }
    return photos;
}

void warn_of_refused(const BoardPhotos& photos) {
    for (const BoardPhoto& photo : photos.photos()) {
        if (!photo.usable()) {
            print_warning(photo.name + ": not used: " + photo.refusal);
        }
    }
}

Json to_json(const IntrinsicDeviations& deviations) {
    return {{"fx", deviations.fx}, {"fy", deviations.fy}, {"cx", deviations.cx},
            {"cy", deviations.cy}, {"k1", deviations.k1}, {"k2", deviations.k2},
            {"p1", deviations.p1}, {"p2", deviations.p2}, {"k3", deviations.k3}};
}

/// Of each photo, usable or not, in the order of the command line.
Json photos_json(const BoardPhotos& photos, const CameraCalibration& result) {
    Json list = Json::array();
    for (const BoardPhoto& photo : photos.photos()) {
        list.push_back({{"file", photo.name}, {"used", photo.usable()}});
        if (photo.edge_width > 0.0) {
            list.back()["edge_width_px"] = rounded(photo.edge_width);
        }
        if (!photo.usable()) {
            list.back()["refused"] = photo.refusal;
        }
    }
    for (const BoardFit& fit : result.fits) {
        list[fit.photo]["rms_px"] = rounded(fit.rms);
    }
    return list;
}

Json json_of(const CameraOptions& options, const BoardPhotos& photos,
             const CameraCalibration& result) {
    return {{"photos", photos.photos().size()},
            {"used", photos.usable()},
            {"rms_px", result.rms},
            {"model", tools::to_json(result.model)},
            {"deviations", to_json(result.deviations)},
            {"coverage", rounded(result.coverage)},
            {"tilt_spread_deg", rounded(degrees(result.tilt_spread))},
            {"views", photos_json(photos, result)},
            {"warnings", result.warnings},
            {"out", options.out.string()}};
}

std::string text_of(const BoardPhotos& photos, const CameraCalibration& result) {
    Table table({"photo", "error [px]", "edges [px]"});
    for (const BoardFit& fit : result.fits) {
        const BoardPhoto& photo = photos.photos()[fit.photo];
        table.add_row(
            {photo.name, fmt::format("{:.3f}", fit.rms), fmt::format("{:.1f}", photo.edge_width)});
    }
    const CameraModel& model = result.model;
    const IntrinsicDeviations& deviations = result.deviations;
    Table values({"", "value", "+-"});
    const auto add = [&values](const char* name, double value, double deviation, int digits) {
        values.add_row({name, fmt::format("{:.{}f}", value, digits),
                        deviation > 0.0 ? fmt::format("{:.{}f}", deviation, digits) : "fixed"});
    };
    add("fx", model.fx, deviations.fx, 2);
    add("fy", model.fy, deviations.fy, 2);
    add("cx", model.cx, deviations.cx, 2);
    add("cy", model.cy, deviations.cy, 2);
    add("k1", model.k1, deviations.k1, 5);
    add("k2", model.k2, deviations.k2, 5);
    add("p1", model.p1, deviations.p1, 5);
    add("p2", model.p2, deviations.p2, 5);
    add("k3", model.k3, deviations.k3, 5);
    return fmt::format(
        "{}\n\n{}\n\n{} of {} used, {} x {} pixels; error {:.3f} pixels\nboards reach {:.0f} % of "
        "the image and are tilted by up to {:.0f} degrees against each other",
        table.text(), values.text(), photos.usable(), counted(photos.photos().size(), "photo"),
        model.width, model.height, result.rms, 100.0 * result.coverage,
        degrees(result.tilt_spread));
}

int run_camera(const CameraOptions& options) {
    const CalibrationFile file(options.out);
    const BoardPhotos photos = look_for_boards(options);
    warn_of_refused(photos);
    const CameraCalibration result = calibrate_camera(photos, options.config);
    for (const std::string& warning : result.warnings) {
        print_warning(warning);
    }
    if (!options.picture.empty()) {
        draw_board_fits(photos, result).write_png(options.picture);
        print_info("wrote " + options.picture.string());
    }
    file.write(
        result.model, file.mounting().value_or(CameraMounting()),
        fmt::format("camera.model by 'hybrid-slam calibrate camera': {} boards, error {:.3f} "
                    "pixels{}",
                    photos.usable(), result.rms,
                    file.mounting() ? "" : "; camera.mounting is not measured yet"));
    if (options.common.json) {
        print_json(json_of(options, photos, result));
    } else {
        print_result(text_of(photos, result) + "\ncamera  " + options.out.string());
    }
    return kOk;
}

}  // namespace

void add_calibrate_camera_command(CLI::App& calibrate, Action& action) {
    const auto options = std::make_shared<CameraOptions>();
    CLI::App* command = calibrate.add_subcommand(
        "camera", "Find focal length and distortion from photos of a chessboard");
    command->add_option("PHOTOS", options->photos, "Photos (JPEG, PNG, PNM), or folders of them")
        ->required()
        ->type_name("");
    command->add_option("--board", options->board_text, "Inner corners of the board, e.g. 9x6")
        ->required()
        ->type_name("CxR");
    command->add_option("--square", options->square, "Side of a square of the board")
        ->required()
        ->check(CLI::Range(1e-4, 10.0).description(""))
        ->type_name("M");
    command->add_option("-o,--out", options->out, "Camera or robot file (YAML) to write")
        ->required()
        ->type_name("FILE");
    command->add_flag("--same-focal-lengths", options->config.same_focal_lengths,
                      "Keep fx = fy: square pixels");
    command->add_flag("--no-k3", options->config.no_k3, "Leave out k3: enough for ordinary lenses");
    command->add_flag("--no-tangential", options->config.no_tangential, "Leave out p1 and p2");
    command
        ->add_option("--most-edge-width", options->most_edge_width,
                     "Refuse photos with wider edges, in pixels at 640 x 480 (5)")
        ->check(CLI::Range(0.5, 100.0).description(""))
        ->type_name("PX");
    command->add_option("--picture", options->picture, "Draws corners and errors into this PNG")
        ->type_name("FILE");
    add_common_options(*command, options->common);
    command->footer(kFooter);
    command->callback([options, &action] {
        const auto board = parse_board(options->board_text, options->square);
        if (!board) {
            throw CLI::ValidationError("--board: must look like 9x6, not '" + options->board_text +
                                       "'");
        }
        options->board = *board;
        check_picture(options->picture, options->out, options->photos);
        action = [options] { return run_camera(*options); };
    });
}

}  // namespace hybrid_slam::tools
