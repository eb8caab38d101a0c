// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "hybrid_slam/core/points.hpp"

namespace hybrid_slam {

/// Exact nearest neighbours in a fixed set of points, by a k-d tree (FLANN; thesis
/// section 3.5.2.1). Build it once per reference and ask often.
class NearestNeighbors {
  public:
    /// Keeps a copy of the points. Throws Error when there are none.
    explicit NearestNeighbors(const Points& points);
    ~NearestNeighbors();
    NearestNeighbors(NearestNeighbors&&) noexcept;
    NearestNeighbors& operator=(NearestNeighbors&&) noexcept;

    struct Answer {
        std::vector<std::size_t> indices;       ///< into the points given at construction
        std::vector<double> squared_distances;  ///< m2
    };

    /// The nearest point to each query; `answer` is resized (and reused between calls).
    void find(const Points& queries, Answer& answer) const;

  private:
    struct Tree;
    std::unique_ptr<Tree> tree_;
};

}  // namespace hybrid_slam
