// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/calibration/ground_calibration.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <random>

#include "board_rendering.hpp"
#include "support/error_of.hpp"

namespace hybrid_slam::test {
namespace {

using Points = std::vector<Eigen::Vector2d>;
using Rng = std::mt19937;

double uniform(Rng& rng, double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(rng);
}

Eigen::Matrix3d of_unit_norm(const Eigen::Matrix3d& matrix) {
    return matrix / matrix.norm();
}

/// Up to the sign, which a homography leaves open.
double difference(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
    return std::min((of_unit_norm(a) - of_unit_norm(b)).norm(),
                    (of_unit_norm(a) + of_unit_norm(b)).norm());
}

/// (x, y) -> (2 x + 1, 3 y - 2) / (1 + y), worked out by hand at the corners of a square.
TEST(FitHomography, AgreesWithPointsWorkedByHand) {
    Eigen::Matrix3d expected;
    expected << 2, 0, 1, 0, 3, -2, 0, 1, 1;
    const Points from{{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    const Points to{{1, -2}, {3, -2}, {1.5, 0.5}, {0.5, 0.5}};
    EXPECT_LT(difference(fit_homography(from, to), expected), 1e-12);
}

TEST(FitHomography, RecoversAnyFromManyPoints) {
    Rng rng(1);
    for (int trial = 0; trial < 50; ++trial) {
        Eigen::Matrix3d truth = Eigen::Matrix3d::Identity();
        for (int i = 0; i < 8; ++i) {
            truth(i / 3, i % 3) += uniform(rng, -0.3, 0.3);
        }
        Points from;
        Points to;
        for (int i = 0; i < 8; ++i) {
            from.emplace_back(uniform(rng, -1, 1), uniform(rng, -1, 1));
            to.push_back((truth * from.back().homogeneous()).hnormalized());
        }
        EXPECT_LT(difference(fit_homography(from, to), truth), 1e-9);
    }
}

/// Without normalisation the columns of A differ by ten powers of ten here.
TEST(FitHomography, TakesPixelsFarFromTheOrigin) {
    Eigen::Matrix3d truth;
    truth << 1e-3, 2e-4, -3.0, -1e-4, 2e-3, 1.0, 1e-6, 3e-5, 1.0;
    Points from;
    Points to;
    for (int i = 0; i < 12; ++i) {
        from.emplace_back(5000.0 + 100.0 * (i % 4), 7000.0 + 80.0 * (i / 4));  // NOLINT
        to.push_back((truth * from.back().homogeneous()).hnormalized());
    }
    const Eigen::Matrix3d found = fit_homography(from, to);
    for (std::size_t i = 0; i < from.size(); ++i) {
        EXPECT_LT(((found * from[i].homogeneous()).hnormalized() - to[i]).norm(), 1e-9);
    }
}

TEST(FitHomography, RefusesWhatDeterminesNone) {
    const Points square{{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    EXPECT_EQ(error_of([&] {
                  fit_homography({{0, 0}, {1, 0}, {1, 1}}, {{0, 0}, {1, 0}, {1, 1}});
              }),
              "a homography needs four points on both sides, not 3 and 3");
    EXPECT_EQ(error_of([&] {
                  fit_homography(square, {{0, 0}, {1, 0}, {1, 1}});
              }),
              "a homography needs four points on both sides, not 4 and 3");
    const std::string line = "the points determine no homography: too many of them lie on one line";
    EXPECT_EQ(error_of([&] { fit_homography({{0, 0}, {1, 0}, {2, 0}, {0, 1}}, square); }), line);
    EXPECT_EQ(error_of([&] { fit_homography(square, {{0, 0}, {1, 1}, {2, 2}, {3, 3}}); }), line);
    EXPECT_EQ(error_of([&] { fit_homography({{0, 0}, {1, 2}, {2, 4}, {3, 6}}, square); }), line);
    EXPECT_EQ(error_of([&] {
                  fit_homography({{1, 1}, {1, 1}, {1, 1}, {1, 1}}, square);
              }),
              "all points of the floor are one");
}

/// A camera that stands somewhere behind a tile and looks at it.
struct Scene {
    CameraModel model;
    CameraMounting mounting;
    Pose2d robot_from_tile;
    double side = 0.6;

    /// Near left, near right, far right, far left.
    std::vector<Pixel> corners() const {
        const Eigen::Isometry3d camera_from_robot = mounting.robot_from_camera().inverse();
        std::vector<Pixel> pixels;
        for (const Eigen::Vector2d& corner :
             Points{{-0.5, 0.5}, {-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}}) {
            const Eigen::Vector2d floor = robot_from_tile * Eigen::Vector2d(side * corner);
            pixels.push_back(
                *model.project(camera_from_robot * Eigen::Vector3d(floor.x(), floor.y(), 0.0)));
        }
        return pixels;
    }

    GroundCalibration calibrate() const {
        return calibrate_ground(model, tile_points(model, corners(), side));
    }
};

/// All of the tile is in the image, and none of its edges nearly faces a corner of it.
Scene random_scene(Rng& rng) {
    Scene scene;
    scene.side = uniform(rng, 0.2, 1.0);
    scene.mounting.x = uniform(rng, -1.0, 2.0);
    scene.mounting.y = uniform(rng, -0.5, 0.5);
    scene.mounting.z = uniform(rng, 0.3, 3.0);
    scene.mounting.yaw = uniform(rng, -0.6, 0.6);
    scene.mounting.pitch = uniform(rng, 0.1, 1.2);
    scene.mounting.roll = uniform(rng, -0.3, 0.3);
    const double ahead = scene.mounting.z / std::tan(scene.mounting.pitch);
    const Pose2d robot_from_camera(scene.mounting.x, scene.mounting.y, scene.mounting.yaw);
    scene.robot_from_tile =
        robot_from_camera * Pose2d(std::max(ahead, scene.side), 0.0, uniform(rng, -0.6, 0.6));
    return scene;
}

TEST(GroundCalibration, RecoversHeightPitchAndRollExactly) {
    Rng rng(2);
    for (int trial = 0; trial < 200; ++trial) {
        const Scene scene = random_scene(rng);
        const GroundCalibration found = scene.calibrate();
        EXPECT_NEAR(found.mounting.z, scene.mounting.z, 1e-6);
        EXPECT_NEAR(found.mounting.pitch, scene.mounting.pitch, 1e-6);
        EXPECT_NEAR(found.mounting.roll, scene.mounting.roll, 1e-6);
        EXPECT_LT(found.rms, 1e-6);
        EXPECT_LT(found.homography_rms, 1e-6);
        EXPECT_FALSE(found.cornerwise());
    }
}

TEST(GroundCalibration, RecoversTheWholeMountingWithTheTilesPose) {
    Rng rng(3);
    for (int trial = 0; trial < 100; ++trial) {
        const Scene scene = random_scene(rng);
        const CameraMounting found =
            mounting_on_robot(scene.calibrate(), CameraMounting(), scene.robot_from_tile);
        const Eigen::Isometry3d expected = scene.mounting.robot_from_camera();
        EXPECT_TRUE(found.robot_from_camera().isApprox(expected, 1e-6));
        EXPECT_NEAR(found.x, scene.mounting.x, 1e-6);
        EXPECT_NEAR(found.y, scene.mounting.y, 1e-6);
        EXPECT_NEAR(found.yaw, scene.mounting.yaw, 1e-6);
    }
}

TEST(GroundCalibration, WithoutATilePoseXYAndYawStay) {
    Rng rng(4);
    const Scene scene = random_scene(rng);
    CameraMounting before;
    before.x = 0.7;
    before.y = -0.2;
    before.yaw = 0.05;
    const CameraMounting found = mounting_on_robot(scene.calibrate(), before, std::nullopt);
    EXPECT_EQ(found.x, 0.7);
    EXPECT_EQ(found.y, -0.2);
    EXPECT_EQ(found.yaw, 0.05);
    EXPECT_NEAR(found.z, scene.mounting.z, 1e-6);
    EXPECT_NEAR(found.pitch, scene.mounting.pitch, 1e-6);
    EXPECT_NEAR(found.roll, scene.mounting.roll, 1e-6);
}

TEST(GroundCalibration, TheOrderOfTheCornersDoesNotMatter) {
    Rng rng(5);
    const Scene scene = random_scene(rng);
    const GroundCalibration expected = scene.calibrate();
    std::vector<Pixel> corners = scene.corners();
    std::sort(corners.begin(), corners.end(),
              [](const Pixel& a, const Pixel& b) { return a.x() < b.x(); });
    int orders = 0;
    const auto before = [](const Pixel& a, const Pixel& b) { return a.x() < b.x(); };
    do {
        const GroundCalibration found =
            calibrate_ground(scene.model, tile_points(scene.model, corners, scene.side));
        EXPECT_TRUE(found.patch_from_camera.isApprox(expected.patch_from_camera, 1e-9));
        ++orders;
    } while (std::next_permutation(corners.begin(), corners.end(), before));
    EXPECT_EQ(orders, 24);
}

/// The homography takes pixels to metres as the true geometry does, in the frame of the tile.
TEST(GroundCalibration, HomographyMapsTheFloor) {
    Rng rng(6);
    const Scene scene = random_scene(rng);
    const GroundCalibration found = scene.calibrate();
    const Eigen::Isometry3d camera_from_robot = scene.mounting.robot_from_camera().inverse();
    for (int i = 0; i < 20; ++i) {
        const Eigen::Vector2d in_tile(uniform(rng, -0.5, 0.5), uniform(rng, -0.5, 0.5));
        const Eigen::Vector2d floor = scene.robot_from_tile * in_tile;
        const Eigen::Vector3d seen = camera_from_robot * Eigen::Vector3d(floor.x(), floor.y(), 0.0);
        const Eigen::Vector2d back = (found.patch_from_image * seen).hnormalized();
        EXPECT_LT((back - in_tile).norm(), 1e-6);
    }
}

TEST(GroundCalibration, SaysHowMuchAPixelMatters) {
    Rng rng(7);
    Scene scene;
    scene.robot_from_tile = {scene.mounting.x + 2.2, 0.1, 0.2};
    const GroundCalibration exact = scene.calibrate();
    constexpr double kSigma = 0.2;  // pixels
    constexpr int kTrials = 2000;
    std::normal_distribution<double> noise(0.0, kSigma);
    Eigen::Array3d squares = Eigen::Array3d::Zero();
    double squared_rms = 0.0;
    for (int trial = 0; trial < kTrials; ++trial) {
        std::vector<Pixel> corners = scene.corners();
        for (Pixel& corner : corners) {
            corner += Pixel(noise(rng), noise(rng));
        }
        const GroundCalibration found =
            calibrate_ground(scene.model, tile_points(scene.model, corners, scene.side));
        squares += Eigen::Array3d(found.mounting.z - scene.mounting.z,
                                  found.mounting.pitch - scene.mounting.pitch,
                                  found.mounting.roll - scene.mounting.roll)
                       .square();
        squared_rms += found.rms * found.rms;
        EXPECT_LT(found.homography_rms, 1e-6) << "four points always fit";
    }
    const Eigen::Array3d deviations = (squares / kTrials).sqrt() / kSigma;
    EXPECT_NEAR(deviations(0) / exact.height_per_pixel, 1.0, 0.08);
    EXPECT_NEAR(deviations(1) / exact.pitch_per_pixel, 1.0, 0.08);
    EXPECT_NEAR(deviations(2) / exact.roll_per_pixel, 1.0, 0.08);
    // Eight numbers, six of which the pose takes up: 2 sigma^2 are left for four points.
    EXPECT_NEAR(squared_rms / kTrials, 2.0 * kSigma * kSigma / 4.0, 0.1 * kSigma * kSigma);
}

TEST(GroundCalibration, TellsATileThatLiesCornerwise) {
    Scene scene;
    scene.robot_from_tile = {scene.mounting.x + 2.5, 0.0, radians(43.0)};
    EXPECT_TRUE(scene.calibrate().cornerwise());
    scene.robot_from_tile.heading = radians(35.0);
    EXPECT_FALSE(scene.calibrate().cornerwise());
    // Beyond 45 degrees another edge is the near one.
    scene.robot_from_tile.heading = radians(80.0);
    EXPECT_NEAR(scene.calibrate().mounting.yaw, radians(10.0), 1e-6);
}

TEST(GroundCalibration, WorksForACameraThatHangsUpsideDown) {
    Scene scene;
    scene.mounting.roll = radians(179.0);
    scene.robot_from_tile = {scene.mounting.x + 2.5, 0.0, 0.1};
    const GroundCalibration found = scene.calibrate();
    EXPECT_NEAR(found.mounting.roll, radians(179.0), 1e-6);
    EXPECT_NEAR(found.mounting.pitch, scene.mounting.pitch, 1e-6);
}

TEST(GroundCalibration, AWrongSideScalesTheHeightAlone) {
    Scene scene;
    scene.robot_from_tile = {scene.mounting.x + 2.5, 0.0, 0.1};
    const GroundCalibration found =
        calibrate_ground(scene.model, tile_points(scene.model, scene.corners(), 0.3));
    EXPECT_NEAR(found.mounting.z, 0.5 * scene.mounting.z, 1e-6);
    EXPECT_NEAR(found.mounting.pitch, scene.mounting.pitch, 1e-6);
}

TEST(TilePoints, RefusesWhatIsNoTile) {
    const CameraModel model;
    const auto refusal = [&](const std::vector<Pixel>& corners, double side) {
        return error_of([&] { tile_points(model, corners, side); });
    };
    const std::vector<Pixel> good{{200, 400}, {400, 400}, {380, 300}, {220, 300}};
    EXPECT_EQ(refusal({{1, 1}, {2, 2}, {3, 1}}, 0.6), "a tile has four corners, not 3");
    EXPECT_EQ(refusal(good, 0.0), "a tile must be 0.01 to 100 m wide, not 0");
    const std::string no_tile =
        "the four corners do not look like a tile: three of them lie on one line, or one lies "
        "between the others";
    EXPECT_EQ(refusal({{200, 400}, {300, 400}, {400, 400}, {300, 300}}, 0.6), no_tile);
    EXPECT_EQ(refusal({{200, 400}, {400, 400}, {300, 350}, {300, 200}}, 0.6), no_tile);
    EXPECT_EQ(refusal({{200, 400}, {200, 400}, {400, 400}, {300, 300}}, 0.6), no_tile);
    for (std::size_t i = 0; i < 4; ++i) {  // whichever it is that lies between the others
        std::vector<Pixel> three = good;
        three[i] = 0.5 * (good[(i + 1) % 4] + good[(i + 2) % 4]) + Pixel(0.0, 0.5);
        EXPECT_EQ(refusal(three, 0.6), no_tile);
    }
    EXPECT_EQ(refusal({{100, 400}, {200, 400}, {300, 400}, {400, 400}}, 0.6), no_tile);
    // Off the middle, distortion bends a line into something convex.
    for (const double k1 : {-0.3, 0.3}) {
        CameraModel bending;
        bending.k1 = k1;
        const std::vector<Pixel> line{{100, 450}, {250, 450}, {400, 450}, {550, 450}};
        EXPECT_EQ(error_of([&] { tile_points(bending, line, 0.6); }), no_tile);
        std::vector<Pixel> bent;
        for (const double x : {-0.4, -0.15, 0.15, 0.4}) {
            bent.push_back(*bending.project({x, 0.35, 1.0}));
        }
        EXPECT_EQ(error_of([&] { tile_points(bending, bent, 0.6); }), no_tile);
    }
    CameraModel barrel;
    barrel.k1 = -0.5;
    barrel.k2 = 0.0;
    EXPECT_EQ(error_of([&] {
                  tile_points(barrel, {{200, 400}, {20000, 400}, {380, 300}, {220, 300}}, 0.6);
              }),
              "the camera model has no direction for pixel 20000.0,400.0");
}

/// A board on the floor, rendered, found and measured.
TEST(BoardPoints, ABoardOnTheFloorTellsTheHeight) {
    const Chessboard board{7, 5, 0.06};
    const CameraModel model = small_camera();
    CameraMounting mounting;
    mounting.z = 0.8;
    mounting.pitch = radians(40.0);
    mounting.roll = radians(-3.0);
    // As it lies there, it is seen from above: its z axis points into the floor.
    Eigen::Isometry3d robot_from_board(Eigen::AngleAxisd(radians(95.0), Eigen::Vector3d::UnitZ()) *
                                       Eigen::AngleAxisd(kPi, Eigen::Vector3d::UnitX()));
    const Eigen::Vector3d middle(0.18, 0.12, 0.0);
    const Pose2d patch(mounting.x + 0.95, 0.05, radians(5.0));
    robot_from_board.translation() =
        Eigen::Vector3d(patch.x(), patch.y(), 0.0) - robot_from_board.linear() * middle;
    const Image image = BoardRenderer(model, board)
                            .render(mounting.robot_from_camera().inverse() * robot_from_board);
    const auto sight = find_board(image, board);
    ASSERT_TRUE(sight);
    const GroundCalibration ground = calibrate_ground(model, board_points(sight->corners, board));
    EXPECT_LT(ground.rms, 0.2);
    EXPECT_LT(ground.homography_rms, 0.2);
    EXPECT_GT(ground.homography_rms, 0.0);
    const CameraMounting found = mounting_on_robot(ground, mounting, patch);
    EXPECT_NEAR(found.z, mounting.z, 0.003);
    EXPECT_NEAR(found.pitch, mounting.pitch, radians(0.2));
    EXPECT_NEAR(found.roll, mounting.roll, radians(0.2));
    EXPECT_NEAR(found.x, mounting.x, 0.005);
    EXPECT_NEAR(found.y, mounting.y, 0.005);
    EXPECT_NEAR(found.yaw, mounting.yaw, radians(0.2));
}

/// Corners counted from the other side are a mirror image; the floor is not to lie above the
/// camera.
TEST(BoardPoints, TheOrderOfColumnsDoesNotMatter) {
    const Chessboard board{4, 3, 0.1};
    Scene scene;
    const Eigen::Isometry3d camera_from_robot = scene.mounting.robot_from_camera().inverse();
    for (const double side : {1.0, -1.0}) {
        std::vector<Pixel> corners;
        for (int i = 0; i < 12; ++i) {
            const Eigen::Vector3d at(3.0 + 0.1 * (i % 4), side * 0.1 * (i / 4), 0.0);  // NOLINT
            corners.push_back(*scene.model.project(camera_from_robot * at));
        }
        const GroundCalibration found = calibrate_ground(scene.model, board_points(corners, board));
        EXPECT_NEAR(found.mounting.z, scene.mounting.z, 1e-6);
        EXPECT_NEAR(found.mounting.roll, scene.mounting.roll, 1e-6);
    }
    EXPECT_EQ(error_of([&] {
                  board_points({{1, 1}}, board);
              }),
              "a board of 4 x 3 inner corners has 12 of them, not 1");
}

TEST(MountingOf, InvertsRobotFromCamera) {
    Rng rng(8);
    for (int trial = 0; trial < 50; ++trial) {
        CameraMounting mounting;
        mounting.yaw = uniform(rng, -3.1, 3.1);
        mounting.pitch = uniform(rng, -1.5, 1.5);
        mounting.roll = uniform(rng, -3.1, 3.1);
        const CameraMounting found = mounting_of(mounting.robot_from_camera());
        EXPECT_NEAR(found.yaw, mounting.yaw, 1e-9);
        EXPECT_NEAR(found.pitch, mounting.pitch, 1e-9);
        EXPECT_NEAR(found.roll, mounting.roll, 1e-9);
        EXPECT_DOUBLE_EQ(found.x, mounting.x);
        EXPECT_DOUBLE_EQ(found.z, mounting.z);
    }
}

}  // namespace
}  // namespace hybrid_slam::test
