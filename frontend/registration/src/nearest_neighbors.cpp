// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/registration/nearest_neighbors.hpp"

#include <flann/flann.hpp>

#include <utility>

#include "hybrid_slam/core/error.hpp"

namespace hybrid_slam {

namespace {

// Measured on scans of 180 to 5000 points: leaves of 10 give the best sum of building and asking.
constexpr int kLeafSize = 10;

// FLANN's matrices are never written through, but take no pointer to const.
flann::Matrix<double> view(const Points& points) {
    return {const_cast<double*>(points.data()->data()),  // NOLINT(*-const-cast)
            points.size(), 2};
}

flann::SearchParams exact_search() {
    flann::SearchParams params(flann::FLANN_CHECKS_UNLIMITED, 0.0F, true);
    params.cores = 1;
    return params;
}

}  // namespace

struct NearestNeighbors::Tree {
    explicit Tree(Points points_in)
        : points(std::move(points_in)),
          index(view(points), flann::KDTreeSingleIndexParams(kLeafSize, /*reorder=*/false)) {
        index.buildIndex();
    }
    Points points;
    flann::KDTreeSingleIndex<flann::L2_Simple<double>> index;
};

NearestNeighbors::NearestNeighbors(const Points& points) {
    if (points.empty()) {
        throw Error("nearest neighbours: no points to search in");
    }
    tree_ = std::make_unique<Tree>(points);
}

NearestNeighbors::~NearestNeighbors() = default;
NearestNeighbors::NearestNeighbors(NearestNeighbors&&) noexcept = default;
NearestNeighbors& NearestNeighbors::operator=(NearestNeighbors&&) noexcept = default;

void NearestNeighbors::find(const Points& queries, Answer& answer) const {
    answer.indices.resize(queries.size());
    answer.squared_distances.resize(queries.size());
    if (queries.empty()) {
        return;
    }
    static const flann::SearchParams kParams = exact_search();
    flann::Matrix<std::size_t> indices(answer.indices.data(), queries.size(), 1);
    flann::Matrix<double> distances(answer.squared_distances.data(), queries.size(), 1);
    tree_->index.knnSearch(view(queries), indices, distances, 1, kParams);
}

}  // namespace hybrid_slam
