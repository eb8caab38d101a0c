// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/text_file.hpp"
#include "hybrid_slam/simulator/simulated_vehicle.hpp"
#include "hybrid_slam/simulator/simulator.hpp"
#include "hybrid_slam/simulator/world.hpp"

namespace hybrid_slam {
namespace {

constexpr std::size_t kMostShapes = 100000;
constexpr int kMostRepeats = 1000;
constexpr double kMaxCoordinate = 1e5;  ///< metres

/// Turns the nodes of one world file into numbers; whatever does not fit is an Error with its line
/// and key.
class WorldFile {
  public:
    explicit WorldFile(const std::filesystem::path& file) : file_(file.string()) {
        constexpr std::size_t kMostBytes = std::size_t{8} * 1024 * 1024;
        const std::string text = read_whole_file(file, kMostBytes);
        try {
            root_ = YAML::Load(text);
        } catch (const YAML::Exception& error) {
            throw Error(fmt::format("{}:{}: {}", file_, error.mark.line + 1, error.msg));
        }
        if (!root_.IsMap()) {
            throw Error(file_ + ":1: no world (must hold lines like 'key: value')");
        }
        check_keys(root_, "world",
                   {"name", "walls", "boxes", "posts", "people", "path", "paths", "laps",
                    "start_heading_deg", "simulator", "drive"});
    }

    World read_world() const;
    /// Sets what the section of that name names, through the config's own list of keys.
    template <typename Config>
    void read_section(const char* name, Config& config) const;

  private:
    [[noreturn]] void fail(const YAML::Node& node, std::string_view key,
                           std::string_view what) const {
        const int line = node.Mark().line < 0 ? 1 : node.Mark().line + 1;
        throw Error(fmt::format("{}:{}: {}: {}", file_, line, key, what));
    }

    void check_keys(const YAML::Node& map, std::string_view key,
                    std::initializer_list<std::string_view> known) const;
    YAML::Node need(const YAML::Node& map, const char* key) const;
    YAML::Node optional_list(const char* key) const;
    double number(const YAML::Node& node, std::string_view key, double most) const;
    double positive(const YAML::Node& node, std::string_view key) const;
    int whole(const YAML::Node& node, std::string_view key, int most) const;
    Point2 pair(const YAML::Node& node, std::string_view key) const;
    Points points(const YAML::Node& node, std::string_view key, std::size_t least) const;
    Points offsets(const YAML::Node& map) const;
    bool is_true(const YAML::Node& map, const char* key) const;

    void add_walls(const YAML::Node& node, World& world) const;
    void add_box(const YAML::Node& node, World& world) const;
    void add_post(const YAML::Node& node, World& world) const;
    void add_person(const YAML::Node& node, World& world) const;
    void add_paths(World& world) const;

    std::string file_;
    YAML::Node root_;
};

void WorldFile::check_keys(const YAML::Node& map, std::string_view key,
                           std::initializer_list<std::string_view> known) const {
    if (!map.IsMap()) {
        fail(map, key, "must be a map");
    }
    std::vector<std::string> met;
    for (const auto& item : map) {
        const std::string name = item.first.IsScalar() ? item.first.Scalar() : "?";
        if (std::find(known.begin(), known.end(), name) == known.end()) {
            fail(item.first, name,
                 fmt::format("unknown key; known here: {}", fmt::join(known, ", ")));
        }
        if (std::find(met.begin(), met.end(), name) != met.end()) {
            fail(item.first, name, "repeated key");
        }
        met.push_back(name);
    }
}

YAML::Node WorldFile::need(const YAML::Node& map, const char* key) const {
    const YAML::Node node = map[key];
    if (!node) {
        fail(map, key, "is missing");
    }
    return node;
}

/// The list of that name at the top; an empty one when the file does not have it.
YAML::Node WorldFile::optional_list(const char* key) const {
    const YAML::Node node = root_[key];
    if (!node || node.IsNull()) {
        return YAML::Node(YAML::NodeType::Sequence);
    }
    if (!node.IsSequence()) {
        fail(node, key, "must be a list");
    }
    return node;
}

double WorldFile::number(const YAML::Node& node, std::string_view key, double most) const {
    double value = 0.0;
    if (!node.IsScalar() || !parse_double(node.Scalar(), value) || !(std::abs(value) <= most)) {
        fail(node, key, fmt::format("must be a number of at most {}", most));
    }
    return value;
}

double WorldFile::positive(const YAML::Node& node, std::string_view key) const {
    const double value = number(node, key, kMaxCoordinate);
    if (!(value > 0.0)) {
        fail(node, key, "must be more than zero");
    }
    return value;
}

int WorldFile::whole(const YAML::Node& node, std::string_view key, int most) const {
    long value = 0;
    if (!node.IsScalar() || !parse_long(node.Scalar(), value) || value < 1 || value > most) {
        fail(node, key, fmt::format("must be a whole number from 1 to {}", most));
    }
    return static_cast<int>(value);
}

Point2 WorldFile::pair(const YAML::Node& node, std::string_view key) const {
    if (!node.IsSequence() || node.size() != 2) {
        fail(node, key, "must be two numbers like [1.0, 2.0]");
    }
    return {number(node[0], key, kMaxCoordinate), number(node[1], key, kMaxCoordinate)};
}

Points WorldFile::points(const YAML::Node& node, std::string_view key, std::size_t least) const {
    if (!node.IsSequence() || node.size() < least) {
        fail(node, key, fmt::format("must be a list of {} or more points like [1.0, 2.0]", least));
    }
    Points result;
    for (const YAML::Node& item : node) {
        result.push_back(pair(item, key));
    }
    return result;
}

/// Where the copies of a shape lie by its `repeat`: one {count, step} or, for a grid, a list of
/// two.
Points WorldFile::offsets(const YAML::Node& map) const {
    Points result{Point2(0.0, 0.0)};
    const YAML::Node repeat = map["repeat"];
    if (!repeat) {
        return result;
    }
    const std::size_t axes = repeat.IsSequence() ? repeat.size() : 1;
    if (axes == 0 || axes > 2) {
        fail(repeat, "repeat", "must be one {count, step} or a list of two");
    }
    for (std::size_t axis = 0; axis < axes; ++axis) {
        const YAML::Node one = repeat.IsSequence() ? repeat[axis] : repeat;
        check_keys(one, "repeat", {"count", "step"});
        const int count = whole(need(one, "count"), "count", kMostRepeats);
        const Point2 step = pair(need(one, "step"), "step");
        const Points before = result;
        for (int i = 1; i < count; ++i) {
            for (const Point2& offset : before) {
                result.push_back(offset + i * step);
            }
        }
        if (result.size() > kMostShapes) {
            fail(repeat, "repeat", "makes too many shapes");
        }
    }
    return result;
}

bool WorldFile::is_true(const YAML::Node& map, const char* key) const {
    const YAML::Node flag = map[key];
    if (flag && (!flag.IsScalar() || (flag.Scalar() != "true" && flag.Scalar() != "false"))) {
        fail(flag, key, "must be true or false");
    }
    return flag && flag.Scalar() == "true";
}

/// A polyline: a plain list of points, or a map of points, closed and repeat.
void WorldFile::add_walls(const YAML::Node& node, World& world) const {
    if (node.IsMap()) {
        check_keys(node, "walls", {"points", "closed", "repeat"});
    }
    const YAML::Node list = node.IsMap() ? need(node, "points") : node;
    Points corners = points(list, "walls", 2);
    if (node.IsMap() && is_true(node, "closed")) {
        corners.push_back(corners.front());
    }
    for (const Point2& offset : node.IsMap() ? offsets(node) : Points{Point2(0.0, 0.0)}) {
        for (std::size_t i = 0; i + 1 < corners.size(); ++i) {
            world.walls.push_back({corners[i] + offset, corners[i + 1] + offset});
        }
    }
}

void WorldFile::add_box(const YAML::Node& node, World& world) const {
    check_keys(node, "boxes", {"center", "size", "yaw_deg", "repeat"});
    const Point2 center = pair(need(node, "center"), "center");
    const YAML::Node size_node = need(node, "size");
    const Point2 half = pair(size_node, "size") / 2.0;
    if (!(half.minCoeff() > 0.0)) {
        fail(size_node, "size", "must be more than zero");
    }
    const YAML::Node yaw = node["yaw_deg"];
    const Pose2d world_from_box(center, yaw ? radians(number(yaw, "yaw_deg", 360.0)) : 0.0);
    const Points corners = transform(world_from_box, {{half.x(), half.y()},
                                                      {-half.x(), half.y()},
                                                      {-half.x(), -half.y()},
                                                      {half.x(), -half.y()}});
    for (const Point2& offset : offsets(node)) {
        for (std::size_t i = 0; i < corners.size(); ++i) {
            world.walls.push_back({corners[i] + offset, corners[(i + 1) % 4] + offset});
        }
    }
}

void WorldFile::add_post(const YAML::Node& node, World& world) const {
    check_keys(node, "posts", {"center", "radius", "repeat"});
    const Point2 center = pair(need(node, "center"), "center");
    const double radius = positive(need(node, "radius"), "radius");
    for (const Point2& offset : offsets(node)) {
        world.posts.push_back({center + offset, radius});
    }
}

void WorldFile::add_person(const YAML::Node& node, World& world) const {
    check_keys(node, "people", {"way", "speed", "radius"});
    Person person;
    person.way = points(need(node, "way"), "way", 2);
    if (const YAML::Node speed = node["speed"]) {
        person.speed = positive(speed, "speed");
    }
    if (const YAML::Node radius = node["radius"]) {
        person.radius = positive(radius, "radius");
    }
    if (std::all_of(person.way.begin(), person.way.end(),
                    [&](const Point2& point) { return point == person.way.front(); })) {
        fail(node, "way", "needs two different points");
    }
    world.people.push_back(std::move(person));
}

void WorldFile::add_paths(World& world) const {
    world.path = points(need(root_, "path"), "path", 2);
    const YAML::Node named = root_["paths"];
    if (!named || named.IsNull()) {
        return;
    }
    if (!named.IsMap()) {
        fail(named, "paths", "must be a map of names and paths");
    }
    for (const auto& item : named) {
        if (!item.first.IsScalar() || item.first.Scalar().empty()) {
            fail(item.first, "paths", "the name of a path must be a word");
        }
        world.paths[item.first.Scalar()] = points(item.second, item.first.Scalar(), 2);
    }
}

World WorldFile::read_world() const {
    World world;
    const YAML::Node name = need(root_, "name");
    if (!name.IsScalar()) {
        fail(name, "name", "must be a word");
    }
    world.name = name.Scalar();
    for (const YAML::Node& node : optional_list("walls")) {
        add_walls(node, world);
    }
    for (const YAML::Node& node : optional_list("boxes")) {
        add_box(node, world);
    }
    for (const YAML::Node& node : optional_list("posts")) {
        add_post(node, world);
    }
    for (const YAML::Node& node : optional_list("people")) {
        add_person(node, world);
    }
    if (world.walls.size() + world.posts.size() + world.people.size() > kMostShapes) {
        throw Error(fmt::format("{}:1: more than {} walls, posts and people", file_, kMostShapes));
    }
    add_paths(world);
    if (const YAML::Node laps = root_["laps"]) {
        world.laps = whole(laps, "laps", kMostRepeats);
    }
    if (const YAML::Node heading = root_["start_heading_deg"]) {
        world.start_heading = radians(number(heading, "start_heading_deg", 360.0));
    }
    return world;
}

/// As on the command line; empty for what is neither a value nor a list of them.
std::optional<std::string> value_text(const YAML::Node& node) {
    if (node.IsScalar()) {
        return node.Scalar();
    }
    if (!node.IsSequence()) {
        return std::nullopt;
    }
    std::vector<std::string> items;
    for (const YAML::Node& item : node) {
        if (!item.IsScalar()) {
            return std::nullopt;
        }
        items.push_back(item.Scalar());
    }
    return fmt::format("[{}]", fmt::join(items, ", "));
}

template <typename Config>
void WorldFile::read_section(const char* name, Config& config) const {
    const YAML::Node section = root_[name];
    if (!section || section.IsNull()) {
        return;
    }
    if (!section.IsMap()) {
        fail(section, name, "must be a map");
    }
    ConfigSchema schema;
    const ConfigSchema::Section prefix(schema, name);
    describe(schema, config);
    std::vector<std::string> met;
    for (const auto& item : section) {
        const std::optional<std::string> value = value_text(item.second);
        if (!item.first.IsScalar() || !value) {
            fail(item.first, name, "must hold lines like 'key: value'");
        }
        if (std::find(met.begin(), met.end(), item.first.Scalar()) != met.end()) {
            fail(item.first, item.first.Scalar(), "repeated key");
        }
        met.push_back(item.first.Scalar());
        try {
            schema.override_with(std::string(name) + "." + item.first.Scalar() + "=" + *value);
        } catch (const Error& error) {
            throw Error(fmt::format("{}:{}: {}", file_, item.first.Mark().line + 1, error.what()));
        }
    }
}

}  // namespace

World read_world(const std::filesystem::path& file) {
    WorldFile world_file(file);
    // So that a mistake in a section does not wait for what uses it.
    SimulatorConfig checked_simulator;
    world_file.read_section("simulator", checked_simulator);
    SimulatedDriveConfig checked_drive;
    world_file.read_section("drive", checked_drive);
    return world_file.read_world();
}

void read_simulator_section(const std::filesystem::path& world_file, SimulatorConfig& config) {
    WorldFile(world_file).read_section("simulator", config);
}

void read_drive_section(const std::filesystem::path& world_file, SimulatedDriveConfig& config) {
    WorldFile(world_file).read_section("drive", config);
}

}  // namespace hybrid_slam
