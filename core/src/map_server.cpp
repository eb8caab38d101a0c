// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <string>

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/occupancy_grid.hpp"
#include "hybrid_slam/core/text_file.hpp"

namespace hybrid_slam {
namespace {

constexpr double kOccupiedThreshold = 0.65;
// 205 is 0.19608: just above, so unknown. With the 0.25 of some savers all unknown cells become
// free.
constexpr double kFreeThreshold = 0.196;
constexpr std::size_t kMostPixels = std::size_t{1} << 28U;
constexpr std::size_t kMostHeader = std::size_t{1} << 16U;

char pixel_of(CellState state) {
    switch (state) {
        case CellState::kFree:
            return static_cast<char>(254);
        case CellState::kOccupied:
            return static_cast<char>(0);
        case CellState::kUnknown:
            break;
    }
    return static_cast<char>(205);
}

/// A gray image as the file holds it, row by row from the top.
struct GrayImage {
    std::size_t width = 0;
    std::size_t height = 0;
    double white = 255.0;
    std::string pixels;
};

/// Takes the header of a PGM apart: words between blanks, with comments from '#' to the line's end.
class PgmReader {
  public:
    explicit PgmReader(const std::filesystem::path& file)
        : file_(file.string()), bytes_(read_whole_file(file, kMostPixels + kMostHeader)) {}

    GrayImage read() {
        if (bytes_.compare(0, 2, "P5") != 0) {
            fail("is not a binary PGM (P5)");
        }
        at_ = 2;
        GrayImage image;
        image.width = number("width");
        image.height = number("height");
        const std::size_t white = number("maximum");
        if (image.width == 0 || image.height == 0) {
            fail(fmt::format("has no pixels: it is {} x {}", image.width, image.height));
        }
        if (image.height > kMostPixels / image.width) {
            fail(fmt::format("is too large: {} x {} pixels", image.width, image.height));
        }
        if (white < 1 || white > 255) {
            fail(fmt::format("must have pixels of one byte, its maximum is {}", white));
        }
        image.white = static_cast<double>(white);
        ++at_;  // one blank ends the header
        const std::size_t wanted = image.width * image.height;
        const std::size_t present = bytes_.size() - std::min(at_, bytes_.size());
        if (present < wanted) {
            fail(fmt::format("is truncated: holds {} of {} pixels", present, wanted));
        }
        image.pixels = bytes_.substr(at_, wanted);
        return image;
    }

  private:
    [[noreturn]] void fail(const std::string& what) const { throw Error(file_ + ": " + what); }

    bool at_blank() const { return std::isspace(static_cast<unsigned char>(bytes_[at_])) != 0; }

    void skip_blanks_and_comments() {
        while (at_ < bytes_.size() && (at_blank() || bytes_[at_] == '#')) {
            at_ = bytes_[at_] == '#' ? std::min(bytes_.find('\n', at_), bytes_.size()) : at_ + 1;
        }
    }

    std::size_t number(const char* name) {
        skip_blanks_and_comments();
        const std::size_t begin = at_;
        while (at_ < bytes_.size() && !at_blank() && bytes_[at_] != '#') {
            ++at_;
        }
        long value = 0;
        const std::string_view token = std::string_view(bytes_).substr(begin, at_ - begin);
        if (!parse_long(token, value) || value < 0) {
            fail(fmt::format("has a broken header: no {}", name));
        }
        return static_cast<std::size_t>(value);
    }

    std::string file_;
    std::string bytes_;
    std::size_t at_ = 0;
};

/// The keys of a map's YAML, with errors that name them.
class MapYaml {
  public:
    explicit MapYaml(const std::filesystem::path& file) : file_(file.string()) {
        constexpr std::size_t kMostBytes = std::size_t{1} << 20U;
        const std::string text = read_whole_file(file, kMostBytes);
        try {
            root_ = YAML::Load(text);
        } catch (const YAML::Exception& error) {
            throw Error(fmt::format("{}:{}: {}", file_, error.mark.line + 1, error.msg));
        }
        if (!root_.IsMap()) {
            throw Error(file_ + ": must hold lines like 'resolution: 0.05'");
        }
    }

    std::string text(const char* key) const { return scalar(key, at(key)); }

    double number(const char* key) const { return number(key, at(key)); }

    std::array<double, 3> three_numbers(const char* key) const {
        const YAML::Node node = at(key);
        if (!node.IsSequence() || node.size() != 3) {
            fail(key, node, "must be a list of 3 numbers");
        }
        return {number(key, node[0]), number(key, node[1]), number(key, node[2])};
    }

    /// ROS 1 writes 0 or 1, Nav2 false or true.
    bool flag(const char* key) const {
        const std::string value = text(key);
        if (value != "0" && value != "1" && value != "false" && value != "true") {
            fail(key, at(key), "must be 0 or 1, not '" + value + "'");
        }
        return value == "1" || value == "true";
    }

    bool has(const char* key) const { return root_[key].IsDefined(); }

    [[noreturn]] void fail(const char* key, const YAML::Node& node, const std::string& what) const {
        throw Error(fmt::format("{}:{}: key '{}': {}", file_, node.Mark().line + 1, key, what));
    }

    YAML::Node at(const char* key) const {
        const YAML::Node node = root_[key];
        if (!node.IsDefined()) {
            throw Error(fmt::format("{}: key '{}' is missing", file_, key));
        }
        return node;
    }

  private:
    std::string scalar(const char* key, const YAML::Node& node) const {
        if (!node.IsScalar()) {
            fail(key, node, "needs a single value");
        }
        return node.Scalar();
    }

    double number(const char* key, const YAML::Node& node) const {
        const std::string value = scalar(key, node);
        double result = 0.0;
        if (!parse_double(value, result) || !std::isfinite(result)) {
            fail(key, node, "must be a number, not '" + value + "'");
        }
        return result;
    }

    std::string file_;
    YAML::Node root_;
};

/// How pixels become states.
struct Thresholds {
    double occupied = kOccupiedThreshold;
    double free = kFreeThreshold;
    bool negate = false;

    /// In map_server's own arithmetic, so that pixels just on a threshold fall to the same side.
    CellState state_of(double pixel, double white) const {
        const double probability = (negate ? pixel : white - pixel) / white;
        return probability > occupied ? CellState::kOccupied
               : probability < free   ? CellState::kFree
                                      : CellState::kUnknown;
    }
};

Thresholds read_thresholds(const MapYaml& yaml) {
    Thresholds thresholds;
    thresholds.occupied = yaml.number("occupied_thresh");
    thresholds.free = yaml.number("free_thresh");
    thresholds.negate = yaml.flag("negate");
    if (!(0.0 <= thresholds.free && thresholds.free < thresholds.occupied &&
          thresholds.occupied <= 1.0)) {
        yaml.fail("free_thresh", yaml.at("free_thresh"),
                  "must be from 0 up to below occupied_thresh, and that at most 1");
    }
    if (yaml.has("mode")) {
        std::string mode = yaml.text("mode");
        std::transform(mode.begin(), mode.end(), mode.begin(), [](unsigned char letter) {
            return static_cast<char>(std::tolower(letter));
        });
        // The grades between the thresholds of "scale" are unknown to us.
        if (mode != "trinary" && mode != "scale") {
            yaml.fail("mode", yaml.at("mode"), "must be trinary or scale, not '" + mode + "'");
        }
    }
    return thresholds;
}

/// Image rows run down, grid rows up.
void fill_states(const GrayImage& image, const Thresholds& thresholds, StateGrid& grid) {
    std::array<CellState, 256> state_of_pixel{};
    for (std::size_t value = 0; value < state_of_pixel.size(); ++value) {
        const double pixel = std::min(static_cast<double>(value), image.white);
        state_of_pixel[value] = thresholds.state_of(pixel, image.white);
    }
    grid.states.reserve(image.pixels.size());
    for (std::size_t row = image.height; row-- > 0;) {
        for (std::size_t x = 0; x < image.width; ++x) {
            const char pixel = image.pixels[row * image.width + x];
            grid.states.push_back(state_of_pixel[static_cast<unsigned char>(pixel)]);
        }
    }
}

void write_pgm(const std::filesystem::path& file, const StateGrid& grid) {
    const GridGeometry& geometry = grid.geometry;
    TextFileWriter writer(file);
    writer.write(fmt::format("P5\n# CREATOR: hybrid_slam {:.3f} m/pix\n{} {}\n255\n",
                             geometry.resolution, geometry.width, geometry.height));
    std::string row(static_cast<std::size_t>(geometry.width), '\0');
    for (int y = geometry.height - 1; y >= 0; --y) {
        for (int x = 0; x < geometry.width; ++x) {
            row[static_cast<std::size_t>(x)] = pixel_of(grid.states[geometry.index_of({x, y})]);
        }
        writer.write(row);
    }
    writer.close();
}

std::string yaml_text(const std::string& value) {
    YAML::Emitter emitter;  // quotes what YAML would misread
    emitter << value;
    return emitter.c_str();
}

}  // namespace

void write_map_server(const std::filesystem::path& yaml_file, const StateGrid& grid) {
    const GridGeometry& geometry = grid.geometry;
    if (geometry.width <= 0 || geometry.height <= 0 ||
        grid.states.size() !=
            static_cast<std::size_t>(geometry.width) * static_cast<std::size_t>(geometry.height)) {
        throw Error(fmt::format("{}: a map of {} x {} cells with {} states cannot be written",
                                yaml_file.string(), geometry.width, geometry.height,
                                grid.states.size()));
    }
    std::filesystem::path image_file = yaml_file;
    image_file.replace_extension(".pgm");
    // The image first: whoever sees the YAML finds its image complete.
    write_pgm(image_file, grid);
    TextFileWriter writer(yaml_file);
    writer.write(fmt::format(
        "image: {}\nresolution: {}\norigin: [{}, {}, {}]\nnegate: 0\n"
        "occupied_thresh: {}\nfree_thresh: {}\n",
        yaml_text(image_file.filename().string()), geometry.resolution, geometry.origin.x(),
        geometry.origin.y(), grid.origin_yaw, kOccupiedThreshold, kFreeThreshold));
    writer.close();
}

StateGrid read_map_server(const std::filesystem::path& yaml_file) {
    const MapYaml yaml(yaml_file);
    StateGrid grid;
    grid.geometry.resolution = yaml.number("resolution");
    if (!(grid.geometry.resolution > 0.0)) {
        yaml.fail("resolution", yaml.at("resolution"), "must be above 0");
    }
    const auto [x, y, yaw] = yaml.three_numbers("origin");
    grid.geometry.origin = {x, y};
    grid.origin_yaw = yaw;
    const Thresholds thresholds = read_thresholds(yaml);
    // An absolute image path replaces the folder, as operator/ does.
    const GrayImage image = PgmReader(yaml_file.parent_path() / yaml.text("image")).read();
    grid.geometry.width = static_cast<int>(image.width);
    grid.geometry.height = static_cast<int>(image.height);
    fill_states(image, thresholds, grid);
    return grid;
}

}  // namespace hybrid_slam
