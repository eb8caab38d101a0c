// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/backend/likelihood_pyramid.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "hybrid_slam/core/error.hpp"

namespace hybrid_slam {
namespace {

constexpr double kFull = 255.0;
constexpr double kSearchResolution = 0.1;  // metres
constexpr double kSearchSigma = 0.1;       // metres
constexpr double kBlocksAcross = 8.0;
constexpr double kMostSearchCells = 1 << 24;  // of one level; 128 MB for all
constexpr int kMostSearchLevels = 8;

struct Corners {
    Point2 lower;
    Point2 upper;
};

Corners corners_of(const Points& points) {
    if (points.empty()) {
        throw Error("likelihood pyramid: needs points");
    }
    Corners corners{points.front(), points.front()};
    for (const Point2& point : points) {
        corners.lower = corners.lower.cwiseMin(point);
        corners.upper = corners.upper.cwiseMax(point);
    }
    return corners;
}

int radius_of(double resolution, double sigma) {
    return static_cast<int>(std::ceil(2.5 * sigma / resolution));
}

// Stamps the blur around one point, keeping the larger value where stamps overlap.
class BlurStamp {
  public:
    BlurStamp(double resolution, double sigma) : radius_(radius_of(resolution, sigma)) {
        for (int y = -radius_; y <= radius_; ++y) {
            for (int x = -radius_; x <= radius_; ++x) {
                const double squared = resolution * resolution * (x * x + y * y);
                values_.push_back(static_cast<std::uint8_t>(
                    std::lround(kFull * std::exp(-0.5 * squared / (sigma * sigma)))));
            }
        }
    }

    int radius() const { return radius_; }

    void apply(std::vector<std::uint8_t>& grid, const GridGeometry& geometry, Cell cell) const {
        const auto side = 2 * static_cast<std::size_t>(radius_) + 1;
        for (std::size_t row = 0; row < side; ++row) {
            std::uint8_t* out = grid.data() +
                                geometry.index_of({cell.x - radius_, cell.y - radius_}) +
                                row * static_cast<std::size_t>(geometry.width);
            const std::uint8_t* in = values_.data() + row * side;
            for (std::size_t i = 0; i < side; ++i) {
                out[i] = std::max(out[i], in[i]);
            }
        }
    }

  private:
    int radius_;
    std::vector<std::uint8_t> values_;
};

// The empty rim below and left is as wide as the largest block, so that a block that starts outside
// of the grid holds nothing but rim.
int rim_of(int levels) {
    return 1 << (levels - 1);
}

double margin_of(double resolution, int radius, int levels) {
    return resolution * (radius + rim_of(levels) + 1);
}

bool is_affordable(const Corners& corners, double resolution, int radius, int levels) {
    const double margin = margin_of(resolution, radius, levels);
    const Point2 size =
        (corners.upper - corners.lower + Point2::Constant(2.0 * margin)) / resolution;
    return !((size.x() + 2.0) * (size.y() + 2.0) > kMostSearchCells);  // NaN is told later
}

std::size_t cells_of(const GridGeometry& geometry) {
    return static_cast<std::size_t>(geometry.width) * static_cast<std::size_t>(geometry.height);
}

bool has_empty_rim(const std::vector<std::uint8_t>& finest, const GridGeometry& geometry,
                   int levels) {
    const int rim = rim_of(levels) - 1;
    for (int y = 0; y < geometry.height; ++y) {
        const auto row = finest.begin() + static_cast<std::ptrdiff_t>(geometry.index_of({0, y}));
        const int end = y < rim ? geometry.width : std::min(rim, geometry.width);
        if (std::any_of(row, row + end, [](std::uint8_t value) { return value > 0; })) {
            return false;
        }
    }
    return true;
}

// Maximum over blocks twice as large, from the maximum over the smaller ones.
std::vector<std::uint8_t> doubled(const std::vector<std::uint8_t>& grid,
                                  const GridGeometry& geometry, int step) {
    std::vector<std::uint8_t> result(grid);
    const auto width = static_cast<std::size_t>(geometry.width);
    const auto shift = static_cast<std::size_t>(step);
    for (std::size_t y = 0; y < static_cast<std::size_t>(geometry.height); ++y) {
        std::uint8_t* out = result.data() + y * width;
        const std::uint8_t* in = grid.data() + y * width;
        for (std::size_t x = 0; x + shift < width; ++x) {
            out[x] = std::max(in[x], in[x + shift]);
        }
    }
    for (std::size_t y = 0; y + shift < static_cast<std::size_t>(geometry.height); ++y) {
        std::uint8_t* out = result.data() + y * width;
        const std::uint8_t* above = result.data() + (y + shift) * width;
        for (std::size_t x = 0; x < width; ++x) {
            out[x] = std::max(out[x], above[x]);
        }
    }
    return result;
}

void expect_levels(int levels) {
    if (levels < 1 || levels > LikelihoodPyramid::kMostLevels) {
        throw Error("likelihood pyramid: needs 1 to 12 levels");
    }
}

}  // namespace

LikelihoodPyramid::LikelihoodPyramid(const Points& reference, double resolution, double sigma,
                                     int levels) {
    expect_levels(levels);
    const auto [lower, upper] = corners_of(reference);
    const BlurStamp stamp(resolution, sigma);
    geometry_ = GridGeometry::around(lower, upper, resolution,
                                     margin_of(resolution, stamp.radius(), levels));
    grids_.emplace_back(cells_of(geometry_), std::uint8_t{0});
    for (const Point2& point : reference) {
        stamp.apply(grids_.front(), geometry_, geometry_.cell_of(point));
    }
    build_up(levels);
}

LikelihoodPyramid::LikelihoodPyramid(const GridGeometry& geometry, std::vector<std::uint8_t> finest,
                                     int levels)
    : geometry_(geometry) {
    expect_levels(levels);
    if (geometry.width < 1 || geometry.height < 1 || finest.size() != cells_of(geometry)) {
        throw Error("likelihood pyramid: its cells are not those of its geometry");
    }
    if (!has_empty_rim(finest, geometry, levels)) {
        throw Error("likelihood pyramid: its rim is not as empty as its levels need it");
    }
    grids_.push_back(std::move(finest));
    build_up(levels);
}

void LikelihoodPyramid::build_up(int levels) {
    for (int level = 1; level < levels; ++level) {
        grids_.push_back(doubled(grids_.back(), geometry_, 1 << (level - 1)));
    }
}

LikelihoodPyramid search_pyramid(const Points& walls) {
    const Corners corners = corners_of(walls);
    const double across = (corners.upper - corners.lower).maxCoeff() / kBlocksAcross;
    for (double coarser = 1.0;; coarser *= 2.0) {
        const double resolution = coarser * kSearchResolution;
        const double sigma = coarser * kSearchSigma;
        int levels = 1;
        while (levels < kMostSearchLevels && resolution * rim_of(levels) < across) {
            ++levels;
        }
        if (is_affordable(corners, resolution, radius_of(resolution, sigma), levels)) {
            return {walls, resolution, sigma, levels};
        }
    }
}

}  // namespace hybrid_slam
