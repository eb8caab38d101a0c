// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/localization/scan_fit.hpp"

#include <gtest/gtest.h>

#include "backend/localization/localization_support.hpp"
#include "support/room.hpp"

namespace hybrid_slam::test {
namespace {

/// 8 x 6 m around the origin with one inner wall that is 10 cm thick and ends at (1, 0).
World split_room() {
    World world;
    add_outline(world, {{-4, -3}, {4, -3}, {4, 3}, {-4, 3}});
    add_box(world, Pose2d(1.0, -1.5, 0.0), 0.1, 3.0);
    world.path = {{-3, 1.5}, {3, 1.5}, {3, -2}, {3, 1.5}, {-3, 1.5}, {-3, -2}};
    return world;
}

const ReferenceMap& room_map() {
    static const auto map = map_of(split_room(), 0.01);
    return *map;
}

Query seen_from(const World& world, const Pose2d& pose, double sigma = 0.01) {
    std::mt19937 random(5);
    return {sweep_of(scan_at(world, pose, random, sigma))};
}

double sum_of(const ScanFit& fit) {
    return fit.explained + fit.violated + fit.unmapped + fit.unknown;
}

TEST(ScanFit, TruthExplainsAll) {
    const Pose2d pose(-1.0, 0.5, 0.4);
    const ScanFit fit = fit_of(room_map(), seen_from(split_room(), pose), pose);
    EXPECT_GT(fit.explained, 0.98);
    EXPECT_EQ(fit.violated, 0.0);
    EXPECT_GT(fit.score, 0.97);
    EXPECT_LT(fit.rms, 0.02);
    EXPECT_GT(fit.points, 200U);
    EXPECT_NEAR(sum_of(fit), 1.0, 1e-12);
}

TEST(ScanFit, NoPointsSayNothing) {
    const ScanFit fit = fit_of(room_map(), {Sweep()}, Pose2d());
    EXPECT_EQ(fit.points, 0U);
    EXPECT_EQ(fit.score, 0.0);
    EXPECT_EQ(sum_of(fit), 0.0);
}

/// From beyond the inner wall what is seen of the left half would have been seen through it.
TEST(ScanFit, WallsSeenThroughAreViolations) {
    World longer;
    add_outline(longer, {{-9, -3}, {4, -3}, {4, 3}, {-9, 3}});
    const Pose2d pose(3.0, -1.5, kPi);
    const ScanFit fit = fit_of(room_map(), seen_from(longer, pose), pose);
    EXPECT_GT(fit.violated, 0.2);
    EXPECT_LT(fit.score, 0.7);
    EXPECT_NEAR(sum_of(fit), 1.0, 1e-12);
}

/// The inner wall is gone: it is seen through, but all that is behind it is at its place.
TEST(ScanFit, AnOpenDoorIsNoOtherPlace) {
    World empty;
    add_outline(empty, {{-4, -3}, {4, -3}, {4, 3}, {-4, 3}});
    const Pose2d pose(3.0, -1.5, kPi);
    const ScanFit fit = fit_of(room_map(), seen_from(empty, pose), pose);
    EXPECT_GT(fit.violated, 0.2);
    EXPECT_GT(fit.beyond, 0.8 * fit.violated);
    EXPECT_LT(fit.against(), 0.0);
    EXPECT_GT(fit.score, 0.7);
    EXPECT_LT(fit.score, 0.95);
    EXPECT_NEAR(sum_of(fit), 1.0, 1e-12);
}

TEST(ScanFit, WhatEndsBehindAWallIsAViolation) {
    // 30 cm nearer to the wall ahead than in truth: what it saw lies inside of the wall.
    const Pose2d pose(3.0, 1.0, 0.0);
    const ScanFit fit = fit_of(room_map(), seen_from(split_room(), pose), Pose2d(3.25, 1.0, 0.0));
    EXPECT_GT(fit.violated, 0.2);
}

TEST(ScanFit, NewThingsAreUnmappedAndNoViolation) {
    World changed = split_room();
    add_box(changed, Pose2d(-2.0, 1.6, 0.3), 1.0, 0.6);
    const Pose2d pose(-2.5, -1.0, 1.2);
    const Query query = seen_from(changed, pose, 0.0);
    std::size_t on_box = 0;
    for (const Point2& point : query.front().surface.points) {
        const Point2 in_box = Pose2d(-2.0, 1.6, 0.3).inverse() * (pose * point);
        on_box += std::abs(in_box.x()) < 0.52 && std::abs(in_box.y()) < 0.32 ? 1 : 0;
    }
    const ScanFit fit = fit_of(room_map(), query, pose);
    ASSERT_GT(on_box, 10U);
    EXPECT_NEAR(fit.unmapped, static_cast<double>(on_box) / static_cast<double>(fit.points), 0.02);
    EXPECT_LT(fit.violated, 0.01);
}

TEST(ScanFit, PlacesTheMapNeverSawAreUnknown) {
    const Pose2d pose(-2.0, 1.0, 0.0);
    const ScanFit fit = fit_of(room_map(), seen_from(split_room(), pose), Pose2d(40.0, 40.0, 0.0));
    EXPECT_EQ(fit.unknown, 1.0);
    EXPECT_EQ(fit.score, 0.0);
}

/// The beams past the wall's end come as near to it as 5 cm.
TEST(ScanFit, PastAnEdgeIsNotThroughIt) {
    const Pose2d pose(-1.5, -1.0, 0.5);
    const Query query = seen_from(split_room(), pose, 0.0);
    for (const double off : {-0.05, 0.0, 0.05}) {
        EXPECT_LT(fit_of(room_map(), query, pose * Pose2d(0.0, off, 0.0)).violated, 0.02) << off;
    }
}

TEST(ScanFit, FallsWithTheErrorOfThePose) {
    const Pose2d pose(-1.0, 0.5, 0.4);
    const Query query = seen_from(split_room(), pose);
    double before = fit_of(room_map(), query, pose).score;
    for (const double off : {0.06, 0.09, 0.12}) {
        const double score = fit_of(room_map(), query, pose * Pose2d(off, off, 0.0)).score;
        EXPECT_LT(score, before);
        before = score;
    }
    EXPECT_LT(before, 0.5);
}

/// The same query as sweeps from two places.
TEST(ScanFit, SweepsOfOneQueryCountTogether) {
    const Pose2d now(-1.0, 0.5, 0.4);
    const Pose2d then(-2.0, 0.0, 0.1);
    Query query = seen_from(split_room(), now);
    query.push_back(transform(between(now, then), seen_from(split_room(), then).front()));
    const ScanFit fit = fit_of(room_map(), query, now);
    EXPECT_EQ(fit.points, query[0].surface.size() + query[1].surface.size());
    EXPECT_GT(fit.explained, 0.98);
    EXPECT_EQ(fit.violated, 0.0);
}

TEST(ScanFit, TransformMovesOriginAndPoints) {
    const Sweep sweep{{1.0, 0.0}, {{{2.0, 0.0}}, {{-1.0, 0.0}}}};
    const Sweep moved = transform(Pose2d(0.0, 1.0, kPi / 2.0), sweep);
    EXPECT_LT((moved.origin - Point2(0.0, 2.0)).norm(), 1e-12);
    EXPECT_LT((moved.surface.points.front() - Point2(0.0, 3.0)).norm(), 1e-12);
    EXPECT_LT((moved.surface.normals.front() - Point2(0.0, -1.0)).norm(), 1e-12);
}

}  // namespace
}  // namespace hybrid_slam::test
