// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/vehicle/clearance.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "hybrid_slam/core/error.hpp"

namespace hybrid_slam {
namespace {

/// Lower envelope of the parabolas height[i] + (x - i - 0.5)^2 (Felzenszwalb and Huttenlocher
/// 2012). The vertices stand on the edges between cells, since it is the edges of a blocked cell
/// that are near.
class Envelope {
  public:
    explicit Envelope(std::size_t size) : vertices_(size), from_(size) {}

    void build(const std::vector<double>& heights) {
        count_ = 0;
        for (std::size_t i = 0; i < heights.size(); ++i) {
            add(heights, i);
        }
    }

    /// The envelope at 0, 1, 2..., to be asked for in rising order of x.
    double at(const std::vector<double>& heights, double x, std::size_t& cursor) const {
        while (cursor + 1 < count_ && from_[cursor + 1] <= x) {
            ++cursor;
        }
        const double away = x - position(vertices_[cursor]);
        return heights[vertices_[cursor]] + away * away;
    }

  private:
    static double position(std::size_t vertex) { return static_cast<double>(vertex) - 0.5; }

    void add(const std::vector<double>& heights, std::size_t vertex) {
        double meet = -std::numeric_limits<double>::infinity();
        while (count_ > 0) {
            const std::size_t last = vertices_[count_ - 1];
            const double p = position(vertex);
            const double q = position(last);
            meet = (heights[vertex] + p * p - heights[last] - q * q) / (2.0 * (p - q));
            if (meet > from_[count_ - 1]) {
                break;
            }
            --count_;
            meet = -std::numeric_limits<double>::infinity();
        }
        vertices_[count_] = vertex;
        from_[count_] = meet;
        ++count_;
    }

    std::vector<std::size_t> vertices_;
    std::vector<double> from_;  ///< x from which each vertex's parabola is the lowest
    std::size_t count_ = 0;
};

/// In cells, from the middle of each cell of a column to the nearest edge of a blocked cell in it;
/// the ends of the column are such edges.
void column_distances(const StateGrid& grid, int x, std::vector<double>& distances) {
    const int height = grid.geometry.height;
    double below = 0.5;
    for (int y = 0; y < height; ++y) {
        const bool is_free = grid.at({x, y}) == CellState::kFree;
        distances[grid.geometry.index_of({x, y})] = is_free ? below : 0.0;
        below = is_free ? below + 1.0 : 0.5;
    }
    double above = 0.5;
    for (int y = height - 1; y >= 0; --y) {
        double& distance = distances[grid.geometry.index_of({x, y})];
        distance = std::min(distance, above);
        above = distance == 0.0 ? 0.5 : above + 1.0;
    }
}

/// Squared distance to the nearest edge, for the cells of one row: edge i is left of cell i.
void row_distances(std::vector<double>& row, Envelope& envelope, std::vector<double>& edges) {
    edges.front() = 0.0;
    edges.back() = 0.0;
    for (std::size_t x = 1; x < row.size(); ++x) {
        const double nearer = std::min(row[x - 1], row[x]);
        edges[x] = nearer * nearer;
    }
    envelope.build(edges);
    std::size_t cursor = 0;
    for (std::size_t x = 0; x < row.size(); ++x) {
        row[x] = std::min(row[x] * row[x], envelope.at(edges, static_cast<double>(x), cursor));
    }
}

std::vector<float> edge_distances(const StateGrid& grid) {
    std::vector<double> distances(grid.states.size());
    for (int x = 0; x < grid.geometry.width; ++x) {
        column_distances(grid, x, distances);
    }
    const auto width = static_cast<std::size_t>(grid.geometry.width);
    std::vector<float> metres(distances.size());
    std::vector<double> row(width);
    std::vector<double> edges(width + 1);
    Envelope envelope(width + 1);
    for (std::size_t first = 0; first < distances.size(); first += width) {
        std::copy_n(distances.begin() + static_cast<std::ptrdiff_t>(first), width, row.begin());
        row_distances(row, envelope, edges);
        for (std::size_t x = 0; x < width; ++x) {
            metres[first + x] = static_cast<float>(std::sqrt(row[x]) * grid.geometry.resolution);
        }
    }
    return metres;
}

/// A rectangle around `center`, along the robot's axes; metres, half of its sides.
struct Piece {
    Point2 center;  ///< in the robot's frame
    double half_length = 0.0;
    double half_width = 0.0;
};

/// Tests a rectangle by its circumscribed circle, and its halves where that does not tell.
class RectangleTest {
  public:
    RectangleTest(const ClearanceField& field, const Pose2d& map_from_robot, double margin)
        : field_(field),
          map_from_robot_(map_from_robot),
          margin_(margin),
          smallest_(0.25 * field.geometry().resolution) {}

    bool is_clear(const Piece& piece) const {
        const double clearance = field_.at(map_from_robot_ * piece.center) - margin_;
        const double around = std::hypot(piece.half_length, piece.half_width);
        if (clearance > around) {
            return true;
        }
        if (around < smallest_ || blocked_for_certain(piece, clearance)) {
            return false;
        }
        Piece first = piece;
        Piece second = piece;
        if (piece.half_length >= piece.half_width) {
            first.half_length = second.half_length = piece.half_length / 2.0;
            first.center.x() -= first.half_length;
            second.center.x() += first.half_length;
        } else {
            first.half_width = second.half_width = piece.half_width / 2.0;
            first.center.y() -= first.half_width;
            second.center.y() += first.half_width;
        }
        return is_clear(first) && is_clear(second);
    }

  private:
    /// The field says at most sqrt(2) cells too little: something within the inscribed circle
    /// cannot be cleared by looking closer.
    bool blocked_for_certain(const Piece& piece, double clearance) const {
        const double inscribed = std::min(piece.half_length, piece.half_width);
        return clearance + std::sqrt(2.0) * field_.geometry().resolution < inscribed;
    }

    const ClearanceField& field_;
    Pose2d map_from_robot_;
    double margin_;
    double smallest_;
};

}  // namespace

ClearanceField::ClearanceField(const StateGrid& grid)
    : geometry_(grid.geometry),
      grid_from_map_(Pose2d(grid.geometry.origin, grid.origin_yaw).inverse()) {
    const bool fits = geometry_.width > 0 && geometry_.height > 0 &&
                      std::isfinite(geometry_.resolution) && geometry_.resolution > 0.0 &&
                      grid.states.size() == static_cast<std::size_t>(geometry_.width) *
                                                static_cast<std::size_t>(geometry_.height);
    if (!fits) {
        throw Error("grid to drive in: its states do not fit its size");
    }
    distances_ = edge_distances(grid);
}

double ClearanceField::at(const Point2& point) const {
    const Point2 local = (grid_from_map_ * point) / geometry_.resolution;
    // Put so that NaN is outside.
    if (!(local.x() >= 0.0 && local.y() >= 0.0 && local.x() < geometry_.width &&
          local.y() < geometry_.height)) {
        return -geometry_.resolution;
    }
    const Cell cell{static_cast<int>(local.x()), static_cast<int>(local.y())};
    const Point2 middle(cell.x + 0.5, cell.y + 0.5);
    return static_cast<double>(distances_[geometry_.index_of(cell)]) -
           (local - middle).norm() * geometry_.resolution;
}

bool footprint_is_clear(const ClearanceField& field, const VehicleConfig& vehicle,
                        const Pose2d& map_from_robot, double margin) {
    Piece whole;
    whole.center = Point2((vehicle.footprint_front - vehicle.footprint_rear) / 2.0, 0.0);
    whole.half_length = (vehicle.footprint_front + vehicle.footprint_rear) / 2.0;
    whole.half_width = vehicle.footprint_width / 2.0;
    return RectangleTest(field, map_from_robot, margin).is_clear(whole);
}

double footprint_clearance(const ClearanceField& field, const VehicleConfig& vehicle,
                           const Pose2d& map_from_robot, double most, double tolerance) {
    if (footprint_is_clear(field, vehicle, map_from_robot, most)) {
        return most;
    }
    double clear = 0.0;
    double blocked = most;
    while (blocked - clear > tolerance) {
        const double middle = (clear + blocked) / 2.0;
        (footprint_is_clear(field, vehicle, map_from_robot, middle) ? clear : blocked) = middle;
    }
    return clear;
}

}  // namespace hybrid_slam
