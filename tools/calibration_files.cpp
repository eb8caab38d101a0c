// SPDX-License-Identifier: Apache-2.0
#include "calibration_files.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>

#include "commands.hpp"
#include "hybrid_slam/camera/image_codec.hpp"
#include "hybrid_slam/core/config.hpp"
#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/text_file.hpp"
#include "hybrid_slam/sensors/robot.hpp"
#include "messages.hpp"

namespace hybrid_slam::tools {
namespace {

bool is_image(const std::filesystem::path& file) {
    std::string ending = file.extension().string();
    std::transform(ending.begin(), ending.end(), ending.begin(),
                   [](unsigned char letter) { return std::tolower(letter); });
    for (const char* known : {".jpg", ".jpeg", ".png", ".pgm", ".ppm", ".pnm"}) {
        if (ending == known) {
            return true;
        }
    }
    return false;
}

bool is_png(const std::filesystem::path& file) {
    constexpr std::string_view kSignature = "\x89PNG\r\n\x1a\n";
    std::string start(kSignature.size(), '\0');
    return std::filesystem::is_regular_file(file) &&
           std::ifstream(file, std::ios::binary).read(start.data(), kSignature.size()) &&
           start == kSignature;
}

/// By whatever names, and whether or not they are there.
bool are_same(const std::filesystem::path& a, const std::filesystem::path& b) {
    std::error_code missing;
    // Absolute first: of a relative name none of which is there, nothing would be resolved.
    const auto resolved = [&](const std::filesystem::path& file) {
        return std::filesystem::weakly_canonical(std::filesystem::absolute(file), missing);
    };
    return std::filesystem::equivalent(a, b, missing) || resolved(a) == resolved(b);
}

template <typename Described>
nlohmann::ordered_json json_of(Described described) {
    ConfigSchema schema;
    describe(schema, described);
    nlohmann::ordered_json json;
    for (const ConfigField& field : schema.fields()) {
        json[field.key] = nlohmann::ordered_json::parse(field.get());
    }
    return json;
}

}  // namespace

Image read_photo(const std::filesystem::path& file) {
    constexpr std::size_t kMostBytes = std::size_t{1} << 28U;
    const std::string bytes = read_whole_file(file, kMostBytes);
    auto image = decode_image({bytes.begin(), bytes.end()}, ImageColor::kGray);
    if (!image) {
        throw Error(file.string() + ": is no image, or a damaged one (JPEG, PNG and PNM are read)");
    }
    return std::move(*image);
}

std::vector<std::filesystem::path> photos_in(const std::vector<std::filesystem::path>& paths) {
    std::vector<std::filesystem::path> files;
    for (const std::filesystem::path& path : paths) {
        if (!std::filesystem::is_directory(path)) {
            files.push_back(path);
            continue;
        }
        std::vector<std::filesystem::path> inside;
        for (const auto& entry : std::filesystem::directory_iterator(path)) {
            if (is_image(entry.path())) {
                inside.push_back(entry.path());
            }
        }
        if (inside.empty()) {
            throw Error(path.string() + ": holds no image (jpg, png, pgm or ppm)");
        }
        std::sort(inside.begin(), inside.end());
        files.insert(files.end(), inside.begin(), inside.end());
    }
    return files;
}

void check_picture(const std::filesystem::path& picture, const std::filesystem::path& out,
                   const std::vector<std::filesystem::path>& photos) {
    if (picture.empty()) {
        return;
    }
    if (are_same(picture, out)) {
        throw CLI::ValidationError("--picture: is the same file as --out");
    }
    if (!std::filesystem::exists(picture)) {
        return;
    }
    for (const std::filesystem::path& photo : photos_in(photos)) {
        if (are_same(picture, photo)) {
            throw CLI::ValidationError("--picture: " + photo.string() +
                                       " is one of the photos, and is not replaced");
        }
    }
    if (!is_png(picture)) {
        throw CLI::ValidationError("--picture: " + picture.string() +
                                   " is there and no PNG, so it is not replaced");
    }
}

std::vector<double> parse_numbers(std::string_view text, std::size_t count) {
    std::string spaced(text);
    if (static_cast<std::size_t>(std::count(text.begin(), text.end(), ',')) + 1 != count) {
        return {};
    }
    std::replace(spaced.begin(), spaced.end(), ',', ' ');
    Tokens tokens(spaced);
    std::vector<double> numbers(count);
    for (double& number : numbers) {
        if (!parse_double(tokens.next(), number) || !std::isfinite(number)) {
            return {};
        }
    }
    return tokens.next().empty() ? numbers : std::vector<double>();
}

std::optional<Chessboard> parse_board(std::string_view text, double square) {
    const std::size_t cross = text.find('x');
    long columns = 0;
    long rows = 0;
    if (cross == std::string_view::npos || !parse_long(text.substr(0, cross), columns) ||
        !parse_long(text.substr(cross + 1), rows) || std::max(columns, rows) > 1000 ||
        std::min(columns, rows) < 1) {
        return std::nullopt;
    }
    return Chessboard{static_cast<int>(columns), static_cast<int>(rows), square};
}

nlohmann::ordered_json to_json(const CameraModel& model) {
    return json_of(model);
}

nlohmann::ordered_json to_json(const CameraMounting& mounting) {
    return json_of(mounting);
}

CalibrationFile::CalibrationFile(std::filesystem::path file, const std::filesystem::path& source)
    : file_(std::move(file)) {
    replaceable_file(file_);  // throws for what is no file at all, before the work
    if (std::filesystem::exists(file_)) {
        try {
            before_ = read_camera_file(file_);
        } catch (const Error& error) {
            throw Error(
                fmt::format("{} (so it is not replaced; name another --out)", error.what()));
        }
        if (before_->format != CameraFormat::kRobot) {
            throw Error(file_.string() +
                        ": is a calibration of OpenCV or ROS, which is not replaced; name another "
                        "--out");
        }
        kept_ = file_;
    } else if (!source.empty()) {
        before_ = read_camera_file(source);
        kept_ = source;
    }
    if (before_ && before_->other_keys.empty()) {
        kept_.clear();
    }
    if (!kept_.empty()) {
        read_robot(kept_);  // throws when it is none
    }
}

std::optional<CameraMounting> CalibrationFile::mounting() const {
    return before_ && before_->has_mounting ? std::optional(before_->mounting) : std::nullopt;
}

void CalibrationFile::write(const CameraModel& model, const CameraMounting& mounting,
                            const std::string& comment) const {
    std::string yaml;
    if (kept_.empty()) {
        yaml = camera_yaml(model, mounting);
    } else {
        RobotConfig robot = read_robot(kept_);
        robot.camera.model = model;
        robot.camera.mounting = mounting;
        yaml = to_yaml(std::move(robot));
    }
    write_text(file_, "# " + comment + "\n" + yaml);
}

}  // namespace hybrid_slam::tools
