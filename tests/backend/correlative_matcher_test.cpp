// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/backend/correlative_matcher.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "support/error_of.hpp"
#include "support/pose_matchers.hpp"
#include "support/room.hpp"

namespace hybrid_slam::test {
namespace {

constexpr double kResolution = 0.1;

struct BestPoses {
    double score = -1.0;
    Pose2d pose;
    double runner_up_score = -1.0;  ///< of the best pose that is elsewhere than `elsewhere_than`
};

/// Zero without any.
SearchPlace best_of(const SearchResult& result) {
    return result.places.empty() ? SearchPlace() : result.places.front();
}

/// Every pose of the window's grid, scored cell by cell. Poses near `elsewhere_than` are no
/// runner-ups.
BestPoses full_search(const LikelihoodPyramid& pyramid, const Points& query,
                      const SearchWindow& window, const SearchLimits& limits,
                      const Pose2d& elsewhere_than) {
    const double resolution = pyramid.geometry().resolution;
    const int reach = static_cast<int>(std::ceil(window.half_width / resolution));
    const int turns = static_cast<int>(std::ceil(window.half_angle / window.angle_step));
    BestPoses best;
    for (int turn = -turns; turn <= turns; ++turn) {
        const double heading = normalize_angle(window.center.heading + turn * window.angle_step);
        std::vector<Cell> cells;
        for (const Point2& point : query) {
            cells.push_back(pyramid.geometry().cell_of(
                Pose2d(window.center.translation,
                       window.center.heading + turn * window.angle_step) *
                point));
        }
        for (int y = -reach; y <= reach; ++y) {
            for (int x = -reach; x <= reach; ++x) {
                int sum = 0;
                for (const Cell& cell : cells) {
                    sum += pyramid.at(0, cell.x + x, cell.y + y);
                }
                const double score = sum / (255.0 * static_cast<double>(query.size()));
                const Pose2d pose(window.center.x() + x * resolution,
                                  window.center.y() + y * resolution, heading);
                if (score > best.score) {
                    best.score = score;
                    best.pose = pose;
                }
                const Pose2d apart = between(elsewhere_than, pose);
                const bool elsewhere = apart.translation.norm() > limits.runner_up_distance ||
                                       std::abs(apart.heading) > limits.runner_up_angle;
                if (elsewhere) {
                    best.runner_up_score = std::max(best.runner_up_score, score);
                }
            }
        }
    }
    return best;
}

Points every(const Points& points, std::size_t step) {
    Points kept;
    for (std::size_t i = 0; i < points.size(); i += step) {
        kept.push_back(points[i]);
    }
    return kept;
}

class SearchAtDepth : public ::testing::TestWithParam<int> {};

TEST_P(SearchAtDepth, FindsWhatFullSearchFindsBestAndRunnerUp) {
    const World world = irregular_room();
    const Points reference = surface_of(scan_at(world, {})).points;
    const LikelihoodPyramid pyramid(reference, kResolution, 0.1, GetParam());
    ASSERT_EQ(pyramid.levels(), GetParam());
    Rng rng(51);
    int with_runner_up = 0;
    for (int i = 0; i < 12; ++i) {
        const Pose2d truth(uniform(rng, -0.8, 0.8), uniform(rng, -0.8, 0.8),
                           uniform(rng, -0.3, 0.3));
        const Points query = every(surface_of(scan_at(world, truth)).points, 6);
        SearchWindow window;
        window.center = Pose2d(uniform(rng, -0.2, 0.2), uniform(rng, -0.2, 0.2), 0.0);
        window.half_width = uniform(rng, 0.3, 1.1);
        window.half_angle = 0.3;
        window.angle_step = 0.05;
        SearchLimits limits;
        limits.min_score = 0.05;
        limits.runner_up_ratio = uniform(rng, 0.3, 0.9);
        limits.runner_up_distance = 0.35;
        limits.runner_up_angle = 0.12;
        limits.max_nodes = 10000000;
        const SearchResult found = branch_and_bound(pyramid, query, window, limits);
        ASSERT_TRUE(found.found);
        const BestPoses exact =
            full_search(pyramid, query, window, limits, best_of(found).reference_from_query);
        ASSERT_DOUBLE_EQ(best_of(found).score, exact.score);
        const bool reaches = exact.runner_up_score >= limits.runner_up_ratio * exact.score;
        ASSERT_DOUBLE_EQ(found.runner_up_score(), reaches ? exact.runner_up_score : 0.0);
        with_runner_up += reaches ? 1 : 0;
        // The poses bear the scores; cells at the very edge may round the other way.
        ASSERT_NEAR(match_score(pyramid, query, best_of(found).reference_from_query),
                    best_of(found).score, 0.02);
        if (reaches) {
            ASSERT_NEAR(match_score(pyramid, query, found.places.at(1).reference_from_query),
                        found.runner_up_score(), 0.02);
        }
    }
    EXPECT_GT(with_runner_up, 2);
    EXPECT_LT(with_runner_up, 12);
}

TEST_P(SearchAtDepth, FindsPosesWhoseQueryReachesOutOfTheGrid) {
    // Most of the query lies far outside to one side, at each side in turn.
    const Points corner{{0.05, 0.05}, {0.55, 0.05}, {1.05, 0.05},
                        {0.05, 0.55}, {0.05, 1.05}, {0.35, 0.75}};
    const LikelihoodPyramid pyramid(corner, kResolution, 0.1, GetParam());
    for (const Point2& side : {Point2(-30, 0), Point2(30, 0), Point2(0, -30), Point2(0, 30)}) {
        Points query = corner;
        query.push_back(side);
        query.push_back(2.0 * side);
        SearchWindow window;
        window.center = Pose2d(0.7, -0.6, 0.0);
        window.half_width = 2.0;
        window.half_angle = 0.1;
        window.angle_step = 0.1;
        SearchLimits limits;
        limits.min_score = 0.1;
        const SearchResult found = branch_and_bound(pyramid, query, window, limits);
        ASSERT_TRUE(found.found);
        EXPECT_DOUBLE_EQ(best_of(found).score,
                         full_search(pyramid, query, window, limits, {}).score);
        EXPECT_DOUBLE_EQ(best_of(found).score, 6.0 / 8.0);
    }
}

INSTANTIATE_TEST_SUITE_P(Levels, SearchAtDepth, ::testing::Values(1, 2, 3, 5, 7));

TEST(BranchAndBound, FindsTheTruePoseInARoom) {
    const World world = irregular_room();
    const LikelihoodPyramid pyramid(surface_of(scan_at(world, {})).points, 0.05, 0.08, 5);
    Rng rng(52);
    std::size_t nodes = 0;
    for (int i = 0; i < 10; ++i) {
        const Pose2d truth(uniform(rng, -1, 1), uniform(rng, -1, 1), uniform(rng, -0.5, 0.5));
        const Points query = surface_of(scan_at(world, truth)).points;
        SearchWindow window;
        window.half_width = 1.5;
        window.half_angle = 0.6;
        const SearchResult found = branch_and_bound(pyramid, query, window, {});
        ASSERT_TRUE(found.found);
        ASSERT_THAT(best_of(found).reference_from_query, PoseNear(truth, 0.08, radians(1.5)));
        nodes += found.nodes;
    }
    const std::size_t full = 10U * 61U * 61U * 71U;
    EXPECT_LT(nodes, full / 10) << "bounding must save effort";
}

TEST(BranchAndBound, SearchesAroundItsCentreAcrossTheSeamOfHeadings) {
    const World world = irregular_room();
    const LikelihoodPyramid pyramid(surface_of(scan_at(world, {})).points, 0.05, 0.08, 5);
    const Pose2d truth(0.2, 0.1, radians(-179.0));
    const Points query = surface_of(scan_at(world, truth)).points;
    SearchWindow window;
    window.center = Pose2d(0.0, 0.0, radians(178.0));
    window.half_width = 0.5;
    window.half_angle = 0.1;
    const SearchResult found = branch_and_bound(pyramid, query, window, {});
    ASSERT_TRUE(found.found);
    EXPECT_THAT(best_of(found).reference_from_query, PoseNear(truth, 0.08, radians(1.5)));
    EXPECT_LE(std::abs(best_of(found).reference_from_query.heading), kPi);
}

TEST(BranchAndBound, FindsNothingBelowTheScoreAsked) {
    const Points reference = surface_of(scan_at(irregular_room(), {})).points;
    const LikelihoodPyramid pyramid(reference, kResolution, 0.1, 4);
    const Points query = surface_of(scan_at(ring_hall(), {2.5, 2.5, 0.0})).points;
    SearchLimits limits;
    limits.min_score = 0.9;
    const SearchResult found = branch_and_bound(pyramid, query, {}, limits);
    EXPECT_FALSE(found.found);
    EXPECT_FALSE(found.exhausted);
    EXPECT_EQ(best_of(found).score, 0.0);
}

TEST(BranchAndBound, FindsScoresOfExactlyTheOneAsked) {
    const Points reference = surface_of(scan_at(irregular_room(), {})).points;
    const LikelihoodPyramid pyramid(reference, kResolution, 0.1, 4);
    SearchLimits limits;
    limits.min_score = match_score(pyramid, reference, {});
    SearchWindow window;
    window.half_width = 0.3;
    const SearchResult found = branch_and_bound(pyramid, reference, window, limits);
    EXPECT_TRUE(found.found);
}

TEST(BranchAndBound, SaysWhenItGaveUp) {
    const Points reference = surface_of(scan_at(irregular_room(), {})).points;
    const LikelihoodPyramid pyramid(reference, kResolution, 0.1, 4);
    SearchLimits limits;
    limits.min_score = 0.01;
    limits.max_nodes = 10;
    SearchWindow window;
    window.center = Pose2d(1.0, 1.0, 0.2);
    const SearchResult found = branch_and_bound(pyramid, reference, window, limits);
    EXPECT_TRUE(found.exhausted);
    EXPECT_FALSE(found.found);
}

TEST(BranchAndBound, ATwinOfThePlaceIsTheRunnerUpWithTheSameScore) {
    const Points shape{{0.05, 0.05}, {0.45, 0.05}, {0.85, 0.05},
                       {0.85, 0.45}, {0.85, 0.85}, {0.25, 0.65}};
    Points twins = shape;
    for (const Point2& point : shape) {
        twins.push_back(point + Point2(2.0, 0.0));
    }
    const LikelihoodPyramid pyramid(twins, kResolution, 0.05, 4);
    SearchWindow window;
    window.center = Pose2d(1.0, 0.0, 0.0);
    window.half_width = 1.5;
    window.half_angle = 0.1;
    SearchLimits limits;
    limits.runner_up_ratio = 0.95;
    const SearchResult found = branch_and_bound(pyramid, shape, window, limits);
    ASSERT_TRUE(found.found);
    EXPECT_DOUBLE_EQ(best_of(found).score, 1.0);
    EXPECT_DOUBLE_EQ(found.runner_up_score(), 1.0);
    EXPECT_NEAR((found.places.at(1).reference_from_query.translation -
                 best_of(found).reference_from_query.translation)
                    .norm(),
                2.0, 0.15);
}

TEST(BranchAndBound, IsTheSameWhenRepeated) {
    const World world = irregular_room();
    const LikelihoodPyramid pyramid(surface_of(scan_at(world, {})).points, kResolution, 0.1, 5);
    const Points query = surface_of(scan_at(world, {0.3, 0.2, 0.1})).points;
    SearchLimits limits;
    limits.runner_up_ratio = 0.3;
    const SearchResult first = branch_and_bound(pyramid, query, {}, limits);
    const SearchResult second = branch_and_bound(pyramid, query, {}, limits);
    EXPECT_EQ(best_of(first).reference_from_query.vector(),
              best_of(second).reference_from_query.vector());
    EXPECT_EQ(first.places.at(1).reference_from_query.vector(),
              second.places.at(1).reference_from_query.vector());
    EXPECT_EQ(first.nodes, second.nodes);
}

TEST(BranchAndBound, AnEmptyQueryIsFoundNowhere) {
    const LikelihoodPyramid pyramid({{0, 0}}, kResolution, 0.1, 3);
    EXPECT_FALSE(branch_and_bound(pyramid, {}, {}, {}).found);
    EXPECT_EQ(match_score(pyramid, {}, {}), 0.0);
}

}  // namespace
}  // namespace hybrid_slam::test
