// SPDX-License-Identifier: Apache-2.0
#include "motion_solver.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <functional>

#include "sighting_scene.hpp"
#include "support/pose_matchers.hpp"

namespace hybrid_slam::test {
namespace {

CameraOnRobot forklift_camera() {
    return {plain_camera(), CameraMounting()};
}

CameraMounting level_at(double x, double height) {
    CameraMounting mounting;
    mounting.x = x;
    mounting.z = height;
    mounting.pitch = 0.0;
    return mounting;
}

struct Case {
    CameraMounting mounting;
    Eigen::Vector2d before;
    double inverse_depth = 0.0;
    Pose2d motion;
    Eigen::Vector2d tilt;

    CameraOnRobot camera() const { return {plain_camera(), mounting}; }
    Prediction predicted() const {
        return predict(camera(), mounting.robot_from_camera().linear() * before.homogeneous(),
                       inverse_depth, motion, tilt);
    }
};

Case random_case(Rng& rng, int i) {
    Case random;
    random.mounting.x = uniform(rng, -2.0, 2.0);
    random.mounting.y = uniform(rng, -1.0, 1.0);
    random.mounting.z = uniform(rng, 0.3, 3.0);
    random.mounting.yaw = uniform(rng, -kPi, kPi);
    random.mounting.pitch = uniform(rng, -0.5, 1.2);
    random.mounting.roll = uniform(rng, -0.3, 0.3);
    random.before = anywhere_in_image(rng);
    random.inverse_depth = i % 5 == 0 ? 0.0 : uniform(rng, 0.02, 0.9);
    random.motion = {uniform(rng, -0.4, 0.4), uniform(rng, -0.4, 0.4), uniform(rng, -0.3, 0.3)};
    random.tilt = {uniform(rng, -0.02, 0.02), uniform(rng, -0.02, 0.02)};
    return random;
}

TEST(Predict, SaysWhatTheCamerasPosesInSpaceSay) {
    Rng rng(1);
    int seen = 0;
    for (int i = 0; i < 500; ++i) {
        Case random = random_case(rng, i);
        random.inverse_depth = std::max(random.inverse_depth, 1e-3);
        random.tilt.setZero();
        const Prediction prediction = random.predicted();
        const Eigen::Vector3d truth =
            in_camera_now(random.mounting, random.before, random.inverse_depth, random.motion);
        ASSERT_EQ(prediction.ahead, truth.z() * random.inverse_depth > 1e-3);
        if (prediction.ahead) {
            ++seen;
            ASSERT_LT((prediction.now - truth.hnormalized()).norm(), 1e-11);
        }
    }
    EXPECT_GT(seen, 400);
}

TEST(Predict, TiltsAboutTheCamerasOwnAxes) {
    Rng rng(2);
    for (int i = 0; i < 50; ++i) {
        Case random = random_case(rng, i);
        random.motion = Pose2d();
        random.tilt *= 0.05;
        const Eigen::Matrix3d turn = (Eigen::AngleAxisd(random.tilt.x(), Eigen::Vector3d::UnitX()) *
                                      Eigen::AngleAxisd(random.tilt.y(), Eigen::Vector3d::UnitZ()))
                                         .toRotationMatrix();
        const Eigen::Vector3d turned_ray = turn * random.before.homogeneous();
        ASSERT_LT((random.predicted().now - turned_ray.hnormalized()).norm(), 5e-6)
            << "to the first order";
    }
}

TEST(Predict, HasTheDerivativesOfItsOwnChange) {
    constexpr double kStep = 1e-6;
    Rng rng(3);
    int seen = 0;
    for (int i = 0; i < 300; ++i) {
        const Case at = random_case(rng, i);
        const Prediction prediction = at.predicted();
        if (!prediction.ahead || prediction.now.norm() > 2.0) {
            continue;
        }
        ++seen;
        const auto slope = [&](const std::function<void(Case&, double)>& change) {
            Case more = at;
            Case less = at;
            change(more, kStep);
            change(less, -kStep);
            return Eigen::Vector2d((more.predicted().now - less.predicted().now) / (2.0 * kStep));
        };
        Eigen::Matrix<double, 2, 5> numeric;
        numeric.col(0) = slope([](Case& c, double step) { c.motion.translation.x() += step; });
        numeric.col(1) = slope([](Case& c, double step) { c.motion.translation.y() += step; });
        numeric.col(2) = slope([](Case& c, double step) { c.motion.heading += step; });
        numeric.col(3) = slope([](Case& c, double step) { c.tilt.x() += step; });
        numeric.col(4) = slope([](Case& c, double step) { c.tilt.y() += step; });
        ASSERT_LT((prediction.by_motion - numeric).cwiseAbs().maxCoeff(), 1e-7);
        const Eigen::Vector2d by_depth =
            slope([](Case& c, double step) { c.inverse_depth += step; });
        ASSERT_LT((prediction.by_inverse_depth - by_depth).norm(), 1e-7);
    }
    EXPECT_GT(seen, 200);
}

TEST(Predict, WhatIsAtInfinityDoesNotMoveUnderTranslation) {
    Rng rng(4);
    for (int i = 0; i < 50; ++i) {
        Case far = random_case(rng, 0);
        far.motion.heading = 0.0;
        far.tilt.setZero();
        const Prediction prediction = far.predicted();
        ASSERT_TRUE(prediction.ahead);
        EXPECT_LT((prediction.now - far.before).norm(), 1e-12);
        EXPECT_TRUE(prediction.by_motion.leftCols<2>().isZero(0.0));
    }
}

Eigen::Vector3d through(const CameraOnRobot& camera, const Pixel& pixel) {
    return camera.direction(camera.model().ray(pixel).value().head<2>());
}

// A level camera 1 m above the floor sees what lies 2 m ahead at a slope of 1/2, and after half a
// metre at 1/1.5.
TEST(Predict, TheFloorComesNearerAsWorkedByHand) {
    const CameraOnRobot camera(plain_camera(), level_at(0.0, 1.0));
    const auto before = camera.project({2.0, 0.0, 0.0});
    ASSERT_TRUE(before.has_value());
    EXPECT_NEAR(before->y(), 240.0 + 500.0 / 2.0, 1e-9);
    const Eigen::Vector3d direction = through(camera, *before);
    EXPECT_NEAR(camera.floor_inverse_depth(direction), 0.5, 1e-12);
    const Prediction prediction = predict(camera, direction, 0.5, {0.5, 0.0, 0.0}, {0.0, 0.0});
    EXPECT_NEAR(kFocalLength * prediction.now.y() + 240.0, 240.0 + 500.0 / 1.5, 1e-9);
    EXPECT_NEAR(prediction.now.x(), 0.0, 1e-12);
    EXPECT_FALSE(predict(camera, direction, 0.5, {2.5, 0.0, 0.0}, {0.0, 0.0}).ahead);
}

TEST(CameraOnRobot, TheHorizonIsNoFloor) {
    const CameraOnRobot camera(plain_camera(), level_at(0.3, 1.4));
    EXPECT_EQ(camera.floor_inverse_depth(through(camera, {320.0, 240.0})), 0.0);
    EXPECT_LT(camera.floor_inverse_depth(through(camera, {100.0, 200.0})), 0.0);
    EXPECT_NEAR(through(camera.turned_by({0.1, 0.2}), {320.0, 240.0}).z(), -std::sin(0.1), 1e-12);
}

SightBelief nothing_believed() {
    SightBelief belief;
    belief.information = 1e-4 * Eigen::Matrix3d::Identity();
    belief.aim_information = Eigen::Matrix2d::Identity() / std::pow(radians(0.3), 2);
    return belief;
}

Pose2d random_motion(Rng& rng) {
    return {uniform(rng, -0.05, 0.3), uniform(rng, -0.05, 0.05), uniform(rng, -0.12, 0.12)};
}

Scene mixed_scene(const Pose2d& motion, unsigned seed) {
    Scene scene({}, motion, seed);
    scene.add(Kind::kFloor, 60);
    scene.add(Kind::kWall, 40);
    scene.add(Kind::kUnknown, 40);
    return scene;
}

TEST(SolveMotion, FindsExactMotionsExactly) {
    Rng rng(5);
    for (unsigned run = 0; run < 30; ++run) {
        const Pose2d motion = random_motion(rng);
        Scene scene = mixed_scene(motion, run);
        const SolvedMotion solved =
            solve_motion(forklift_camera(), scene.sightings, nothing_believed());
        ASSERT_THAT(solved.before_from_now, PoseNear(motion, 1e-6, 1e-6));
        ASSERT_LT(solved.tilt.norm(), 1e-6);
        ASSERT_EQ(solved.inliers, 140U);
        ASSERT_EQ(solved.floor_inliers, 60U);
    }
}

TEST(SolveMotion, FloorAloneIsEnoughAndWallsOfKnownDepthToo) {
    const Pose2d motion(0.2, 0.01, -0.05);
    for (const Kind kind : {Kind::kFloor, Kind::kWall}) {
        Scene scene({}, motion, 6);
        scene.add(kind, 50);
        EXPECT_THAT(
            solve_motion(forklift_camera(), scene.sightings, nothing_believed()).before_from_now,
            PoseNear(motion, 1e-6, 1e-6));
    }
}

TEST(SolveMotion, ATurnAboutTheAxleIsNoTranslationOfACameraAheadOfIt) {
    for (const double angle : {-0.15, 0.02, 0.15}) {
        Scene scene = mixed_scene({0.0, 0.0, angle}, 7);
        const SolvedMotion solved =
            solve_motion(forklift_camera(), scene.sightings, nothing_believed());
        EXPECT_THAT(solved.before_from_now, PoseNear(Pose2d(0.0, 0.0, angle), 1e-6, 1e-6));
        // The same as seen by a camera that believes to sit above the axle.
        CameraMounting above = CameraMounting();
        above.x = 0.0;
        const Pose2d wrong =
            solve_motion({plain_camera(), above}, scene.sightings, nothing_believed())
                .before_from_now;
        EXPECT_NEAR(wrong.y(), 1.2 * std::sin(angle), 2e-3);
    }
}

TEST(SolveMotion, AThirdOfNonsenseDoesLittle) {
    Rng rng(8);
    for (unsigned run = 0; run < 20; ++run) {
        const Pose2d motion = random_motion(rng);
        Scene scene = mixed_scene(motion, run);
        for (std::size_t i = 0; i < scene.sightings.size(); ++i) {
            if (i % 10 < 3) {
                scene.sightings[i].now = anywhere_in_image(rng);
            }
        }
        const SolvedMotion solved =
            solve_motion(forklift_camera(), scene.sightings, nothing_believed());
        ASSERT_THAT(solved.before_from_now, PoseNear(motion, 3e-3, 1e-3)) << run;
        for (std::size_t i = 0; i < scene.sightings.size(); ++i) {
            ASSERT_TRUE(scene.sightings[i].inlier || i % 10 < 3) << run << ", sighting " << i;
        }
    }
}

TEST(SolveMotion, WhatLiesOnAPalletInsteadOfTheFloorDoesNotDrag) {
    const Pose2d motion(0.25, 0.0, 0.03);
    Scene scene = mixed_scene(motion, 9);
    scene.pallet = 0.3;
    scene.add(Kind::kFloor, 30);
    const SolvedMotion solved =
        solve_motion(forklift_camera(), scene.sightings, nothing_believed());
    EXPECT_THAT(solved.before_from_now, PoseNear(motion, 2e-3, 5e-4));
    const auto kept = std::count_if(
        scene.sightings.begin() + 140, scene.sightings.end(),
        [](const Sighting& sighting) { return sighting.on_floor && sighting.inlier; });
    EXPECT_LE(kept, 3);
    EXPECT_GE(solved.floor_inliers, 55U);
}

TEST(SolveMotion, WithoutAnyKnownDepthTheWayIsTheBeliefs) {
    const Pose2d motion(0.2, 0.0, 0.04);
    Scene scene({}, motion, 10);
    scene.add(Kind::kUnknown, 120);
    SightBelief belief = nothing_believed();
    belief.before_from_now = {0.25, 0.0, 0.0};
    belief.information = Eigen::Vector3d(1e4, 1e4, 1e-2).asDiagonal();
    const SolvedMotion solved = solve_motion(forklift_camera(), scene.sightings, belief);
    EXPECT_NEAR(solved.before_from_now.x(), 0.25, 0.02);
    EXPECT_NEAR(solved.before_from_now.heading, 0.04, 2e-3) << "which depth does not tell";
    Scene known = mixed_scene(motion, 10);
    const SolvedMotion better = solve_motion(forklift_camera(), known.sightings, belief);
    EXPECT_LT(solved.information(0, 0), 0.02 * better.information(0, 0));
    EXPECT_GT(solved.information(2, 2), 0.05 * better.information(2, 2));
}

TEST(SolveMotion, NothingSeenIsWhatWasBelieved) {
    std::vector<Sighting> none;
    SightBelief belief = nothing_believed();
    belief.before_from_now = {0.1, 0.02, -0.03};
    const SolvedMotion solved = solve_motion(forklift_camera(), none, belief);
    EXPECT_THAT(solved.before_from_now, PoseNear(belief.before_from_now, 1e-9, 1e-9));
    EXPECT_TRUE(solved.information.isZero(1e-9));
    EXPECT_EQ(solved.inliers, 0U);
}

TEST(SolveMotion, ClaimsTheErrorsThatItMakes) {
    constexpr int kRuns = 80;
    Rng rng(11);
    const double tilt_sigma = radians(0.05);
    const double aim_sigma = radians(0.3);
    double normalized = 0.0;
    for (unsigned run = 0; run < kRuns; ++run) {
        const Pose2d motion = random_motion(rng);
        CameraMounting mounting;
        mounting.pitch += gauss(rng, aim_sigma);
        mounting.yaw += gauss(rng, aim_sigma);
        Scene scene(mounting, motion, run);
        scene.noise = 0.25;
        scene.tilt = {gauss(rng, tilt_sigma), gauss(rng, tilt_sigma)};
        scene.add(Kind::kFloor, 50);
        scene.add(Kind::kUnknown, 40);
        SightBelief belief = nothing_believed();
        belief.tilt_sigma = tilt_sigma;
        belief.aim_information = Eigen::Matrix2d::Identity() / (aim_sigma * aim_sigma);
        const SolvedMotion solved = solve_motion(forklift_camera(), scene.sightings, belief);
        const Eigen::Vector3d error(solved.before_from_now.x() - motion.x(),
                                    solved.before_from_now.y() - motion.y(),
                                    solved.before_from_now.heading - motion.heading);
        normalized += error.dot(solved.information * error) / 3.0 / kRuns;
    }
    EXPECT_LT(normalized, 1.5) << "claims too much";
    EXPECT_GT(normalized, 0.4) << "claims too little";
}

TEST(SolveMotion, DrivingStraightShowsWhereTheCameraReallyLooks) {
    CameraMounting mounting;
    mounting.pitch += radians(0.4);
    mounting.yaw -= radians(0.3);
    const Pose2d motion(0.3, 0.0, 0.0);
    Scene scene(mounting, motion, 12);
    scene.add(Kind::kFloor, 100);
    scene.add(Kind::kUnknown, 60);
    // The floor's depths are believed by how the camera ought to look.
    const CameraOnRobot camera = forklift_camera();
    for (Sighting& sighting : scene.sightings) {
        if (sighting.floor) {
            sighting.belief.inverse_depth =
                camera.floor_inverse_depth(camera.direction(sighting.before));
        }
    }
    SightBelief belief = nothing_believed();
    belief.information = Eigen::Vector3d(1e-2, 1e8, 1e-2).asDiagonal();  // never sideways
    belief.tilt_sigma = radians(0.005);
    belief.aim_information = Eigen::Matrix2d::Identity() / std::pow(radians(2.0), 2);
    const SolvedMotion solved = solve_motion(camera, scene.sightings, belief);
    EXPECT_NEAR(degrees(solved.aim.x()), 0.4, 0.03);
    EXPECT_NEAR(degrees(solved.aim.y()), -0.3, 0.03);
    EXPECT_THAT(solved.before_from_now, PoseNear(motion, 1e-3, radians(0.02)));
    EXPECT_LT(std::sqrt(solved.aim_information.inverse().diagonal().maxCoeff()), radians(0.5));
}

}  // namespace
}  // namespace hybrid_slam::test
