// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "hybrid_slam/core/occupancy_grid.hpp"

namespace hybrid_slam {

/// How likely a beam ends in each cell, blurred around reference points, and for every level L its
/// maximum over the 2^L x 2^L cells up and right of a cell: an upper bound for a whole block of
/// translations (Olson 2009; Hess et al. 2016).
class LikelihoodPyramid {
  public:
    /// `sigma` (metres) is the width of the Gaussian blur. Throws Error when there are no points or
    /// the area is absurdly large.
    LikelihoodPyramid(const Points& reference, double resolution, double sigma, int levels);

    /// Of a finest level made before, row by row from the bottom. Throws Error when it has another
    /// number of cells than the geometry, or when its first 2^(levels-1) - 1 columns and rows are
    /// not all 0: the levels would be no bounds for blocks that hang over that edge.
    LikelihoodPyramid(const GridGeometry& geometry, std::vector<std::uint8_t> finest, int levels);

    static constexpr int kMostLevels = 12;
    int levels() const { return static_cast<int>(grids_.size()); }
    const GridGeometry& geometry() const { return geometry_; }

    const std::vector<std::uint8_t>& finest() const { return grids_.front(); }

    /// All cells of a level, row by row, for those who look up many.
    const std::vector<std::uint8_t>& cells(int level) const {
        return grids_[static_cast<std::size_t>(level)];
    }

    /// 0 to 255; 0 outside of the grid, where a block reaches at most into the empty rim.
    std::uint8_t at(int level, int x, int y) const {
        if (x < 0 || y < 0 || x >= geometry_.width || y >= geometry_.height) {
            return 0;
        }
        return grids_[static_cast<std::size_t>(level)]
                     [static_cast<std::size_t>(y) * static_cast<std::size_t>(geometry_.width) +
                      static_cast<std::size_t>(x)];
    }

  private:
    void build_up(int levels);

    GridGeometry geometry_;
    std::vector<std::vector<std::uint8_t>> grids_;
};

/// The one to search a whole map by: 10 cm cells and blur, and levels until the largest block is an
/// eighth of the map, but at most eight. Coarser where that would be over 2^24 cells. Throws Error
/// as above.
LikelihoodPyramid search_pyramid(const Points& walls);

}  // namespace hybrid_slam
