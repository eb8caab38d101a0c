// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/backend/loop_closing.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <set>

#include "hybrid_slam/odometry/scan_filter.hpp"
#include "support/pose_matchers.hpp"
#include "support/room.hpp"

namespace hybrid_slam::test {
namespace {

LoopClosingConfig closing_config() {
    LoopClosingConfig config;
    config.every = 1;
    config.max_candidates = 2;
    config.min_path = 10.0;
    config.reach = 3.0;
    config.max_window = 4.0;
    config.max_window_angle = 0.5;
    config.reference_keyframes = 7;
    config.query_keyframes = 3;
    config.resolution = 0.1;
    config.sigma = 0.1;
    config.min_score = 0.5;
    config.runner_up_ratio = 0.92;
    config.min_overlap = 0.6;
    config.closure_gate = 0.15;
    config.max_chi2 = 16.3;
    config.trusted_distance = 0.3;
    config.trusted_angle = radians(4.0);
    config.support_distance = 0.25;
    config.support_angle = radians(3.0);
    config.support_path = 8.0;
    config.closure_translation_floor = 0.02;
    config.closure_rotation_floor = radians(0.3);
    return config;
}

Eigen::Matrix3d covariance_of(double translation, double heading) {
    return Eigen::Vector3d(translation * translation, translation * translation, heading * heading)
        .asDiagonal();
}

/// Keyframes at true places, and a graph whose chain is off by `drift` a step.
struct Session {
    World world;
    Lidar lidar;
    Pose2d drift;
    Eigen::Matrix3d step_covariance = covariance_of(0.01, 0.003);
    std::vector<Pose2d> truth;
    Keyframes keyframes;
    PoseGraph graph;
    Rng rng{71};

    explicit Session(World world_in, const Pose2d& drift_in = {})
        : world(std::move(world_in)), drift(drift_in) {
        lidar.beams = 541;
        lidar.field_of_view = radians(270.0);
        lidar.sigma = 0.01;
    }

    void add(const Pose2d& pose) {
        Keyframe keyframe;
        keyframe.stamp = static_cast<double>(keyframes.size());
        keyframe.surface = to_surface(scan_at(world, pose, lidar, rng), {});
        if (truth.empty()) {
            graph.nodes.push_back(pose);
        } else {
            Edge edge;
            edge.from = truth.size() - 1;
            edge.to = truth.size();
            edge.from_from_to = between(truth.back(), pose) * drift;
            edge.information = step_covariance.inverse();
            graph.edges.push_back(edge);
            graph.nodes.push_back(graph.nodes.back() * edge.from_from_to);
            keyframe.path = keyframes.back().path + edge.from_from_to.translation.norm();
        }
        keyframe.local_from_robot = graph.nodes.back();
        truth.push_back(pose);
        keyframes.push_back(std::move(keyframe));
    }

    Pose2d true_relative(const Closure& closure) const {
        return between(truth[closure.from], truth[closure.to]);
    }
};

/// Poses half a metre apart along the hall's way, turning on the spot at its corners.
std::vector<Pose2d> around_the_ring(double metres) {
    const Points& corners = ring_hall().path;
    std::vector<Pose2d> poses;
    double driven = 0.0;
    for (std::size_t leg = 0;; ++leg) {
        const Point2& start = corners[leg % 4];
        const Eigen::Vector2d along = corners[leg % 4 + 1] - start;
        const double heading = std::atan2(along.y(), along.x());
        for (double at = 0.0; at < along.norm(); at += 0.5, driven += 0.5) {
            poses.emplace_back(start + at * along.normalized(), heading);
            if (driven >= metres) {
                return poses;
            }
        }
        for (const double turn : {0.3, 0.8, 1.3}) {
            poses.emplace_back(corners[leg % 4 + 1], normalize_angle(heading + turn));
        }
    }
}

/// Drives on and searches at every keyframe; all that was tried.
std::vector<Closure> close_along(Session& session, LoopCloser& closer,
                                 const std::vector<Pose2d>& poses) {
    std::vector<Closure> all;
    for (const Pose2d& pose : poses) {
        session.add(pose);
        const auto found = closer.search(session.keyframes, session.graph);
        all.insert(all.end(), found.begin(), found.end());
    }
    return all;
}

std::size_t count(const std::vector<Closure>& closures, ClosureVerdict verdict) {
    return static_cast<std::size_t>(
        std::count_if(closures.begin(), closures.end(),
                      [&](const Closure& closure) { return closure.verdict == verdict; }));
}

TEST(LoopCloser, ClosesALoopWithTheRightPose) {
    Session session(ring_hall(), {0.0, 0.0, 1e-4});
    LoopCloser closer(closing_config(), {});
    const auto closures = close_along(session, closer, around_the_ring(70.0));
    EXPECT_GE(count(closures, ClosureVerdict::kAccepted), 2U);
    for (const Closure& closure : closures) {
        EXPECT_LT(closure.from, closure.to);
        EXPECT_GE(session.keyframes[closure.to].path - session.keyframes[closure.from].path, 10.0);
        if (closure.verdict == ClosureVerdict::kAccepted) {
            EXPECT_THAT(closure.from_from_to,
                        PoseNear(session.true_relative(closure), 0.03, radians(0.5)));
            EXPECT_GE(closure.score, 0.5);
            EXPECT_GE(closure.overlap, 0.6);
            EXPECT_LT(closure.rms, 0.05);
            EXPECT_LE(closure.chi2, 16.3);
            EXPECT_EQ(closure.information, closure.information.transpose());
            EXPECT_GT(closure.information.determinant(), 0.0);
        }
    }
}

TEST(LoopCloser, ALargeCorrectionWaitsForASecondThatAgrees) {
    Session session(ring_hall(), {0.0, 0.0, 3e-4});
    LoopCloser closer(closing_config(), {});
    std::vector<Closure> first_accepted;
    std::size_t pending_before = 0;
    for (const Pose2d& pose : around_the_ring(70.0)) {
        session.add(pose);
        const auto found = closer.search(session.keyframes, session.graph);
        if (count(found, ClosureVerdict::kAccepted) > 0) {
            first_accepted = found;
            break;
        }
        pending_before += count(found, ClosureVerdict::kPending);
    }
    ASSERT_FALSE(first_accepted.empty());
    EXPECT_GE(pending_before, 1U) << "the first was not believed alone";
    // The one that waited comes out along with the one that supports it.
    std::set<std::size_t> ends;
    for (const Closure& closure : first_accepted) {
        if (closure.verdict == ClosureVerdict::kAccepted) {
            ends.insert(closure.to);
            EXPECT_GT(closure.correction, 0.3);
            EXPECT_THAT(closure.from_from_to,
                        PoseNear(session.true_relative(closure), 0.03, radians(0.5)));
        }
    }
    EXPECT_GE(ends.size(), 2U);
}

TEST(LoopCloser, DoesNotBelieveALargeCorrectionThatNothingSupports) {
    Session session(ring_hall(), {0.0, 0.0, 3e-4});
    LoopClosingConfig config = closing_config();
    config.support_distance = 1e-6;  // no second closure agrees this well
    LoopCloser closer(config, {});
    const auto closures = close_along(session, closer, around_the_ring(64.0));
    EXPECT_EQ(count(closures, ClosureVerdict::kAccepted), 0U);
    EXPECT_GE(count(closures, ClosureVerdict::kPending), 1U);
}

TEST(LoopCloser, SearchesOnlyWhenItMay) {
    const auto poses = around_the_ring(64.0);
    LoopClosingConfig config = closing_config();
    config.enabled = false;
    Session off(ring_hall());
    LoopCloser disabled(config, {});
    EXPECT_TRUE(close_along(off, disabled, poses).empty());

    config = closing_config();
    config.min_path = 1000.0;
    Session young(ring_hall());
    LoopCloser patient(config, {});
    EXPECT_TRUE(close_along(young, patient, poses).empty());

    config = closing_config();
    config.every = 4;
    Session sparse(ring_hall());
    LoopCloser seldom(config, {});
    for (const Closure& closure : close_along(sparse, seldom, poses)) {
        EXPECT_EQ((closure.to + 1) % 4, 0U);
    }
}

TEST(LoopCloser, IsTheSameToTheBitWhenRepeated) {
    const auto poses = around_the_ring(64.0);
    std::vector<Closure> runs[2];
    for (auto& closures : runs) {
        Session session(ring_hall(), {0.0, 0.0, 3e-4});
        LoopCloser closer(closing_config(), {});
        closures = close_along(session, closer, poses);
    }
    ASSERT_EQ(runs[0].size(), runs[1].size());
    ASSERT_FALSE(runs[0].empty());
    for (std::size_t i = 0; i < runs[0].size(); ++i) {
        EXPECT_EQ(runs[0][i].from_from_to.vector(), runs[1][i].from_from_to.vector());
        EXPECT_EQ(runs[0][i].information, runs[1][i].information);
        EXPECT_EQ(runs[0][i].verdict, runs[1][i].verdict);
        EXPECT_EQ(runs[0][i].nodes, runs[1][i].nodes);
    }
}

/// The same stretch driven twice; the graph is the truth.
Session driven_twice(const World& world, const Pose2d& start, double range_max) {
    Session session(world);
    session.lidar.range_max = range_max;
    for (int lap = 0; lap < 2; ++lap) {
        for (int i = 0; i < 12; ++i) {
            session.add(start * Pose2d(0.3 * i, 0.0, 0.0));
        }
    }
    return session;
}

/// A corridor with a niche every 1.5 m, all alike.
World row_of_booths() {
    World world;
    world.walls.push_back({{-60.0, 1.2}, {60.0, 1.2}});
    for (int i = -40; i < 40; ++i) {
        const double x = 1.5 * i;
        world.walls.push_back({{x, -1.0}, {x + 0.9, -1.0}});
        world.walls.push_back({{x + 0.9, -1.0}, {x + 0.9, -1.6}});
        world.walls.push_back({{x + 0.9, -1.6}, {x + 1.5, -1.6}});
        world.walls.push_back({{x + 1.5, -1.6}, {x + 1.5, -1.0}});
    }
    return world;
}

TEST(LoopCloser, TwoPlacesThatLookAlikeWithinTheUncertaintyAreAmbiguous) {
    const Session session = driven_twice(row_of_booths(), {-1.0, 0.0, 0.0}, 4.0);
    const LoopCloser closer(closing_config(), {});
    const Closure unsure =
        closer.match(session.keyframes, session.graph, 6, 20, covariance_of(0.6, 0.03));
    EXPECT_EQ(unsure.verdict, ClosureVerdict::kAmbiguous);
    EXPECT_GE(unsure.runner_up_score, 0.92 * unsure.score);
    // Whoever knows the way to a few centimetres can tell them apart.
    const Closure sure =
        closer.match(session.keyframes, session.graph, 6, 20, covariance_of(0.03, 0.01));
    EXPECT_EQ(sure.verdict, ClosureVerdict::kAccepted);
    EXPECT_THAT(sure.from_from_to, PoseNear(session.true_relative(sure), 0.03, radians(0.5)));
}

TEST(LoopCloser, ALookAlikeOutsideTheUncertaintyIsRefused) {
    // Twin rooms, 30 m apart, with one pose in each, and a graph that knows which is which.
    World twins;
    for (const double x : {0.0, 30.0}) {
        for (Segment wall : irregular_room().walls) {
            wall.start.x() += x;
            wall.end.x() += x;
            twins.walls.push_back(wall);
        }
    }
    Session session(twins);
    for (const double x : {0.0, 30.0}) {
        for (int i = 0; i < 12; ++i) {
            session.add({x - 1.5 + 0.25 * i, 0.0, 0.0});
        }
    }
    LoopClosingConfig config = closing_config();
    config.reference_keyframes = 3;  // of the one room alone
    const LoopCloser closer(config, {});
    const Closure closure =
        closer.match(session.keyframes, session.graph, 6, 18, covariance_of(0.5, 0.05));
    EXPECT_EQ(closure.verdict, ClosureVerdict::kLowScore);

    // Had the graph mixed them up, they would have fitted.
    PoseGraph mixed_up = session.graph;
    for (std::size_t k = 12; k < 24; ++k) {
        mixed_up.nodes[k].translation.x() -= 30.0;
    }
    EXPECT_EQ(closer.match(session.keyframes, mixed_up, 6, 18, covariance_of(0.1, 0.03)).verdict,
              ClosureVerdict::kAccepted);
}

TEST(LoopCloser, WhatContradictsTheGraphBeyondItsUncertaintyIsRefused) {
    Session session = driven_twice(ring_hall(), {3.0, 2.5, 0.0}, 20.0);
    for (std::size_t k = 12; k < 24; ++k) {
        session.graph.nodes[k].translation.y() += 0.4;
    }
    const LoopCloser closer(closing_config(), {});
    const Closure refused =
        closer.match(session.keyframes, session.graph, 6, 18, covariance_of(0.02, 0.005));
    EXPECT_EQ(refused.verdict, ClosureVerdict::kInconsistent);
    EXPECT_GT(refused.chi2, 16.3);
    EXPECT_NEAR(refused.correction, 0.4, 0.05);
    // The same find against a graph that is less sure of itself is plausible.
    const Closure plausible =
        closer.match(session.keyframes, session.graph, 6, 18, covariance_of(0.3, 0.02));
    EXPECT_EQ(plausible.verdict, ClosureVerdict::kPending);
    EXPECT_THAT(plausible.from_from_to,
                PoseNear(session.true_relative(plausible), 0.03, radians(0.5)));
}

TEST(LoopCloser, SaysWhyNothingCameOfIt) {
    const Session session = driven_twice(ring_hall(), {3.0, 2.5, 0.0}, 20.0);
    const auto verdict_with = [&](const LoopClosingConfig& config) {
        return LoopCloser(config, {})
            .match(session.keyframes, session.graph, 6, 18, covariance_of(0.1, 0.02))
            .verdict;
    };
    EXPECT_EQ(verdict_with(closing_config()), ClosureVerdict::kAccepted);
    LoopClosingConfig config = closing_config();
    config.min_score = 0.999;
    EXPECT_EQ(verdict_with(config), ClosureVerdict::kLowScore);
    config = closing_config();
    config.max_nodes = 1;
    EXPECT_EQ(verdict_with(config), ClosureVerdict::kExhausted);
    config = closing_config();
    config.min_overlap = 0.99;
    config.closure_gate = 0.002;
    EXPECT_EQ(verdict_with(config), ClosureVerdict::kIcpFailed);
    config = closing_config();
    config.runner_up_ratio = 0.01;
    EXPECT_EQ(verdict_with(config), ClosureVerdict::kAmbiguous);
}

TEST(LoopCloser, KeyframesThatSawNothingCloseNothing) {
    Session session = driven_twice(ring_hall(), {3.0, 2.5, 0.0}, 20.0);
    for (Keyframe& keyframe : session.keyframes) {
        keyframe.surface = {};
    }
    const LoopCloser closer(closing_config(), {});
    EXPECT_EQ(
        closer.match(session.keyframes, session.graph, 6, 18, covariance_of(0.1, 0.02)).verdict,
        ClosureVerdict::kLowScore);
}

TEST(LoopCloser, ClaimsNoMoreThanItsFloors) {
    const Session session = driven_twice(ring_hall(), {3.0, 2.5, 0.0}, 20.0);
    LoopClosingConfig config = closing_config();
    config.closure_translation_floor = 0.05;
    config.closure_rotation_floor = 0.02;
    const Closure closure =
        LoopCloser(config, {})
            .match(session.keyframes, session.graph, 6, 18, covariance_of(0.1, 0.02));
    const Eigen::Matrix3d covariance = closure.information.inverse();
    EXPECT_GE(covariance(0, 0), 0.05 * 0.05);
    EXPECT_GE(covariance(1, 1), 0.05 * 0.05);
    EXPECT_GE(covariance(2, 2), 0.02 * 0.02);
    EXPECT_LT(covariance(2, 2), 2.0 * 0.02 * 0.02);
}

// Closures become edges, whose information is in the axes of the newer node: here it stands across
// the corridor, which is well known across and hardly along.
TEST(LoopCloser, InformationIsInTheAxesOfTheNewerKeyframe) {
    World world = endless_corridor();
    add_box(world, {2.0, 0.8, 0.0}, 0.5, 0.4);
    add_box(world, {-1.3, -0.7, 0.0}, 0.4, 0.6);
    Session session(world);
    session.lidar.field_of_view = 2.0 * kPi;
    session.lidar.range_max = 6.0;
    for (const double heading : {0.0, kPi / 2.0}) {
        for (int i = 0; i < 12; ++i) {
            session.add({0.1 * i, 0.0, heading});
        }
    }
    LoopClosingConfig config = closing_config();
    config.closure_translation_floor = 0.0;
    config.closure_rotation_floor = 0.0;
    const Closure closure =
        LoopCloser(config, {})
            .match(session.keyframes, session.graph, 6, 18, covariance_of(0.05, 0.02));
    ASSERT_EQ(closure.verdict, ClosureVerdict::kAccepted);
    const Eigen::Matrix3d covariance = closure.information.inverse();
    EXPECT_GT(covariance(1, 1), 1.5 * covariance(0, 0)) << "its y axis lies along the corridor";
}

}  // namespace
}  // namespace hybrid_slam::test
