// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/registration/nearest_neighbors.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <utility>

#include "support/error_of.hpp"
#include "support/room.hpp"

namespace hybrid_slam::test {
namespace {

double nearest_by_force(const Points& points, const Point2& query) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const Point2& point : points) {
        nearest = std::min(nearest, (point - query).squaredNorm());
    }
    return nearest;
}

// Where several points are equally near, any of them is right: distances are compared, not indices.
void expect_exact(const Points& points, const Points& queries) {
    NearestNeighbors::Answer answer;
    NearestNeighbors(points).find(queries, answer);
    ASSERT_EQ(answer.indices.size(), queries.size());
    ASSERT_EQ(answer.squared_distances.size(), queries.size());
    for (std::size_t i = 0; i < queries.size(); ++i) {
        ASSERT_LT(answer.indices[i], points.size());
        const double found = (points[answer.indices[i]] - queries[i]).squaredNorm();
        const double exact = nearest_by_force(points, queries[i]);
        ASSERT_DOUBLE_EQ(found, exact) << "query " << i;
        ASSERT_DOUBLE_EQ(answer.squared_distances[i], exact) << "query " << i;
    }
}

Points random_points(Rng& rng, std::size_t count, double half_width) {
    Points points;
    for (std::size_t i = 0; i < count; ++i) {
        const double x = uniform(rng, -half_width, half_width);
        points.emplace_back(x, uniform(rng, -half_width, half_width));
    }
    return points;
}

TEST(NearestNeighbors, AreThoseOfBruteForceForRandomPoints) {
    Rng rng(11);
    for (const std::size_t count : {1U, 2U, 9U, 10U, 11U, 100U, 3000U}) {
        expect_exact(random_points(rng, count, 10.0), random_points(rng, 500, 15.0));
    }
}

TEST(NearestNeighbors, AreThoseOfBruteForceOnALattice) {
    // Queries half way between lattice points tie between two or four of them.
    Points lattice;
    Points queries;
    for (int x = 0; x < 20; ++x) {
        for (int y = 0; y < 20; ++y) {
            lattice.emplace_back(x, y);
            queries.emplace_back(x + 0.5, y + 0.5);
            queries.emplace_back(x, y + 0.5);
            queries.emplace_back(x, y);
        }
    }
    expect_exact(lattice, queries);
}

TEST(NearestNeighbors, TakeRepeatedAndCollinearPoints) {
    Rng rng(12);
    expect_exact(Points(100, Point2(1.0, 2.0)), random_points(rng, 50, 5.0));
    Points line;
    for (int i = 0; i < 200; ++i) {
        line.emplace_back(0.1 * (i / 2), 3.0);
    }
    expect_exact(line, random_points(rng, 200, 20.0));
}

TEST(NearestNeighbors, AreThoseOfBruteForceForARealScanFarFromTheOrigin) {
    const Scan scan = scan_at(irregular_room(), {0.3, -0.2, 0.4});
    const Pose2d far(12345.0, -54321.0, 2.0);
    const Points points = surface_of(scan).points;
    expect_exact(transform(far, points), transform(far * Pose2d(0.2, 0.1, 0.1), points));
}

TEST(NearestNeighbors, KeepTheirOwnCopyAndOutliveAMove) {
    Points points{{0.0, 0.0}, {1.0, 0.0}, {5.0, 5.0}};
    NearestNeighbors first(points);
    points.assign(3, Point2(100.0, 100.0));
    NearestNeighbors second({{9.0, 9.0}});
    second = std::move(first);
    NearestNeighbors third(std::move(second));
    NearestNeighbors::Answer answer;
    third.find({{0.9, 0.1}, {4.0, 4.0}}, answer);
    EXPECT_EQ(answer.indices, (std::vector<std::size_t>{1, 2}));
}

TEST(NearestNeighbors, ReuseAnAnswerOfAnotherSize) {
    const NearestNeighbors neighbors({{0.0, 0.0}, {1.0, 0.0}});
    NearestNeighbors::Answer answer;
    neighbors.find({{0.1, 0.0}, {0.9, 0.0}, {2.0, 0.0}}, answer);
    EXPECT_EQ(answer.indices, (std::vector<std::size_t>{0, 1, 1}));
    neighbors.find({}, answer);
    EXPECT_TRUE(answer.indices.empty());
    EXPECT_TRUE(answer.squared_distances.empty());
    neighbors.find({{0.9, 0.0}}, answer);
    EXPECT_EQ(answer.indices, (std::vector<std::size_t>{1}));
}

TEST(NearestNeighbors, RefuseToSearchInNothing) {
    EXPECT_NE(error_of([] { NearestNeighbors{Points{}}; }), "");
}

}  // namespace
}  // namespace hybrid_slam::test
