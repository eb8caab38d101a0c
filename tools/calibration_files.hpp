// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hybrid_slam/calibration/camera_file.hpp"
#include "hybrid_slam/calibration/chessboard.hpp"
#include "hybrid_slam/core/measurements.hpp"

namespace hybrid_slam::tools {

/// A photo in gray. Throws Error "file: why" when it cannot be read or is no image.
Image read_photo(const std::filesystem::path& file);

/// The files that were named; in place of a folder the images in it, by name.
std::vector<std::filesystem::path> photos_in(const std::vector<std::filesystem::path>& paths);

/// Throws CLI::ValidationError when --picture is one of the photos, or in a folder of them and read
/// as one, is the same file as --out, or would replace what is no PNG. Empty: none is drawn.
void check_picture(const std::filesystem::path& picture, const std::filesystem::path& out,
                   const std::vector<std::filesystem::path>& photos);

/// "9x6" as columns and rows of inner corners; empty when it is none.
std::optional<Chessboard> parse_board(std::string_view text, double square);

/// "1,2.5" as so many numbers; empty when it is none.
std::vector<double> parse_numbers(std::string_view text, std::size_t count);

nlohmann::ordered_json to_json(const CameraModel& model);
nlohmann::ordered_json to_json(const CameraMounting& mounting);

/// The file that a calibration is written into. What it says of a robot already stays as it is, but
/// for the model and the mounting of the camera; in a new file that holds for what `source` says.
class CalibrationFile {
  public:
    /// Throws Error for a file that is there and is neither a camera nor a robot of ours.
    explicit CalibrationFile(std::filesystem::path file, const std::filesystem::path& source = {});

    /// Empty when nothing says how the camera is mounted.
    std::optional<CameraMounting> mounting() const;

    /// `comment` is the first line, behind a #.
    void write(const CameraModel& model, const CameraMounting& mounting,
               const std::string& comment) const;

  private:
    std::filesystem::path file_;
    std::filesystem::path kept_;  ///< whose other keys are kept; empty: none has any
    std::optional<CameraFile> before_;
};

}  // namespace hybrid_slam::tools
