// SPDX-License-Identifier: Apache-2.0
#include "scan_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/text_file.hpp"
#include "messages.hpp"

namespace hybrid_slam::tools {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kMostBytes = std::size_t{1} << 24U;
constexpr std::size_t kMostBeams = 100000;
constexpr double kMostRange = 1000.0;          ///< metres
constexpr double kMostTurn = 2.0 * kPi + 0.1;  ///< radians; some scanners close the circle twice
constexpr double kLeastTurn = 1e-6;            ///< radians between two beams
constexpr double kMostLever = 100.0;  ///< metres from the robot to its laser, along an axis
constexpr double kMostStamp = 1e12;   ///< seconds

constexpr auto kNoReturn = std::numeric_limits<float>::infinity();

/// Reads one object of the file; knows where it is, for errors.
class ObjectReader {
  public:
    /// `name` of the object; empty: the file itself.
    ObjectReader(const std::filesystem::path& file, const Json& object, const std::string& name)
        : file_(file), object_(object), prefix_(name.empty() ? "" : name + ".") {
        if (!object.is_object()) {
            throw Error(fmt::format("{}: {}must be an object", file.string(),
                                    name.empty() ? "" : "key '" + name + "' "));
        }
    }

    void expect_only(std::initializer_list<std::string_view> known) const {
        for (const auto& [key, value] : object_.items()) {
            if (std::find(known.begin(), known.end(), key) == known.end()) {
                throw error_at(key,
                               fmt::format("is unknown; there are {}", fmt::join(known, ", ")));
            }
        }
    }
    bool has(const char* key) const { return object_.contains(key); }
    const Json& at(const char* key) const {
        if (!has(key)) {
            throw error_at(key, "is missing");
        }
        return object_[key];
    }
    double number(const char* key) const {
        const Json& value = at(key);
        if (!value.is_number() || !std::isfinite(value.get<double>())) {
            throw error_at(key, "must be a number");
        }
        return value.get<double>();
    }
    double number(const char* key, double least, double most) const {
        const double value = number(key);
        if (value < least || value > most) {
            throw error_at(key, fmt::format("must be from {:g} to {:g}", least, most));
        }
        return value;
    }
    Error error_at(const std::string& key, const std::string& what) const {
        return Error(fmt::format("{}: key '{}{}' {}", file_.string(), prefix_, key, what));
    }

  private:
    const std::filesystem::path& file_;
    const Json& object_;
    std::string prefix_;
};

/// Python writes what is no number so.
bool is_not_finite(std::string_view text) {
    return text.substr(0, 3) == "NaN" || text.substr(0, 8) == "Infinity";
}

Json parse(const std::filesystem::path& file) {
    const std::string text = read_whole_file(file, kMostBytes);
    try {
        return Json::parse(text);
    } catch (const Json::parse_error& error) {
        std::size_t at = std::min(text.size(), error.byte > 0 ? error.byte - 1 : 0);
        // What cannot be read begins before the letter at which it is noticed.
        while (at > 0 && std::isalpha(static_cast<unsigned char>(text[at - 1])) != 0) {
            --at;
        }
        const auto end = text.begin() + static_cast<std::ptrdiff_t>(at);
        throw Error(fmt::format("{}:{}: is no JSON from here on{}", file.string(),
                                1 + std::count(text.begin(), end, '\n'),
                                is_not_finite(std::string_view(text).substr(at))
                                    ? ": NaN and Infinity are no numbers; 'ranges' has null for "
                                      "what did not return"
                                    : ""));
    } catch (const Json::exception&) {  // a number that no double holds
        throw Error(file.string() + ": holds a number that is too large");
    }
}

std::vector<float> ranges_of(const ObjectReader& reader) {
    const Json& values = reader.at("ranges");
    if (!values.is_array() || values.empty() || values.size() > kMostBeams) {
        throw reader.error_at("ranges", fmt::format("must be a list of 1 to {}", kMostBeams));
    }
    std::vector<float> ranges;
    ranges.reserve(values.size());
    for (const Json& value : values) {
        if (!value.is_null() && !value.is_number()) {
            throw reader.error_at(fmt::format("ranges[{}]", ranges.size()),
                                  "must be a number or null");
        }
        const double range = value.is_null() ? kMostRange : value.get<double>();
        ranges.push_back(range < kMostRange ? static_cast<float>(range) : kNoReturn);
    }
    return ranges;
}

Pose2d pose_of(const std::filesystem::path& file, const Json& json, const char* key) {
    const ObjectReader reader(file, json, key);
    reader.expect_only({"x", "y", "yaw_deg"});
    return {reader.number("x", -kMostLever, kMostLever),
            reader.number("y", -kMostLever, kMostLever),
            normalize_angle(radians(reader.number("yaw_deg", -360.0, 360.0)))};
}

/// The shortest digits that give the same float again.
std::string text_of(const Scan& scan, float range) {
    return scan.is_return(range) ? fmt::format("{}", range) : "null";
}

}  // namespace

Scan read_scan(const std::filesystem::path& file) {
    const Json json = parse(file);
    const ObjectReader reader(file, json, "");
    reader.expect_only({"stamp", "angle_min", "angle_increment", "range_min", "range_max",
                        "robot_from_laser", "ranges"});
    Scan scan;
    scan.ranges = ranges_of(reader);
    scan.angle_min = reader.number("angle_min", -kMostTurn, kMostTurn);
    scan.angle_increment = reader.number("angle_increment", -kPi, kPi);
    scan.range_max = reader.number("range_max", 0.01, kMostRange);
    scan.range_min = reader.has("range_min") ? reader.number("range_min", 0.0, kMostRange) : 0.0;
    scan.stamp = reader.has("stamp") ? reader.number("stamp", -kMostStamp, kMostStamp) : 0.0;
    if (scan.range_min >= scan.range_max) {
        throw reader.error_at("range_min", "must be less than range_max");
    }
    if (std::abs(scan.angle_increment) < kLeastTurn ||
        std::abs(scan.angle_increment) * static_cast<double>(scan.ranges.size() - 1) > kMostTurn) {
        throw reader.error_at("angle_increment",
                              "must be radians, which turn the beams by no more than one circle");
    }
    if (reader.has("robot_from_laser")) {
        scan.robot_from_laser = pose_of(file, reader.at("robot_from_laser"), "robot_from_laser");
    }
    return scan;
}

void write_scan(const std::filesystem::path& file, const Scan& scan) {
    const Pose2d& laser = scan.robot_from_laser;
    std::string text = fmt::format(
        "{{\n  \"stamp\": {},\n  \"angle_min\": {},\n  \"angle_increment\": {},\n"
        "  \"range_min\": {},\n  \"range_max\": {},\n"
        "  \"robot_from_laser\": {{\"x\": {}, \"y\": {}, \"yaw_deg\": {}}},\n  \"ranges\": [",
        scan.stamp, scan.angle_min, scan.angle_increment, scan.range_min, scan.range_max, laser.x(),
        laser.y(), degrees(laser.heading));
    for (std::size_t i = 0; i < scan.ranges.size(); ++i) {
        text += (i == 0 ? "" : i % 12 == 0 ? ",\n    " : ", ") + text_of(scan, scan.ranges[i]);
    }
    write_text(file, text + "]\n}\n");
}

}  // namespace hybrid_slam::tools
