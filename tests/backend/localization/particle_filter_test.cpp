// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/localization/particle_filter.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "backend/localization/localization_support.hpp"
#include "backend/localization/twin_halls.hpp"
#include "support/error_of.hpp"
#include "support/pose_matchers.hpp"

namespace hybrid_slam::test {
namespace {

constexpr double kNearSight = 5.0;  ///< metres
const Eigen::Matrix3d kStepNoise =
    Eigen::Vector3d(1e-4, 1e-4, radians(0.2) * radians(0.2)).asDiagonal();
/// What a short-sighted scanner sees in the halls.
Sweep seen_from(const Pose2d& pose, std::mt19937& random, double sight = kNearSight) {
    static const World world = twin_halls();
    const Sweep all = sweep_of(scan_at(world, pose, random));
    Sweep sweep{all.origin, {}};
    for (std::size_t i = 0; i < all.surface.size(); ++i) {
        if ((all.surface.points[i] - all.origin).norm() < sight) {
            sweep.surface.points.push_back(all.surface.points[i]);
            sweep.surface.normals.push_back(all.surface.normals[i]);
        }
    }
    return sweep;
}

Place place_at(const Pose2d& pose, double metres, double angle, double share = 1.0) {
    Place place;
    place.map_from_robot = pose;
    place.covariance =
        Eigen::Vector3d(metres * metres, metres * metres, angle * angle).asDiagonal();
    place.share = share;
    return place;
}

double total(const std::vector<Place>& places) {
    double sum = 0.0;
    for (const Place& place : places) {
        sum += place.share;
    }
    return sum;
}

/// Of all places within half a metre of a pose.
double share_near(const ParticleFilter& filter, const Pose2d& pose) {
    double sum = 0.0;
    for (const Place& place : filter.places()) {
        if ((place.map_from_robot.translation - pose.translation).norm() < 0.5) {
            sum += place.share;
        }
    }
    return sum;
}

/// Drives a tenth of a metre and looks.
void drive_on(ParticleFilter& filter, Pose2d& truth, std::mt19937& random) {
    const Pose2d step = Pose2d::exp({0.1, 0.0, 0.0});
    truth = truth * step;
    filter.move(step, kStepNoise);
    filter.weigh(seen_from(truth, random));
}

TEST(KldBound, AgreesWithNumbersWorkedByHand) {
    // k = 2: 1 / 0.1 * (1 - 2/9 + sqrt(2/9) 2.33)^3 = 10 * (0.77778 + 1.09838)^3 = 10 * 6.6039
    EXPECT_EQ(kld_bound(2, 0.05, 2.33), 67U);
    // k = 11: 10 / 0.1 * (1 - 1/45 + sqrt(1/45) 2.33)^3 = 100 * (0.97778 + 0.34734)^3
    EXPECT_EQ(kld_bound(11, 0.05, 2.33), 233U);
    // With the median for a quantile, and 91 bins: 90 / 0.02 * (1 - 2/810)^3 = 4500 * 0.992611
    EXPECT_EQ(kld_bound(91, 0.01, 0.0), 4467U);
    EXPECT_EQ(kld_bound(1, 0.05, 2.33), 1U);
    EXPECT_EQ(kld_bound(0, 0.05, 2.33), 1U);
}

TEST(ParticleFilter, SharesAddUpToOneAndFollowThePlacesGiven) {
    ParticleFilter filter(halls(), {});
    EXPECT_EQ(filter.size(), 0U);
    EXPECT_TRUE(filter.places().empty());
    filter.start({place_at({4.0, 2.0, 0.0}, 0.1, 0.05, 1.0),
                  place_at(kOther * Pose2d(4.0, 2.0, 0.0), 0.1, 0.05, 3.0)});
    const std::vector<Place> places = filter.places();
    ASSERT_EQ(places.size(), 2U);
    EXPECT_NEAR(total(places), 1.0, 1e-9);
    EXPECT_NEAR(places[0].share, 0.75, 1e-9);
    EXPECT_THAT(places[0].map_from_robot, PoseNear(kOther * Pose2d(4.0, 2.0, 0.0), 0.05, 0.02));
    EXPECT_THAT(places[1].map_from_robot, PoseNear(Pose2d(4.0, 2.0, 0.0), 0.05, 0.02));
}

TEST(ParticleFilter, SpreadsParticlesByTheCovariance) {
    ParticleFilterConfig config;
    config.min_particles = 5000;
    config.bin_size = 5.0;
    config.bin_angle = kPi;
    ParticleFilter filter(halls(), config);
    Place place = place_at({4.0, 2.0, 0.5}, 0.3, 0.1);
    place.covariance(0, 1) = place.covariance(1, 0) = 0.06;
    filter.start({place});
    const Place back = filter.places().front();
    // The floors of 5 cm and 1 degree are added.
    EXPECT_NEAR(back.covariance(0, 0), 0.0925, 0.01);
    EXPECT_NEAR(back.covariance(0, 1), 0.06, 0.01);
    EXPECT_NEAR(back.covariance(2, 2), 0.0103, 0.001);
    // A motion sideways by the heading, with noise along the robot's own axes.
    filter.move({0.0, 1.0, 0.0}, Eigen::Vector3d(0.25, 0.0, 0.0).asDiagonal());
    const Place moved = filter.places().front();
    EXPECT_THAT(moved.map_from_robot,
                PoseNear(place.map_from_robot * Pose2d(0.0, 1.0, 0.0), 0.03, 0.01));
    const Eigen::Vector2d ahead(std::cos(0.5), std::sin(0.5));
    const Eigen::Matrix2d grown = (moved.covariance - back.covariance).topLeftCorner<2, 2>();
    // 1 m times the heading's doubt counts along too.
    EXPECT_NEAR(ahead.dot(grown * ahead), 0.25 + 0.0103, 0.03);
}

TEST(ParticleFilter, OneSeedOneResult) {
    const auto run = [](int seed) {
        ParticleFilterConfig config;
        config.seed = seed;
        ParticleFilter filter(halls(), config);
        filter.start({place_at({4.0, 2.0, 0.0}, 0.5, 0.2)});
        std::mt19937 random(3);
        Pose2d truth(4.0, 2.0, 0.0);
        for (int i = 0; i < 5; ++i) {
            drive_on(filter, truth, random);
        }
        return filter.places().front().map_from_robot.vector();
    };
    EXPECT_EQ(run(1), run(1));
    EXPECT_NE(run(1), run(2));
}

TEST(ParticleFilter, FindsThePoseAndNeedsFewerParticlesThen) {
    ParticleFilter filter(halls(), {});
    Pose2d truth(4.0, 2.0, 0.3);
    filter.start({place_at(truth * Pose2d(0.4, -0.3, 0.1), 0.6, 0.2)});
    const std::size_t wide = filter.size();
    std::mt19937 random(5);
    for (int i = 0; i < 10; ++i) {
        drive_on(filter, truth, random);
        EXPECT_NEAR(total(filter.places()), 1.0, 1e-9);
    }
    EXPECT_GT(wide, 4000U);
    EXPECT_LT(filter.size(), wide / 8);
    EXPECT_GE(filter.size(), 200U);
    EXPECT_THAT(filter.places().front().map_from_robot, PoseNear(truth, 0.05, radians(1.5)));
    EXPECT_GT(filter.places().front().share, 0.98);
    EXPECT_GT(filter.quality(), 0.6);
}

TEST(ParticleFilter, NeverMoreParticlesThanAllowed) {
    ParticleFilterConfig config;
    config.max_particles = 1500;
    ParticleFilter filter(halls(), config);
    std::vector<Place> places;
    places.reserve(20);
    for (int i = 0; i < 20; ++i) {
        places.push_back(place_at({1.0 + 0.7 * i, 2.0, 0.0}, 1.0, 1.0));
    }
    filter.start(places);
    EXPECT_LE(filter.size(), 1500U);
    EXPECT_GT(filter.size(), 1400U);
    std::mt19937 random(7);
    Pose2d truth(4.0, 2.0, 0.0);
    for (int i = 0; i < 5; ++i) {
        drive_on(filter, truth, random);
        EXPECT_LE(filter.size(), 1500U);
        EXPECT_NEAR(total(filter.places()), 1.0, 1e-9);
    }
}

TEST(ParticleFilter, LookAlikesLiveUntilSomethingTells) {
    for (const int seed : {1, 2, 3}) {
        ParticleFilterConfig config;
        config.seed = seed;
        ParticleFilter filter(halls(), config);
        std::mt19937 random(11U + static_cast<unsigned>(seed));
        const Pose2d start(2.0, 2.0, 0.0);
        Pose2d truth = start;
        filter.start({place_at(start, 0.1, 0.03), place_at(kOther * start, 0.1, 0.03)});
        // The recess at 13 m is out of sight up to here.
        double least = 1.0;
        for (int i = 0; i < 55; ++i) {
            drive_on(filter, truth, random);
            least =
                std::min({least, share_near(filter, truth), share_near(filter, kOther * truth)});
        }
        EXPECT_GT(least, 0.1) << "seed " << seed;
        EXPECT_NEAR(share_near(filter, truth) + share_near(filter, kOther * truth), 1.0, 1e-6);
        for (int i = 0; i < 50; ++i) {
            drive_on(filter, truth, random);
        }
        EXPECT_GT(share_near(filter, truth), 0.99) << "seed " << seed;
        EXPECT_THAT(filter.places().front().map_from_robot, PoseNear(truth, 0.06, radians(1.5)));
    }
}

TEST(ParticleFilter, TheOtherLookAlikeWinsWhereItIsTrue) {
    ParticleFilter filter(halls(), {});
    std::mt19937 random(17);
    Pose2d truth = kOther * Pose2d(7.0, 2.0, 0.0);
    filter.start({place_at({7.0, 2.0, 0.0}, 0.1, 0.03), place_at(truth, 0.1, 0.03)});
    for (int i = 0; i < 55; ++i) {
        drive_on(filter, truth, random);
    }
    EXPECT_GT(share_near(filter, truth), 0.99);
}

TEST(ParticleFilter, HeadingsCloseACircle) {
    ParticleFilter filter(halls(), {});
    const Pose2d back(12.0, 2.0, kPi);
    filter.start({place_at(back, 0.1, 0.1)});
    ASSERT_EQ(filter.places().size(), 1U);
    EXPECT_THAT(filter.places().front().map_from_robot, PoseNear(back, 0.05, 0.03));
    EXPECT_LT(filter.places().front().covariance(2, 2), 0.02);
    std::mt19937 random(19);
    Pose2d truth = back;
    for (int i = 0; i < 10; ++i) {
        drive_on(filter, truth, random);
    }
    EXPECT_THAT(filter.places().front().map_from_robot, PoseNear(truth, 0.06, radians(1.5)));
    EXPECT_GT(filter.places().front().share, 0.98);
}

TEST(ParticleFilter, QualityIsLowWhereNoParticleIsRight) {
    ParticleFilter filter(halls(), {});
    std::mt19937 random(23);
    Pose2d truth(4.0, 2.0, 0.0);
    filter.start({place_at(truth, 0.1, 0.03)});
    drive_on(filter, truth, random);
    const double right = filter.quality();
    // Taken away and turned.
    truth = Pose2d(13.0, 1.2, 2.0);
    for (int i = 0; i < 5; ++i) {
        drive_on(filter, truth, random);
    }
    EXPECT_GT(right, 0.6);
    EXPECT_LT(filter.quality(), 0.35);
}

TEST(ParticleFilter, ABlindScanTellsNothing) {
    ParticleFilter filter(halls(), {});
    filter.weigh({});
    filter.start({place_at({4.0, 2.0, 0.0}, 0.1, 0.03)});
    const auto before = filter.places().front().map_from_robot.vector();
    filter.weigh({});
    EXPECT_EQ(filter.places().front().map_from_robot.vector(), before);
}

TEST(ParticleFilter, PeopleCountLittleAgainstAPlace) {
    // The same place, with one beam in three short; the other one half a metre off the wall.
    ParticleFilter filter(halls(), {});
    std::mt19937 random(29);
    const Pose2d truth(4.0, 2.0, 0.0);
    const Pose2d wrong(4.0, 1.0, 0.0);
    filter.start({place_at(truth, 0.05, 0.01), place_at(wrong, 0.05, 0.01)});
    Sweep sweep = seen_from(truth, random);
    for (std::size_t i = 0; i < sweep.surface.size(); i += 3) {
        sweep.surface.points[i] *= 0.4;
    }
    filter.weigh(sweep);
    EXPECT_GT(share_near(filter, truth), 0.95);
}

TEST(ParticleFilter, RefusesWhatMakesNoSense) {
    ParticleFilterConfig config;
    config.min_particles = 300;
    config.max_particles = 200;
    EXPECT_NE(error_of([&] { ParticleFilter(halls(), config); }).find("particles.min_particles"),
              std::string::npos);
    config = {};
    config.beams = 0;
    EXPECT_NE(error_of([&] { ParticleFilter(halls(), config); }).find("particles.beams"),
              std::string::npos);
}

}  // namespace
}  // namespace hybrid_slam::test
