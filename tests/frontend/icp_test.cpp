// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/registration/icp.hpp"

#include <gtest/gtest.h>

#include "support/pose_matchers.hpp"
#include "support/room.hpp"

namespace hybrid_slam::test {
namespace {

/// What the tests are about is set here, whatever the defaults are tuned to.
IcpConfig config_of(IcpMetric metric) {
    IcpConfig config;
    config.metric = metric;
    config.max_iterations = 200;
    config.max_distance = 2.0;
    config.min_distance = 0.15;
    config.gate_factor = 10.0;
    config.translation_tolerance = 1e-6;
    config.rotation_tolerance = 1e-6;
    config.min_overlap = 0.3;
    config.trim = 1.0;
    config.kernel = IcpKernel::kNone;
    return config;
}

Surface moved(const Surface& surface, const Pose2d& reference_from_points) {
    return transform(reference_from_points.inverse(), surface);
}

class IcpOfBothMetrics : public ::testing::TestWithParam<IcpMetric> {};

TEST_P(IcpOfBothMetrics, FindsNoMotionWhereThereIsNone) {
    const Surface room = surface_of(scan_at(irregular_room(), {}));
    const IcpResult result = align(room, Reference(room), {}, config_of(GetParam()));
    EXPECT_EQ(result.status, IcpStatus::kConverged);
    EXPECT_THAT(result.reference_from_points, PoseNear(Pose2d(), 1e-9, 1e-9));
    EXPECT_EQ(result.pairs, room.size());
    EXPECT_DOUBLE_EQ(result.overlap, 1.0);
    EXPECT_LT(result.rms, 1e-9);
}

TEST_P(IcpOfBothMetrics, UndoesAnyKnownMotionOfTheSamePoints) {
    const Surface room = surface_of(scan_at(irregular_room(), {}));
    const Reference reference(room);
    Rng rng(21);
    for (int i = 0; i < 50; ++i) {
        const Pose2d truth{uniform(rng, -0.25, 0.25), uniform(rng, -0.25, 0.25),
                           uniform(rng, -0.15, 0.15)};
        const IcpResult result = align(moved(room, truth), reference, {}, config_of(GetParam()));
        ASSERT_EQ(result.status, IcpStatus::kConverged) << truth;
        // Point to point may come to rest one beam off, where each point has its neighbour's
        // partner: a degree, and half of the 8 cm between points that are 5 m away.
        const bool to_line = GetParam() == IcpMetric::kPointToLine;
        ASSERT_THAT(result.reference_from_points,
                    PoseNear(truth, to_line ? 1e-4 : 0.04, to_line ? 1e-4 : radians(1.1)));
        ASSERT_DOUBLE_EQ(result.overlap, 1.0);
    }
}

TEST_P(IcpOfBothMetrics, IsExactForMotionsSmallerThanTheSpacingOfThePoints) {
    const Surface room = surface_of(scan_at(irregular_room(), {}));
    const Reference reference(room);
    Rng rng(25);
    for (int i = 0; i < 50; ++i) {
        const Pose2d truth(uniform(rng, -0.005, 0.005), uniform(rng, -0.005, 0.005),
                           uniform(rng, -0.003, 0.003));
        const IcpResult result = align(moved(room, truth), reference, {}, config_of(GetParam()));
        ASSERT_THAT(result.reference_from_points, PoseNear(truth, 1e-5, 1e-5));
    }
}

// A prior of the heading to within 6 degrees, whatever the heading is: the room turned by 40
// degrees between two scans, and across the seam at 180.
TEST_P(IcpOfBothMetrics, UndoesALargeRotationFromAPriorOfIt) {
    const World world = irregular_room();
    const Reference reference(surface_of(scan_at(world, {})));
    for (const double heading_deg : {40.0, -40.0, 90.0, 178.0, -179.0}) {
        const Pose2d truth(0.1, -0.15, radians(heading_deg));
        const Surface scan = surface_of(scan_at(world, truth));
        for (const double off_deg : {-6.0, 0.0, 6.0}) {
            const IcpGuess guess{Pose2d(0.0, 0.0, normalize_angle(radians(heading_deg + off_deg)))};
            const IcpResult result = align(scan, reference, guess, config_of(GetParam()));
            ASSERT_TRUE(result.usable());
            ASSERT_THAT(result.reference_from_points, PoseNear(truth, 0.04, radians(0.6)));
        }
    }
}

TEST_P(IcpOfBothMetrics, AlignsScansFromDifferentPlacesWithinWhatTheBeamsResolve) {
    const World world = irregular_room();
    const Reference reference(surface_of(scan_at(world, {})));
    Rng rng(22);
    double worst = 0.0;
    for (int i = 0; i < 50; ++i) {
        const Pose2d truth(uniform(rng, -0.3, 0.3), uniform(rng, -0.3, 0.3),
                           uniform(rng, -0.2, 0.2));
        IcpConfig config = config_of(GetParam());
        config.kernel = IcpKernel::kCauchy;
        const IcpResult result = align(surface_of(scan_at(world, truth)), reference, {}, config);
        ASSERT_TRUE(result.usable());
        worst = std::max(worst, apart(truth, result.reference_from_points));
    }
    // Points do not fall on points: beams are 1 degree apart, 7 cm at 4 m. To tangents that matters
    // little.
    EXPECT_LT(worst, GetParam() == IcpMetric::kPointToLine ? 0.005 : 0.04);
}

TEST_P(IcpOfBothMetrics, SurvivesNoiseAndOutliersByKernelOrTrimming) {
    const World world = irregular_room();
    const Reference reference(surface_of(scan_at(world, {})));
    Lidar noisy;
    noisy.sigma = 0.01;
    struct Case {
        IcpKernel kernel;
        double trim;
    };
    for (const Case& robust : {Case{IcpKernel::kCauchy, 1.0}, Case{IcpKernel::kHuber, 1.0},
                               Case{IcpKernel::kNone, 0.75}}) {
        Rng rng(23);
        for (int i = 0; i < 10; ++i) {
            const Pose2d truth(uniform(rng, -0.15, 0.15), uniform(rng, -0.15, 0.15),
                               uniform(rng, -0.1, 0.1));
            Scan scan = scan_at(world, truth, noisy, rng);
            // A lorry's side, 60 degrees of it, where the reference has nothing.
            for (std::size_t beam = 100; beam < 160; ++beam) {
                scan.ranges[beam] = std::min(scan.ranges[beam], 1.2F);
            }
            IcpConfig config = config_of(GetParam());
            config.kernel = robust.kernel;
            config.trim = robust.trim;
            const IcpResult result = align(surface_of(scan), reference, {}, config);
            ASSERT_TRUE(result.usable());
            const bool to_line = GetParam() == IcpMetric::kPointToLine;
            ASSERT_THAT(result.reference_from_points,
                        PoseNear(truth, to_line ? 0.02 : 0.07, radians(to_line ? 0.5 : 4.0)));
            ASSERT_LT(result.overlap, 0.87) << "the lorry has no partner";
            ASSERT_GT(result.overlap, robust.trim < 1.0 ? 0.5 : 0.7);
        }
    }
}

TEST_P(IcpOfBothMetrics, IsTheSameToTheBitWhenRepeated) {
    const World world = irregular_room();
    Lidar noisy;
    noisy.sigma = 0.02;
    Rng rng(24);
    const Surface reference = surface_of(scan_at(world, {}, noisy, rng));
    const Surface scan = surface_of(scan_at(world, {0.2, 0.1, 0.1}, noisy, rng));
    IcpConfig config = config_of(GetParam());
    config.trim = 0.8;
    const IcpResult first = align(scan, Reference(reference), {}, config);
    const IcpResult second = align(scan, Reference(reference), {}, config);
    EXPECT_EQ(first.reference_from_points.vector(), second.reference_from_points.vector());
    EXPECT_EQ(first.information, second.information);
    EXPECT_EQ(first.iterations, second.iterations);
}

TEST_P(IcpOfBothMetrics, TellsThatNothingOverlaps) {
    const Surface room = surface_of(scan_at(irregular_room(), {}));
    const IcpGuess guess{Pose2d(100.0, 0.0, 0.3)};
    const IcpResult result = align(room, Reference(room), guess, config_of(GetParam()));
    EXPECT_EQ(result.status, IcpStatus::kTooFewPairs);
    EXPECT_FALSE(result.usable());
    EXPECT_THAT(result.reference_from_points, PoseNear(guess.reference_from_points, 0.0, 0.0));
    EXPECT_EQ(result.overlap, 0.0);
    EXPECT_TRUE(result.information.isZero(0.0)) << "nothing was learned";
}

TEST_P(IcpOfBothMetrics, FailsWhenTooLittleOverlapsThoughThatLittleFits) {
    // One point in five stems from the room, the others from nowhere near.
    const Surface room = surface_of(scan_at(irregular_room(), {}));
    Surface scan = room;
    for (std::size_t i = 0; i < scan.size(); ++i) {
        scan.points[i] += i % 5 == 0 ? Point2(0.0, 0.0) : Point2(50.0, 50.0);
    }
    IcpConfig config = config_of(GetParam());
    config.min_overlap = 0.3;
    EXPECT_EQ(align(scan, Reference(room), {}, config).status, IcpStatus::kTooFewPairs);
    config.min_overlap = 0.1;
    const IcpResult result = align(scan, Reference(room), {}, config);
    EXPECT_TRUE(result.usable());
    EXPECT_NEAR(result.overlap, 0.2, 0.01);
}

TEST_P(IcpOfBothMetrics, TakesEmptyAndTinyScans) {
    const Surface room = surface_of(scan_at(irregular_room(), {}));
    const IcpGuess guess{Pose2d(0.1, 0.2, 0.3)};
    for (const std::size_t points : {0U, 1U, 2U}) {
        Surface scan = room;
        scan.points.resize(points);
        scan.normals.resize(points);
        const IcpResult result = align(scan, Reference(room), guess, config_of(GetParam()));
        EXPECT_EQ(result.status, IcpStatus::kTooFewPairs);
        EXPECT_THAT(result.reference_from_points, PoseNear(guess.reference_from_points, 0.0, 0.0));
        EXPECT_TRUE(result.information.allFinite());
    }
}

TEST_P(IcpOfBothMetrics, DoesNotThrowOnPointsThatAllCoincide) {
    const Surface heap{Points(50, Point2(1.0, 1.0)), Points(50, Point2::Zero())};
    const IcpResult result =
        align(heap, Reference(heap), {Pose2d(0.01, 0.0, 0.2)}, config_of(GetParam()));
    EXPECT_TRUE(result.reference_from_points.vector().allFinite());
    EXPECT_TRUE(result.information.allFinite());
}

TEST_P(IcpOfBothMetrics, SaysThatItStoppedEarly) {
    const Surface room = surface_of(scan_at(irregular_room(), {}));
    IcpConfig config = config_of(GetParam());
    config.max_iterations = 1;
    const Pose2d truth(0.2, 0.1, 0.1);
    const IcpResult result = align(moved(room, truth), Reference(room), {}, config);
    EXPECT_EQ(result.status, IcpStatus::kMaxIterations);
    EXPECT_TRUE(result.usable());
    EXPECT_EQ(result.iterations, 1);
    EXPECT_LT(apart(truth, result.reference_from_points), apart(truth, {})) << "one step nearer";
}

TEST_P(IcpOfBothMetrics, WorksWithoutAnyNormals) {
    Surface room = surface_of(scan_at(irregular_room(), {}));
    room.normals.assign(room.size(), Point2::Zero());
    const Pose2d truth(0.1, -0.1, 0.05);
    const IcpResult result = align(moved(room, truth), Reference(room), {}, config_of(GetParam()));
    EXPECT_TRUE(result.usable());
    EXPECT_THAT(result.reference_from_points, PoseNear(truth, 0.01, radians(1.1)));
}

TEST_P(IcpOfBothMetrics, AMergedReferenceServesAsWellAsASingleScan) {
    const World world = irregular_room();
    Surface merged;
    for (const Pose2d& pose : {Pose2d(), Pose2d(0.3, 0.2, 0.4), Pose2d(-0.4, 0.1, -0.3)}) {
        merged.append(transform(pose, surface_of(scan_at(world, pose))));
    }
    const Pose2d truth(0.15, -0.1, 0.1);
    IcpConfig config = config_of(GetParam());
    config.kernel = IcpKernel::kCauchy;
    const IcpResult result =
        align(surface_of(scan_at(world, truth)), Reference(merged), {}, config);
    EXPECT_TRUE(result.usable());
    EXPECT_THAT(result.reference_from_points, PoseNear(truth, 0.02, 0.005));
}

INSTANTIATE_TEST_SUITE_P(Metrics, IcpOfBothMetrics,
                         ::testing::Values(IcpMetric::kPointToPoint, IcpMetric::kPointToLine),
                         [](const auto& test) {
                             return test.param == IcpMetric::kPointToPoint ? "PointToPoint"
                                                                           : "PointToLine";
                         });

TEST(Icp, OutliersPullWithoutAKernelAndHardlyWithOne) {
    const World world = irregular_room();
    Scan scan = scan_at(world, {});
    for (std::size_t beam = 100; beam < 160; ++beam) {
        scan.ranges[beam] -= 0.3F;
    }
    IcpConfig config = config_of(IcpMetric::kPointToLine);
    config.min_distance = 2.0;  // the gate alone would leave the outliers out
    const Reference reference(surface_of(scan_at(world, {})));
    const double plain =
        apart({}, align(surface_of(scan), reference, {}, config).reference_from_points);
    config.kernel = IcpKernel::kCauchy;
    config.kernel_scale = 0.02;
    config.kernel_gate_ratio = 0.0;
    const double robust =
        apart({}, align(surface_of(scan), reference, {}, config).reference_from_points);
    EXPECT_GT(plain, 0.03);
    EXPECT_LT(robust, 0.2 * plain);
}

TEST(Icp, DoesNotTakeTheBackOfAWallForItsFront) {
    // A partition, 12 cm thick, of which the scan sees the front; by the guess it lies nearer to
    // the back. The wall across holds the other direction.
    Surface both_faces;
    for (int i = -40; i <= 40; ++i) {
        both_faces.append({{{0.05 * i, 2.0}, {0.05 * i, 2.12}}, {{0.0, -1.0}, {0.0, 1.0}}});
        both_faces.append({{{3.0, 0.05 * i}}, {{-1.0, 0.0}}});
    }
    Surface scan;
    for (std::size_t i = 0; i < both_faces.size(); ++i) {
        if (both_faces.normals[i].y() < 0.5) {
            scan.append({{both_faces.points[i]}, {both_faces.normals[i]}});
        }
    }
    IcpConfig config = config_of(IcpMetric::kPointToLine);
    const Reference reference(both_faces);
    const IcpGuess guess{Pose2d(0.0, 0.08, 0.0)};
    config.max_normal_angle = radians(50.0);
    EXPECT_EQ(align(scan, reference, guess, config).status, IcpStatus::kDegenerate)
        << "better no answer than the back";
    EXPECT_LT(
        apart({}, align(scan, reference, {Pose2d(0.0, 0.04, 0.0)}, config).reference_from_points),
        1e-6);
    config.max_normal_angle = kPi;
    EXPECT_NEAR(align(scan, reference, guess, config).reference_from_points.y(), 0.12, 1e-6)
        << "without looking at normals the back is as good";
}

TEST(Icp, NamesItsStatus) {
    EXPECT_EQ(to_string(IcpStatus::kConverged), "converged");
    EXPECT_EQ(to_string(IcpStatus::kMaxIterations), "max_iterations");
    EXPECT_EQ(to_string(IcpStatus::kTooFewPairs), "too_few_pairs");
    EXPECT_EQ(to_string(IcpStatus::kDegenerate), "degenerate");
}

}  // namespace
}  // namespace hybrid_slam::test
