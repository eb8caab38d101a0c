// SPDX-License-Identifier: Apache-2.0
#include "pose_trust.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace hybrid_slam::test {
namespace {

using tools::PoseTrust;

LocalizationResult seen(LocalizationStatus status, double explained, double violated) {
    LocalizationResult result;
    result.status = status;
    if (status != LocalizationStatus::kRelocalizing) {
        result.map_from_robot = Pose2d(1.0, 2.0, 0.0);
    }
    result.fit.explained = explained;
    result.fit.violated = violated;
    result.score = std::max(0.0, explained - violated);
    return result;
}

constexpr auto kTracking = LocalizationStatus::kTracking;
constexpr auto kDegraded = LocalizationStatus::kDegraded;

TEST(PoseTrust, AClaimIsNoPlace) {
    PoseTrust trust;
    for (int i = 0; i < 10; ++i) {
        trust.see(seen(i % 2 == 0 ? kTracking : kDegraded, 0.08, 0.02));
        EXPECT_FALSE(trust.known() || trust.sure());
        trust.see(seen(kTracking, 0.5, 0.4));
        EXPECT_FALSE(trust.known() || trust.sure()) << "many walls are seen through";
    }
    trust.see(seen(kTracking, 0.9, 0.0));
    EXPECT_TRUE(trust.known() && trust.sure());
}

TEST(PoseTrust, MuchThatIsNewIsNoReasonToDoubt) {
    PoseTrust trust;
    trust.see(seen(kDegraded, 0.4, 0.05));
    EXPECT_TRUE(trust.known() && trust.sure());
}

TEST(PoseTrust, AKnownPlaceHoldsWhileTheViewIsBlocked) {
    PoseTrust trust;
    trust.see(seen(kTracking, 0.9, 0.0));
    trust.see(seen(kDegraded, 0.0, 0.0));
    EXPECT_TRUE(trust.known());
    EXPECT_FALSE(trust.sure()) << "nothing to start from";
}

TEST(PoseTrust, ALostOneHasToBeFoundAnew) {
    for (const auto status : {LocalizationStatus::kLost, LocalizationStatus::kRelocalizing}) {
        PoseTrust trust;
        trust.see(seen(kTracking, 0.9, 0.0));
        trust.see(seen(status, 0.9, 0.0));
        EXPECT_FALSE(trust.known() || trust.sure());
        trust.see(seen(kDegraded, 0.1, 0.1));
        EXPECT_FALSE(trust.known());
        trust.see(seen(kTracking, 0.9, 0.0));
        EXPECT_TRUE(trust.known());
    }
}

}  // namespace
}  // namespace hybrid_slam::test
