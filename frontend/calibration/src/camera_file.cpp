// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/calibration/camera_file.hpp"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <set>
#include <string_view>

#include "hybrid_slam/core/config.hpp"
#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/text_file.hpp"

namespace hybrid_slam {
namespace {

/// What else a robot file says: at the top, and of the camera.
constexpr std::array<std::string_view, 4> kRobotKeys{"name", "lidar", "vehicle", "can"};
constexpr std::array<std::string_view, 5> kCameraKeys{"enabled", "device", "rate", "latency",
                                                      "stall_after"};

template <typename Names, typename Name>
bool is_one_of(const Names& names, const Name& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
}

void describe_camera(ConfigSchema& schema, CameraModel& model, CameraMounting& mounting) {
    const ConfigSchema::Section camera(schema, "camera");
    {
        const ConfigSchema::Section section(schema, "model");
        describe(schema, model);
    }
    const ConfigSchema::Section section(schema, "mounting");
    describe(schema, mounting);
}

int line_of(const YAML::Node& node) {
    return node.Mark().line + 1;
}

/// One file, whose name and lines errors tell.
class Reader {
  public:
    Reader(std::string file, const YAML::Node& root) : file_(std::move(file)), root_(root) {}

    CameraFile read() {
        if (find(root_, "distortion_model") || find(root_, "camera_name")) {
            return read_foreign(CameraFormat::kRos);
        }
        if (find(root_, "camera_matrix") || find(root_, "Camera_Matrix")) {
            return read_foreign(CameraFormat::kOpenCv);
        }
        return read_robot();
    }

  private:
    /// A key and what stands behind it.
    struct Found {
        std::string key;
        YAML::Node value;
        int line = 0;
        explicit operator bool() const { return line > 0; }
    };

    [[noreturn]] void fail(int line, const std::string& what) const {
        throw Error(fmt::format("{}:{}: {}", file_, line, what));
    }

    [[noreturn]] void fail(const Found& found, const std::string& what) const {
        fail(found.line, fmt::format("key '{}': {}", found.key, what));
    }

    static Found find(const YAML::Node& map, std::string_view key) {
        for (const auto& item : map) {
            if (item.first.IsScalar() && item.first.Scalar() == key) {
                return {std::string(key), item.second, line_of(item.first)};
            }
        }
        return {};
    }

    /// The first of several spellings; throws Error when there is none.
    Found need(std::initializer_list<std::string_view> spellings) const {
        for (const std::string_view key : spellings) {
            if (Found found = find(root_, key)) {
                return found;
            }
        }
        throw Error(fmt::format("{}: key '{}': is missing", file_, *spellings.begin()));
    }

    CameraFile read_robot();
    void read_section(const YAML::Node& map, const std::string& prefix, ConfigSchema& schema);
    void read_camera(const YAML::Node& camera, CameraFile& result);
    std::string key_of(const YAML::Node& key, const std::string& prefix,
                       std::set<std::string>& known) const;

    CameraFile read_foreign(CameraFormat format);
    void refuse_other_models() const;
    int whole_number(const Found& found) const;
    double number(const Found& found, const YAML::Node& value) const;
    std::vector<double> numbers(const Found& found) const;
    void take_matrix(CameraModel& model) const;
    void take_distortion(CameraModel& model) const;

    std::string file_;
    YAML::Node root_;
};

std::string Reader::key_of(const YAML::Node& key, const std::string& prefix,
                           std::set<std::string>& known) const {
    if (!key.IsScalar()) {
        fail(line_of(key), "a key must be a plain word");
    }
    const std::string name = prefix + key.Scalar();
    if (!known.insert(name).second) {
        fail(line_of(key), fmt::format("key '{}': repeated", name));
    }
    return name;
}

CameraFile Reader::read_robot() {
    CameraFile result;
    std::set<std::string> known;
    for (const auto& item : root_) {
        const std::string key = key_of(item.first, "", known);
        if (key == "camera") {
            read_camera(item.second, result);
        } else if (is_one_of(kRobotKeys, key)) {
            result.other_keys.push_back(key);
        } else {
            fail(line_of(item.first), fmt::format("key '{}': unknown key", key));
        }
    }
    return result;
}

void Reader::read_camera(const YAML::Node& camera, CameraFile& result) {
    if (!camera.IsMap() && !camera.IsNull()) {
        fail(line_of(camera), "key 'camera': is a section and takes no value");
    }
    ConfigSchema schema;
    describe_camera(schema, result.model, result.mounting);
    std::set<std::string> known;
    for (const auto& item : camera) {
        const std::string key = key_of(item.first, "camera.", known);
        if (key == "camera.model" || key == "camera.mounting") {
            const bool told = item.second.IsMap() && item.second.size() > 0;
            (key == "camera.model" ? result.has_model : result.has_mounting) = told;
            if (!item.second.IsMap() && !item.second.IsNull()) {
                fail(line_of(item.first),
                     fmt::format("key '{}': is a section and takes no value", key));
            }
            read_section(item.second, key + ".", schema);
        } else if (is_one_of(kCameraKeys, item.first.Scalar())) {
            result.other_keys.push_back(key);
        } else {
            fail(line_of(item.first), fmt::format("key '{}': unknown key", key));
        }
    }
}

void Reader::read_section(const YAML::Node& map, const std::string& prefix, ConfigSchema& schema) {
    std::set<std::string> known;
    for (const auto& item : map) {
        const std::string key = key_of(item.first, prefix, known);
        if (!item.second.IsScalar()) {
            fail(line_of(item.first), fmt::format("key '{}': needs a single value", key));
        }
        try {
            schema.override_with(key + "=" + item.second.Scalar());
        } catch (const Error& error) {
            fail(line_of(item.first), error.what());
        }
    }
}

double Reader::number(const Found& found, const YAML::Node& value) const {
    double parsed = 0.0;
    if (!value.IsScalar() || !parse_double(value.Scalar(), parsed)) {
        fail(found, "must be a number" +
                        (value.IsScalar() ? ", not '" + value.Scalar() + "'" : std::string()));
    }
    return parsed;
}

int Reader::whole_number(const Found& found) const {
    const double value = number(found, found.value);
    if (!(value >= 1.0 && value <= 1e6 && value == static_cast<int>(value))) {
        fail(found,
             fmt::format("must be a whole number of pixels, not '{}'", found.value.Scalar()));
    }
    return static_cast<int>(value);
}

/// The `data` of a matrix as OpenCV and ROS write it.
std::vector<double> Reader::numbers(const Found& found) const {
    const Found data = found.value.IsMap() ? find(found.value, "data") : Found{};
    if (!data || !data.value.IsSequence()) {
        fail(found, "needs a matrix with a list 'data'");
    }
    std::vector<double> values;
    for (const YAML::Node& item : data.value) {
        values.push_back(number(found, item));
    }
    return values;
}

void Reader::refuse_other_models() const {
    const Found model = find(root_, "distortion_model");
    if (model) {
        const std::string name = model.value.IsScalar() ? model.value.Scalar() : "";
        if (name != "plumb_bob" && name != "rational_polynomial") {
            fail(model, fmt::format("must be plumb_bob (Brown's distortion), not '{}'", name));
        }
    }
    const Found fisheye = find(root_, "fisheye_model");
    if (fisheye && number(fisheye, fisheye.value) != 0.0) {
        fail(fisheye, "is a fisheye, which needs another distortion than Brown's");
    }
}

void Reader::take_matrix(CameraModel& model) const {
    const Found found = need({"camera_matrix", "Camera_Matrix"});
    const std::vector<double> m = numbers(found);
    if (m.size() != 9) {
        fail(found, fmt::format("must hold 9 numbers, not {}", m.size()));
    }
    if (m[1] != 0.0 || m[3] != 0.0 || m[6] != 0.0 || m[7] != 0.0 || m[8] != 1.0) {
        fail(found, "must look like [fx, 0, cx, 0, fy, cy, 0, 0, 1]");
    }
    model.fx = m[0];
    model.cx = m[2];
    model.fy = m[4];
    model.cy = m[5];
}

void Reader::take_distortion(CameraModel& model) const {
    const Found found = need({"distortion_coefficients", "Distortion_Coefficients"});
    const std::vector<double> d = numbers(found);
    constexpr std::array<std::size_t, 5> kCounts{4, 5, 8, 12, 14};
    if (!is_one_of(kCounts, d.size())) {
        fail(found, fmt::format("must hold 4 or 5 numbers (k1, k2, p1, p2, k3), not {}", d.size()));
    }
    if (std::any_of(d.begin() + static_cast<std::ptrdiff_t>(std::min<std::size_t>(5, d.size())),
                    d.end(), [](double value) { return value != 0.0; })) {
        fail(found, "has more coefficients than k1, k2, p1, p2, k3 (the rational model)");
    }
    model.k1 = d[0];
    model.k2 = d[1];
    model.p1 = d[2];
    model.p2 = d[3];
    model.k3 = d.size() > 4 ? d[4] : 0.0;
}

CameraFile Reader::read_foreign(CameraFormat format) {
    refuse_other_models();
    CameraFile result;
    result.format = format;
    result.has_model = true;
    result.model.width = whole_number(need({"image_width", "image_Width"}));
    result.model.height = whole_number(need({"image_height", "image_Height"}));
    take_matrix(result.model);
    take_distortion(result.model);
    try {
        ConfigSchema schema;
        describe(schema, result.model);
    } catch (const Error& error) {
        throw Error(fmt::format("{}: {}", file_, error.what()));
    }
    return result;
}

}  // namespace

CameraFile read_camera_file(const std::filesystem::path& file) {
    constexpr std::size_t kMostBytes = std::size_t{1} << 20U;
    const std::string text = read_whole_file(file, kMostBytes);
    if (text.rfind("<?xml", 0) == 0) {
        throw Error(file.string() + ":1: is XML; let OpenCV write YAML");
    }
    try {
        const std::vector<YAML::Node> documents = YAML::LoadAll(text);
        if (documents.empty() || documents[0].IsNull()) {
            throw Error(file.string() + ": is empty");
        }
        if (documents.size() > 1) {
            throw Error(file.string() + ": holds more than one YAML document");
        }
        if (!documents[0].IsMap()) {
            throw Error(file.string() + ":1: must hold lines like 'key: value'");
        }
        return Reader(file.string(), documents[0]).read();
    } catch (const YAML::Exception& error) {
        throw Error(fmt::format("{}:{}: {}", file.string(), error.mark.line + 1, error.msg));
    }
}

std::string camera_yaml(CameraModel model, CameraMounting mounting) {
    ConfigSchema schema;
    describe_camera(schema, model, mounting);
    return schema.to_yaml();
}

}  // namespace hybrid_slam
