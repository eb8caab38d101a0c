// SPDX-License-Identifier: Apache-2.0
#include "tracking_health.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace hybrid_slam::test {
namespace {

constexpr double kStep = 0.08;  // seconds between scans

Track seen(double explained, double violated) {
    Track track;
    track.covariance = 1e-5 * Eigen::Matrix3d::Identity();
    track.weak_direction = {1.0, 0.0};
    track.fit.points = 400;
    track.fit.explained = explained;
    track.fit.violated = violated;
    track.fit.unmapped = 1.0 - explained - violated;
    track.anchored = true;
    return track;
}

/// A health with its clock.
struct Watch {
    TrackingHealth health{TrackingConfig()};
    double stamp = 0.0;

    TrackingStatus see(const Track& track, const Disagreement& disagreement = {}) {
        stamp += kStep;
        return health.judge(stamp, track, disagreement);
    }
    /// Seconds of the same until lost; 10 when it is not.
    double until_lost(const Track& track, const Disagreement& disagreement = {}) {
        const double start = stamp;
        while (stamp < start + 10.0) {
            if (see(track, disagreement) == TrackingStatus::kLost) {
                return stamp - start;
            }
        }
        return 10.0;
    }
};

TEST(TrackingHealth, NewThingsBeforeTheWallsAreNoContradiction) {
    Watch watch;
    EXPECT_EQ(watch.see(seen(1.0, 0.0)), TrackingStatus::kTracking);
    EXPECT_EQ(watch.until_lost(seen(0.6, 0.0)), 10.0);
    EXPECT_EQ(watch.until_lost(seen(0.05, 0.02)), 10.0);  // a crowd around the vehicle
}

TEST(TrackingHealth, WallsThatAreGoneComeIntoViewBitByBit) {
    Watch watch;
    for (double violated = 0.0; violated < 0.35; violated += 0.01) {
        EXPECT_EQ(watch.see(seen(1.0 - violated, violated)), TrackingStatus::kTracking);
    }
    EXPECT_EQ(watch.until_lost(seen(0.65, 0.35)), 10.0);
}

TEST(TrackingHealth, ALookAlikePlaceShowsByItsSuddenness) {
    Watch watch;
    watch.see(seen(0.98, 0.01));
    const double lost = watch.until_lost(seen(0.78, 0.09));
    EXPECT_GE(lost, 0.7);
    EXPECT_LT(lost, 1.0);
}

TEST(TrackingHealth, ViolationsThatOutweighAllElseAreLostFromTheStart) {
    Watch watch;
    EXPECT_LT(watch.until_lost(seen(0.1, 0.4)), 1.0);
}

TEST(TrackingHealth, AScanOrTwoAreForgiven) {
    Watch watch;
    for (int i = 0; i < 100; ++i) {
        const Track track = i % 10 < 3 ? seen(0.1, 0.4) : seen(1.0, 0.0);
        EXPECT_NE(watch.see(track), TrackingStatus::kLost);
    }
}

TEST(TrackingHealth, AnchorsThatDisagreeAndLeapsAreContradictions) {
    Watch watch;
    watch.see(seen(1.0, 0.0));
    EXPECT_LT(watch.until_lost(seen(1.0, 0.0), {true, false}), 1.0);
    Watch leaping;
    leaping.see(seen(1.0, 0.0));
    EXPECT_EQ(leaping.see(seen(1.0, 0.0), {false, true}), TrackingStatus::kLost);
    EXPECT_EQ(leaping.see(seen(1.0, 0.0)), TrackingStatus::kLost);  // until started anew
}

TEST(TrackingHealth, BlindScansDegradeAndNothingMore) {
    Watch watch;
    watch.see(seen(1.0, 0.0));
    Track blind = seen(0.0, 0.0);
    blind.fit = ScanFit();
    blind.anchored = false;
    EXPECT_EQ(watch.until_lost(blind), 10.0);
    EXPECT_EQ(watch.see(blind), TrackingStatus::kDegraded);
    EXPECT_EQ(watch.see(seen(1.0, 0.0)), TrackingStatus::kTracking);
}

TEST(TrackingHealth, AWeakDirectionIsDegraded) {
    Watch watch;
    Track track = seen(1.0, 0.0);
    track.covariance(1, 1) = 0.06 * 0.06;
    track.weak_direction = {0.0, 1.0};
    EXPECT_EQ(watch.see(track), TrackingStatus::kDegraded);
}

}  // namespace
}  // namespace hybrid_slam::test
