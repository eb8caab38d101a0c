// SPDX-License-Identifier: Apache-2.0
#include "map_files.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "hybrid_slam/backend/g2o.hpp"
#include "hybrid_slam/backend/map_folder.hpp"
#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/text_file.hpp"

namespace hybrid_slam {
namespace {

constexpr std::string_view kMagic = "HSKEYFRM";
constexpr std::uint32_t kKeyframesVersion = 1;
constexpr std::size_t kKeyframeBytes = 8 * sizeof(double) + sizeof(std::uint32_t);
constexpr std::size_t kPointBytes = 4 * sizeof(float);  // with its normal
constexpr std::size_t kMostBytes = std::size_t{1} << 32U;
constexpr double kMargin = 0.5;  ///< metres of unknown around what was seen
constexpr double kMostCells = 1 << 25;

static_assert(std::numeric_limits<float>::is_iec559 && std::numeric_limits<double>::is_iec559);

/// Little-endian on every machine.
class ByteWriter {
  public:
    explicit ByteWriter(std::string file) : file_(std::move(file)) {}

    void put_text(std::string_view text) { bytes_ += text; }

    void put_count(std::size_t count) {
        if (count > std::numeric_limits<std::uint32_t>::max()) {
            throw Error(fmt::format("{}: {} is too many for this format", file_, count));
        }
        put_bits(static_cast<std::uint32_t>(count));
    }

    void put_double(double value) {
        expect_finite(value);
        std::uint64_t bits = 0;
        std::memcpy(&bits, &value, sizeof(bits));
        put_bits(bits);
    }

    void put_pose(const Pose2d& pose) {
        put_double(pose.x());
        put_double(pose.y());
        put_double(pose.heading);
    }

    void put_floats(const Points& points) {
        for (const Point2& point : points) {
            put_float(point.x());
            put_float(point.y());
        }
    }

    const std::string& bytes() const { return bytes_; }

  private:
    template <typename Bits>
    void put_bits(Bits bits) {
        for (std::size_t i = 0; i < sizeof(Bits); ++i) {
            bytes_ += static_cast<char>(static_cast<unsigned char>(bits >> (8U * i)));
        }
    }

    void put_float(double value) {
        // Beyond the range of float the conversion is undefined.
        expect_finite(std::abs(value) <= std::numeric_limits<float>::max() ? value : NAN);
        const auto rounded = static_cast<float>(value);
        std::uint32_t bits = 0;
        std::memcpy(&bits, &rounded, sizeof(bits));
        put_bits(bits);
    }

    void expect_finite(double value) const {
        if (!std::isfinite(value)) {
            throw Error(file_ + ": a keyframe holds a number that is not finite");
        }
    }

    std::string file_;
    std::string bytes_;
};

/// Trusts no count before it has been held against the bytes that are left.
class ByteReader {
  public:
    explicit ByteReader(const std::filesystem::path& file)
        : file_(file.string()), bytes_(read_whole_file(file, kMostBytes)) {}

    [[noreturn]] void fail(const std::string& why) const { throw Error(file_ + ": " + why); }

    std::size_t left() const { return bytes_.size() - at_; }

    std::string_view text(std::size_t size) {
        expect_left(size);
        const std::string_view found = std::string_view(bytes_).substr(at_, size);
        at_ += size;
        return found;
    }

    std::uint32_t number() { return bits<std::uint32_t>(); }

    /// A number of records of at least that many bytes each.
    std::size_t count(std::size_t record_bytes) {
        const std::size_t records = number();
        if (records > left() / record_bytes) {
            fail(
                fmt::format("damaged: {} records cannot be in the {} bytes left", records, left()));
        }
        return records;
    }

    double real() {
        const auto pattern = bits<std::uint64_t>();
        double value = 0.0;
        std::memcpy(&value, &pattern, sizeof(value));
        return finite(value);
    }

    Pose2d pose() {
        const double x = real();
        const double y = real();
        return {x, y, real()};
    }

    Points points(std::size_t count) {
        Points points(count);
        for (Point2& point : points) {
            const double x = small_real();
            point = {x, small_real()};
        }
        return points;
    }

  private:
    void expect_left(std::size_t size) const {
        if (left() < size) {
            fail("damaged: it ends too early");
        }
    }

    template <typename Bits>
    Bits bits() {
        const std::string_view raw = text(sizeof(Bits));
        Bits value = 0;
        for (std::size_t i = 0; i < sizeof(Bits); ++i) {
            value |= static_cast<Bits>(static_cast<unsigned char>(raw[i])) << (8U * i);
        }
        return value;
    }

    double small_real() {
        const auto pattern = bits<std::uint32_t>();
        float value = 0.0F;
        std::memcpy(&value, &pattern, sizeof(value));
        return finite(static_cast<double>(value));
    }

    double finite(double value) const {
        if (!std::isfinite(value)) {
            fail("damaged: it holds a number that is not finite");
        }
        return value;
    }

    std::string file_;
    std::string bytes_;
    std::size_t at_ = 0;
};

Keyframe read_keyframe(ByteReader& reader) {
    Keyframe keyframe;
    keyframe.stamp = reader.real();
    keyframe.path = reader.real();
    keyframe.local_from_robot = reader.pose();
    keyframe.robot_from_laser = reader.pose();
    const std::size_t points = reader.count(kPointBytes);
    keyframe.surface.points = reader.points(points);
    keyframe.surface.normals = reader.points(points);
    return keyframe;
}

struct Bounds {
    void include(const Point2& point) {
        if (point.allFinite()) {
            lower = lower.cwiseMin(point);
            upper = upper.cwiseMax(point);
        }
    }
    Point2 lower{INFINITY, INFINITY};
    Point2 upper{-INFINITY, -INFINITY};
};

/// Of everything seen and of the way: not empty even when the lidar was blind.
Bounds bounds_of(const Keyframes& keyframes, const PoseGraph& graph) {
    expect_keyframe_per_node(keyframes, graph);
    if (keyframes.empty()) {
        throw Error("map: there is no keyframe to draw");
    }
    Bounds bounds;
    for (std::size_t i = 0; i < keyframes.size(); ++i) {
        const Pose2d& map_from_robot = graph.nodes[i];
        bounds.include(map_from_robot.translation);
        bounds.include(map_from_robot * keyframes[i].robot_from_laser.translation);
        for (const Point2& point : transform(map_from_robot, keyframes[i].surface.points)) {
            bounds.include(point);
        }
    }
    return bounds;
}

void write_points(const std::filesystem::path& file, const Points& points) {
    fmt::memory_buffer text;
    fmt::format_to(std::back_inserter(text),
                   "ply\nformat ascii 1.0\ncomment hybrid_slam point map, metres\n"
                   "element vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
                   "end_header\n",
                   points.size());
    for (const Point2& point : points) {
        fmt::format_to(std::back_inserter(text), "{:.4f} {:.4f} 0\n", point.x(), point.y());
    }
    TextFileWriter writer(file);
    writer.write({text.data(), text.size()});
    writer.close();
}

}  // namespace

void expect_keyframe_per_node(const Keyframes& keyframes, const PoseGraph& graph) {
    if (keyframes.size() != graph.nodes.size()) {
        throw Error(fmt::format("map: {} keyframes do not go with a graph of {} nodes",
                                keyframes.size(), graph.nodes.size()));
    }
}

void write_keyframes(const std::filesystem::path& file, const Keyframes& keyframes) {
    ByteWriter out(file.string());
    out.put_text(kMagic);
    out.put_count(kKeyframesVersion);
    out.put_count(keyframes.size());
    for (const Keyframe& keyframe : keyframes) {
        const Surface& surface = keyframe.surface;
        if (surface.normals.size() != surface.points.size()) {
            throw Error(fmt::format("{}: a keyframe has {} points but {} normals", file.string(),
                                    surface.points.size(), surface.normals.size()));
        }
        out.put_double(keyframe.stamp);
        out.put_double(keyframe.path);
        out.put_pose(keyframe.local_from_robot);
        out.put_pose(keyframe.robot_from_laser);
        out.put_count(surface.size());
        out.put_floats(surface.points);
        out.put_floats(surface.normals);
    }
    TextFileWriter writer(file);
    writer.write(out.bytes());
    writer.close();
}

Keyframes read_keyframes(const std::filesystem::path& file) {
    ByteReader reader(file);
    if (reader.left() < kMagic.size() || reader.text(kMagic.size()) != kMagic) {
        reader.fail("is no file of keyframes");
    }
    if (const std::uint32_t version = reader.number(); version != kKeyframesVersion) {
        reader.fail(fmt::format("keyframes of version {}, but only version {} can be read", version,
                                kKeyframesVersion));
    }
    Keyframes keyframes(reader.count(kKeyframeBytes));
    for (Keyframe& keyframe : keyframes) {
        keyframe = read_keyframe(reader);
    }
    if (reader.left() > 0) {
        reader.fail(fmt::format("damaged: {} bytes too many", reader.left()));
    }
    return keyframes;
}

OccupancyGrid draw_grid(const Keyframes& keyframes, const PoseGraph& graph,
                        const OccupancyGridConfig& config) {
    const Bounds bounds = bounds_of(keyframes, graph);
    OccupancyGridConfig affordable = config;
    const Point2 extent = bounds.upper - bounds.lower + Point2::Constant(2.0 * kMargin);
    while (extent.x() * extent.y() > kMostCells * affordable.resolution * affordable.resolution) {
        affordable.resolution *= 2.0;
    }
    OccupancyGrid grid(
        GridGeometry::around(bounds.lower, bounds.upper, affordable.resolution, kMargin),
        affordable);
    for (std::size_t i = 0; i < keyframes.size(); ++i) {
        const Pose2d& map_from_robot = graph.nodes[i];
        grid.insert(map_from_robot * keyframes[i].robot_from_laser.translation,
                    transform(map_from_robot, keyframes[i].surface.points));
    }
    return grid;
}

void write_map(const std::filesystem::path& folder, const SlamMap& map,
               const OccupancyGridConfig& grid_config) {
    const Bounds bounds = bounds_of(map.keyframes, map.graph);
    if (map.trajectory.empty()) {
        throw Error("map: there is no trajectory to write");
    }
    write_keyframes(folder / "keyframes.bin", map.keyframes);
    write_g2o(folder / "graph.g2o", map.graph);
    write_tum(folder / "trajectory.tum", map.trajectory);
    write_tum(folder / "odometry.tum", map.odometry_trajectory);
    write_map_server(folder / "map.yaml",
                     to_states(draw_grid(map.keyframes, map.graph, grid_config)));
    write_points(folder / "points.ply",
                 draw_points(map.keyframes, map.graph, grid_config.resolution));
    write_manifest(folder, {{"counts",
                             {{"keyframes", map.keyframes.size()},
                              {"edges", map.graph.edges.size()},
                              {"scans", map.trajectory.size()}}},
                            {"bounds",
                             {{"lower", {bounds.lower.x(), bounds.lower.y()}},
                              {"upper", {bounds.upper.x(), bounds.upper.y()}}}}});
}

}  // namespace hybrid_slam
