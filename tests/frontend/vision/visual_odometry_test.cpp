// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/vision/visual_odometry.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <functional>
#include <memory>
#include <opencv2/imgproc.hpp>

#include "rendered_ride.hpp"
#include "support/error_of.hpp"
#include "support/pose_matchers.hpp"

namespace hybrid_slam::test {
namespace {

using testing::HasSubstr;

const Pose2d kStart(-3.0, -1.0, 0.2);
const Eigen::Vector3d kStraight(0.6, 0.0, 0.0);
const Eigen::Vector3d kBend(0.5, 0.0, 0.5);
const Eigen::Vector3d kTurn(0.0, 0.0, 0.5);

Ride forklift_ride(const Eigen::Vector3d& twist, int images) {
    return ride(irregular_room(), CameraMounting(), kStart, twist, images);
}

/// Rendered once for all tests.
const Ride& straight_ride() {
    static const Ride straight = forklift_ride(kStraight, 16);
    return straight;
}

VisualOdometry joint() {
    return {CameraModel(), CameraMounting()};
}

cv::Mat pixels_of(Image& image) {
    return {image.height, image.width, CV_8UC3, image.pixels.data()};
}

Scan scan_of(const Pose2d& pose, double stamp) {
    Lidar lidar;
    lidar.beams = 541;
    lidar.field_of_view = radians(270.5);
    Scan scan = scan_at(irregular_room(), pose, lidar);
    scan.stamp = stamp;
    return scan;
}

struct WayTest {
    const char* name;
    Eigen::Vector3d twist;
    bool with_scans;
};

class VisualOdometryOnItsWay : public testing::TestWithParam<WayTest> {};

TEST_P(VisualOdometryOnItsWay, MeasuresIt) {
    const Ride way = forklift_ride(GetParam().twist, 24);
    VisualOdometry odometry = joint();
    std::vector<VisualMotion> motions;
    for (std::size_t i = 0; i < way.images.size(); ++i) {
        if (GetParam().with_scans && i % 3 == 0) {
            odometry.see(scan_of(way.truth[i].pose, way.truth[i].stamp));
        }
        motions.push_back(odometry.track(way.images[i]));
    }
    EXPECT_EQ(motions[0].status, VisualStatus::kFirst);
    EXPECT_EQ(motions[0].from_stamp, motions[0].stamp);
    for (std::size_t i = 1; i < motions.size(); ++i) {
        ASSERT_EQ(motions[i].status, VisualStatus::kGood) << i;
        ASSERT_EQ(motions[i].from_stamp, way.truth[i - 1].stamp);
        ASSERT_EQ(motions[i].stamp, way.truth[i].stamp);
        ASSERT_THAT(motions[i].before_from_now, PoseNear(way.step(i), 0.01, radians(0.3))) << i;
        const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(motions[i].covariance);
        ASSERT_GT(solver.eigenvalues()(0), 0.0) << i;
        ASSERT_LT(std::sqrt(solver.eigenvalues()(2)), 0.05) << i;
    }
    EXPECT_THAT(sum_of(motions), PoseNear(way.moved(), 0.02, radians(0.4)));
}

INSTANTIATE_TEST_SUITE_P(Ways, VisualOdometryOnItsWay,
                         testing::Values(WayTest{"StraightOn", kStraight, false},
                                         WayTest{"StraightOnWithScans", kStraight, true},
                                         WayTest{"AroundABend", kBend, false},
                                         WayTest{"AroundABendWithScans", kBend, true},
                                         WayTest{"TurningOnTheSpot", kTurn, true},
                                         WayTest{"BackWithScans", {-0.5, 0.0, 0.0}, true}),
                         [](const auto& test) { return test.param.name; });

TEST(VisualOdometry, StandingStillIsNoMotion) {
    const Ride still = forklift_ride({0.0, 0.0, 0.0}, 6);
    VisualOdometry odometry = joint();
    const auto motions = track_all(odometry, still);
    for (std::size_t i = 1; i < motions.size(); ++i) {
        EXPECT_EQ(motions[i].status, VisualStatus::kGood);
        EXPECT_THAT(motions[i].before_from_now, PoseNear(Pose2d(), 3e-3, radians(0.1)));
    }
}

TEST(VisualOdometry, IsTheSameToTheBitWhenRepeated) {
    VisualOdometry first = joint();
    VisualOdometry second = joint();
    for (std::size_t i = 0; i < 12; ++i) {
        const VisualMotion a = first.track(straight_ride().images[i]);
        const VisualMotion b = second.track(straight_ride().images[i]);
        ASSERT_EQ(a.status, b.status);
        ASSERT_EQ(a.before_from_now.vector(), b.before_from_now.vector());
        ASSERT_EQ(a.covariance, b.covariance);
    }
}

TEST(VisualOdometry, ShowsWhatItFollowed) {
    VisualOdometry odometry = joint();
    const Ride& way = straight_ride();
    odometry.track(way.images[0]);
    EXPECT_TRUE(odometry.features().empty());
    odometry.track(way.images[1]);
    ASSERT_GE(odometry.features().size(), 40U);
    EXPECT_LE(odometry.features().size(), 160U);
    std::size_t used = 0;
    std::size_t floor = 0;
    for (const auto& feature : odometry.features()) {
        used += feature.used ? 1 : 0;
        floor += feature.floor ? 1 : 0;
        if (feature.used) {
            EXPECT_LT((feature.now - feature.before).norm(), 40.0);
        }
    }
    EXPECT_GE(used, odometry.features().size() / 2);
    EXPECT_GE(floor, 10U);
}

/// Whether the pixel shows floor, by the world alone.
bool shows_floor(const Pixel& pixel, const Pose2d& pose) {
    const Eigen::Isometry3d camera = CameraMounting().robot_from_camera();
    const Eigen::Vector3d direction = camera.linear() * CameraModel().ray(pixel).value();
    const Eigen::Vector2d flat = pose.rotation() * Eigen::Vector2d(direction.head<2>());
    const double wall = irregular_room().cast_ray(
        pose * Eigen::Vector2d(camera.translation().head<2>()), flat.normalized());
    const double floor = -camera.translation().z() / direction.z() * flat.norm();
    return direction.z() < 0.0 && floor < wall;
}

TEST(VisualOdometry, TheScanTellsFloorFromWalls) {
    // A wall close ahead, so that much of it shows below the horizon.
    const Ride way = ride(irregular_room(), CameraMounting(), {1.0, -1.5, 0.3}, kStraight, 2);
    VisualOdometry odometry = joint();
    odometry.see(scan_of(way.truth[0].pose, 0.0));
    track_all(odometry, way);
    int wrong = 0;
    int walls = 0;
    for (const auto& feature : odometry.features()) {
        const bool floor = shows_floor(feature.before, way.truth[0].pose);
        walls += floor ? 0 : 1;
        wrong += feature.used && feature.floor && !floor ? 1 : 0;
    }
    EXPECT_GE(walls, 20);
    EXPECT_LE(wrong, walls / 10);
}

TEST(VisualOdometry, AScanThatHitsSomethingAtOnceLeavesNoFloor) {
    const Ride& way = straight_ride();
    VisualOdometryConfig config;
    Scan box = scan_of(kStart, 0.0);
    std::fill(box.ranges.begin(), box.ranges.end(), 2.4F);
    for (const bool border : {true, false}) {
        config.lidar_border = border;
        VisualOdometry odometry(CameraModel(), CameraMounting(), config);
        odometry.see(box);
        odometry.track(way.images[0]);
        odometry.track(way.images[1]);
        const auto& features = odometry.features();
        const auto floor = std::count_if(features.begin(), features.end(),
                                         [](const auto& feature) { return feature.floor; });
        if (border) {
            EXPECT_EQ(floor, 0);
        } else {
            EXPECT_GE(floor, 10) << "the scan is not asked";
        }
    }
}

/// Says the same of all pixels.
class OneWord : public FloorSegmenter {
  public:
    OneWord(bool floor, int& asked) : floor_(floor), asked_(asked) {}
    FloorMask segment(const Image& image) override {
        EXPECT_EQ(image.width, 640);
        EXPECT_EQ(image.height, 480);
        EXPECT_EQ(image.pixels.size(), static_cast<std::size_t>(640 * 480 * image.channels));
        ++asked_;
        return {image.width, image.height, std::vector<std::uint8_t>(640 * 480, floor_ ? 1 : 0)};
    }

  private:
    bool floor_;
    int& asked_;
};

TEST(VisualOdometry, ASegmenterSaysWhatMayBeFloor) {
    const Ride& way = straight_ride();
    for (const bool floor : {true, false}) {
        int asked = 0;
        VisualOdometry odometry(CameraModel(), CameraMounting(), {},
                                std::make_unique<OneWord>(floor, asked));
        odometry.track(way.images[0]);
        odometry.track(way.images[1]);
        EXPECT_GE(asked, 1);
        const auto count = std::count_if(odometry.features().begin(), odometry.features().end(),
                                         [](const auto& feature) { return feature.floor; });
        if (floor) {
            EXPECT_GE(count, 10);
        } else {
            EXPECT_EQ(count, 0);
        }
    }
}

// ---- images that are no good ----

Ride with_bad_images(const std::function<void(cv::Mat)>& spoil, std::size_t from, std::size_t to) {
    Ride way = straight_ride();
    for (std::size_t i = from; i < to; ++i) {
        spoil(pixels_of(way.images[i]));
    }
    return way;
}

/// After the bad images it goes on by itself.
void expect_recovery(const std::vector<VisualMotion>& motions, const Ride& way, std::size_t from) {
    EXPECT_EQ(motions[from].status, VisualStatus::kFirst) << "nothing to compare with yet";
    EXPECT_FALSE(motions[from].usable());
    for (std::size_t i = from + 1; i < motions.size(); ++i) {
        ASSERT_EQ(motions[i].status, VisualStatus::kGood) << i;
        ASSERT_THAT(motions[i].before_from_now, PoseNear(way.step(i), 0.01, radians(0.3))) << i;
    }
}

TEST(VisualOdometry, ACoveredLensIsTooDark) {
    for (const double level : {0.0, 8.0, 128.0}) {  // nor does an even gray say anything
        const Ride way =
            with_bad_images([&](cv::Mat image) { image.setTo(cv::Scalar::all(level)); }, 6, 9);
        VisualOdometry odometry = joint();
        const auto motions = track_all(odometry, way);
        EXPECT_EQ(motions[5].status, VisualStatus::kGood);
        for (const std::size_t i : {6, 7, 8}) {
            EXPECT_TRUE(motions[i].status == VisualStatus::kTooDark ||
                        (level > 100.0 && motions[i].status == VisualStatus::kTooFewFeatures))
                << level << ": " << to_string(motions[i].status);
            EXPECT_EQ(motions[i].from_stamp, way.truth[i - 1].stamp);
        }
        expect_recovery(motions, way, 9);
    }
}

TEST(VisualOdometry, AnImageWithoutFocusIsNotUsed) {
    const Ride way =
        with_bad_images([](cv::Mat image) { cv::GaussianBlur(image, image, {}, 20.0); }, 6, 9);
    VisualOdometry odometry = joint();
    const auto motions = track_all(odometry, way);
    EXPECT_TRUE(motions[6].status == VisualStatus::kBlurred ||
                motions[6].status == VisualStatus::kTooFewFeatures)
        << to_string(motions[6].status);
    for (const std::size_t i : {7, 8}) {
        EXPECT_FALSE(motions[i].usable()) << to_string(motions[i].status);
    }
    for (std::size_t i = 11; i < motions.size(); ++i) {
        EXPECT_EQ(motions[i].status, VisualStatus::kGood);
        EXPECT_THAT(motions[i].before_from_now, PoseNear(way.step(i), 0.01, radians(0.3))) << i;
    }
}

TEST(VisualOdometry, HalfTheLightIsEnough) {
    const Ride way = with_bad_images([](cv::Mat image) { image *= 0.5; }, 8, 16);
    VisualOdometry odometry = joint();
    const auto motions = track_all(odometry, way);
    for (std::size_t i = 1; i < motions.size(); ++i) {
        ASSERT_EQ(motions[i].status, VisualStatus::kGood) << i;
    }
    EXPECT_THAT(sum_of(motions), PoseNear(way.moved(), 0.02, radians(0.4)));
}

TEST(VisualOdometry, LeavesTheImagesAsTheyAre) {
    VisualOdometry odometry = joint();
    Image image = straight_ride().images[0];
    cv::Mat gray;
    cv::cvtColor(pixels_of(image), gray, cv::COLOR_BGR2GRAY);
    image.channels = 1;
    for (const double light : {1.0, 0.7}) {
        const cv::Mat dimmed = light * gray;
        image.pixels.assign(dimmed.data, dimmed.data + dimmed.total());
        const std::vector<std::uint8_t> copy = image.pixels;
        odometry.track(image);
        EXPECT_TRUE(image.pixels == copy) << light;
        image.stamp += kImageInterval;
    }
}

TEST(VisualOdometry, AnotherSceneAtOnceIsNoMotion) {
    Ride way = straight_ride();
    way.images.resize(8);
    const Ride elsewhere = ride(irregular_room(), CameraMounting(), {2.0, 1.0, 2.5}, kStraight, 4);
    for (std::size_t i = 0; i < 4; ++i) {
        way.images[4 + i].pixels = elsewhere.images[i].pixels;
    }
    VisualOdometry odometry = joint();
    const auto motions = track_all(odometry, way);
    EXPECT_FALSE(motions[4].usable()) << to_string(motions[4].status);
    EXPECT_EQ(motions[7].status, VisualStatus::kGood);
}

TEST(VisualOdometry, GrayAndColorSayTheSame) {
    VisualOdometry color = joint();
    VisualOdometry gray = joint();
    for (std::size_t i = 0; i < 4; ++i) {
        Image image = straight_ride().images[i];
        const VisualMotion a = color.track(image);
        cv::Mat converted;
        cv::cvtColor(pixels_of(image), converted, cv::COLOR_BGR2GRAY);
        image.channels = 1;
        image.pixels.assign(converted.data, converted.data + converted.total());
        const VisualMotion b = gray.track(image);
        ASSERT_EQ(a.before_from_now.vector(), b.before_from_now.vector());
    }
}

TEST(VisualOdometry, RefusesImagesOfAnotherSize) {
    VisualOdometry odometry = joint();
    Image image;
    image.width = 320;
    image.height = 240;
    image.pixels.resize(320 * 240);
    EXPECT_FALSE(odometry.accepts(image));
    EXPECT_THAT(error_of([&] { odometry.track(image); }), HasSubstr("320 x 240"));
    EXPECT_TRUE(odometry.accepts(straight_ride().images[0]));
}

TEST(VisualOdometry, RefusesWhatCannotBe) {
    CameraModel model;
    model.fx = 0.0;
    EXPECT_THAT(error_of([&] { VisualOdometry(model, CameraMounting()); }), HasSubstr("fx"));
    CameraMounting mounting;
    mounting.z = -1.0;
    EXPECT_THAT(error_of([&] { VisualOdometry(CameraModel(), mounting); }), HasSubstr("z"));
    VisualOdometryConfig config;
    config.features = 0;
    EXPECT_THAT(error_of([&] { VisualOdometry(CameraModel(), CameraMounting(), config); }),
                HasSubstr("features"));
}

TEST(VisualOdometry, ATinyCameraWorks) {
    for (const int size : {16, 40, 64, 100}) {
        CameraModel model;
        model.width = model.height = size;
        Image image;
        image.width = image.height = size;
        for (int i = 0; i < size * size; ++i) {
            image.pixels.push_back(static_cast<std::uint8_t>(40 + (i * 2654435761U >> 7) % 160));
        }
        for (const VisualMethod method : {VisualMethod::kJoint, VisualMethod::kThesis}) {
            VisualOdometryConfig config;
            config.method = method;
            VisualOdometry odometry(model, CameraMounting(), config);
            for (int k = 0; k < 3; ++k) {
                image.stamp = 0.1 * k;
                std::rotate(image.pixels.begin(), image.pixels.begin() + 1, image.pixels.end());
                EXPECT_NO_THROW(odometry.track(image)) << size;
            }
        }
    }
}

TEST(VisualOdometry, EveryKeyOfItsConfigurationHasItsOwnField) {
    VisualOdometryConfig config;
    ConfigSchema schema;
    describe(schema, config);
    for (const ConfigField& field : schema.fields()) {
        EXPECT_FALSE(field.help.empty()) << field.key;
        field.set(field.get());
    }
    schema.override_with("method=thesis");
    schema.override_with("keyframe_angle_deg=3");
    EXPECT_EQ(config.method, VisualMethod::kThesis);
    EXPECT_NEAR(config.keyframe_angle, radians(3.0), 1e-12);
    EXPECT_EQ(to_string(VisualMethod::kThesis), "thesis");
    EXPECT_EQ(to_string(VisualMethod::kJoint), "joint");
}

}  // namespace
}  // namespace hybrid_slam::test
