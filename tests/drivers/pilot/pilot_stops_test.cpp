// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "piloted_truck.hpp"

namespace hybrid_slam {
namespace {

using test::PilotedTruck;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

const Point2 kPlace{-2.40, -1.60};

/// Drives, has something go wrong, and says how long it took until speed zero was commanded.
double seconds_to_stop(PilotedTruck& truck, const std::function<void()>& go_wrong) {
    truck.go_to({kPlace});
    EXPECT_TRUE(truck.run(30.0, [&] { return std::abs(truck.truck().speed) > 0.29; }));
    go_wrong();
    const double before = truck.now();
    EXPECT_TRUE(truck.run(3.0, [&] {
        return truck.out.command.value_or(DriveCommand()).speed == 0.0 &&
               truck.out.status.state != LinkDriveState::kDriving;
    }));
    const double took = truck.now() - before;
    truck.run(2.0);
    EXPECT_TRUE(truck.stands());
    return took;
}

/// After what went wrong has passed.
void expect_goes_on(PilotedTruck& truck) {
    EXPECT_TRUE(truck.run(90.0, [&] { return truck.arrived(); })) << truck.out.status.reason;
    EXPECT_LT(truck.away_from(kPlace), 0.02);
}

TEST(PilotStops, WithoutAPose) {
    PilotedTruck truck;
    truck.slam_talks = false;
    truck.go_to({kPlace});
    truck.run(2.0);
    EXPECT_TRUE(truck.stands());
    EXPECT_EQ(truck.out.status.reason, "no pose has come yet");
    EXPECT_EQ(truck.out.status.state, LinkDriveState::kStopped);
    truck.slam_talks = true;
    expect_goes_on(truck);
}

TEST(PilotStops, WhenPosesEnd) {
    PilotedTruck truck;
    const double took = seconds_to_stop(truck, [&] { truck.slam_talks = false; });
    EXPECT_LE(took, 0.4);
    EXPECT_EQ(truck.out.status.reason, "no fresh pose");
    EXPECT_NEAR(truck.out.status.pose_age, took + 2.0, 0.2);
    truck.slam_talks = true;
    expect_goes_on(truck);
}

TEST(PilotStops, WhenPosesComeLate) {
    PilotedTruck truck;
    EXPECT_LE(seconds_to_stop(
                  truck,
                  [&] { truck.spoil = [](LinkEvent& event, LinkPose&) { event.lateness = 0.5; }; }),
              0.4);
    truck.spoil = {};
    expect_goes_on(truck);
}

TEST(PilotStops, WhenThePoseIsFrozen) {
    PilotedTruck truck;
    std::optional<Pose2d> held;
    const auto freeze = [&](LinkEvent&, LinkPose& pose) {
        held = held.value_or(pose.map_from_robot);
        pose.map_from_robot = *held;  // with new stamps
    };
    const double took = seconds_to_stop(truck, [&] { truck.spoil = freeze; });
    EXPECT_LE(took, 0.44) << "0.08 m at 0.3 m/s, and a period of poses";
    EXPECT_EQ(truck.out.status.reason, "the pose does not follow the wheels");
    truck.run(20.0);
    EXPECT_TRUE(truck.stands()) << "it does not try again";
    truck.spoil = {};
    expect_goes_on(truck);
}

TEST(PilotStops, WhenWheelsSayMoreThanThePose) {
    PilotedTruck truck;
    std::optional<Pose2d> start;
    // A wheel radius entered three times too large looks like this.
    const auto shrink = [&](LinkEvent&, LinkPose& pose) {
        start = start.value_or(pose.map_from_robot);
        pose.map_from_robot = interpolate(*start, pose.map_from_robot, 0.3);
    };
    seconds_to_stop(truck, [&] { truck.spoil = shrink; });
    EXPECT_EQ(truck.out.status.reason, "the pose does not follow the wheels");
}

TEST(PilotStops, WhenThePoseIsLostUncertainOrOfAnotherMap) {
    struct Case {
        std::function<void(LinkPose&)> spoil;
        const char* reason;
    };
    const Case cases[] = {
        {[](LinkPose& pose) { pose.status = LinkPoseStatus::kLost; }, "localization is lost"},
        {[](LinkPose& pose) { pose.status = LinkPoseStatus::kRelocalizing; }, "searches"},
        {[](LinkPose& pose) { pose.covariance(0, 0) = 0.02; }, "too uncertain"},
        {[](LinkPose& pose) { pose.covariance(2, 2) = 0.01; }, "too uncertain"},
        {[](LinkPose& pose) { pose.covariance(1, 1) = NAN; }, "too uncertain"},
        {[](LinkPose& pose) { pose.map = "attic"; }, "another map: attic"},
        {[](LinkPose& pose) { pose.is_protective = true; }, "protective field"},
    };
    for (const Case& each : cases) {
        PilotedTruck truck;
        const double took = seconds_to_stop(
            truck, [&] { truck.spoil = [&](LinkEvent&, LinkPose& pose) { each.spoil(pose); }; });
        EXPECT_LE(took, 0.1) << each.reason;
        EXPECT_THAT(truck.out.status.reason, HasSubstr(each.reason));
        truck.spoil = {};
        expect_goes_on(truck);
    }
}

TEST(PilotStops, BeforeWhatIsInTheWay) {
    PilotedTruck truck;
    double gap = 1.0;  // metres to an obstacle on either side, which stays where it is
    std::optional<Point2> from;
    const auto block = [&](LinkEvent&, LinkPose& pose) {
        from = from.value_or(pose.map_from_robot.translation);
        const double driven = (pose.map_from_robot.translation - *from).norm();
        pose.clear_ahead = pose.clear_behind = std::max(0.0, gap - driven);
    };
    truck.go_to({kPlace});
    ASSERT_TRUE(truck.run(30.0, [&] { return std::abs(truck.truck().speed) > 0.29; }));
    const Point2 before = truck.truck().world_from_robot.translation;
    truck.spoil = block;
    truck.run(20.0);
    EXPECT_TRUE(truck.stands());
    EXPECT_EQ(truck.out.status.reason, "something is in the way");
    EXPECT_EQ(truck.out.status.state, LinkDriveState::kStopped);
    const double driven = (truck.truck().world_from_robot.translation - before).norm();
    EXPECT_LT(driven, gap);
    EXPECT_GT(driven, gap - 0.3);
    truck.spoil = {};
    expect_goes_on(truck);
}

TEST(PilotStops, WhenNobodySaysThatTheWayIsFree) {
    PilotedTruck truck;
    seconds_to_stop(truck, [&] {
        truck.spoil = [](LinkEvent&, LinkPose& pose) {
            pose.clear_ahead.reset();
            pose.clear_behind.reset();
        };
    });
    EXPECT_EQ(truck.out.status.reason, "something is in the way");
}

TEST(PilotStops, AtAFaultOfTheDriveUntilSomebodyResumes) {
    PilotedTruck truck;
    EXPECT_LE(seconds_to_stop(truck, [&] { truck.drive_fault = "can0: is down"; }), 0.05);
    EXPECT_EQ(truck.out.status.state, LinkDriveState::kFault);
    EXPECT_EQ(truck.out.status.fault, "can0: is down");
    truck.tell(LinkCommand::kResume);
    truck.run(0.1);
    EXPECT_THAT(truck.refusals, ElementsAre(HasSubstr("resume: the drive has a fault")));
    truck.drive_fault.clear();
    truck.run(3.0);
    EXPECT_TRUE(truck.stands());
    EXPECT_EQ(truck.out.status.state, LinkDriveState::kPaused);
    EXPECT_THAT(truck.out.status.reason, HasSubstr("fault"));
    truck.tell(LinkCommand::kResume);
    expect_goes_on(truck);
}

TEST(PilotStops, ListensToOnePoseSourceAtATime) {
    PilotedTruck truck;
    truck.run(0.5);
    LinkPose other;
    other.status = LinkPoseStatus::kTracking;
    other.map_from_robot = {-3.0, -2.0, 1.0};
    for (int i = 0; i < 3; ++i) {
        truck.tell(other, 9);
        truck.run(0.1);
    }
    EXPECT_THAT(truck.refusals, ElementsAre(HasSubstr("another pose source")));
    EXPECT_LT(
        (truck.out.status.map_from_robot->translation - truck.truck().world_from_robot.translation)
            .norm(),
        0.1);
    truck.slam_talks = false;
    truck.tell(LinkDisconnected{"cut"}, PilotedTruck::kSlam);
    truck.run(0.1);
    truck.tell(other, 9);
    truck.run(0.1);
    EXPECT_EQ(truck.out.status.map_from_robot->x(), -3.0) << "now it is the one";
}

TEST(PilotStops, AtAPoseThatJumpsUntilSomebodyResumes) {
    PilotedTruck truck;
    bool off = true;
    EXPECT_LE(seconds_to_stop(truck,
                              [&] {
                                  truck.spoil = [&](LinkEvent&, LinkPose& pose) {
                                      pose.map_from_robot.translation.y() += off ? -1.0 : 0.0;
                                  };
                              }),
              0.1);
    EXPECT_EQ(truck.out.status.state, LinkDriveState::kPaused);
    EXPECT_THAT(truck.out.status.reason, HasSubstr("jumped by 1.0"));
    off = false;
    truck.run(2.0);
    EXPECT_EQ(truck.out.status.state, LinkDriveState::kPaused) << "it jumped back";
    truck.tell(LinkCommand::kResume);
    expect_goes_on(truck);
}

TEST(PilotStops, AtAJumpToldByAPoseThatIsLateToo) {
    PilotedTruck truck;
    int told = 0;
    seconds_to_stop(truck, [&] {
        truck.spoil = [&](LinkEvent&, LinkPose& pose) {
            pose.map_from_robot.translation.x() += 1.5;
            pose.age = told++ == 0 ? 1.0 : pose.age;  // the one after a long search
        };
    });
    EXPECT_EQ(truck.out.status.state, LinkDriveState::kPaused);
}

TEST(PilotStops, WhenTheWheelsCountTheWrongWayRound) {
    PilotedTruck truck;
    truck.counts_backwards = true;
    truck.go_to({kPlace});
    EXPECT_TRUE(truck.run(
        10.0, [&] { return truck.out.status.reason == "the pose does not follow the wheels"; }));
}

TEST(PilotStops, AtAMeasurementThatCannotBe) {
    for (const double nonsense : {1e9, -1e9, static_cast<double>(NAN)}) {
        PilotedTruck truck;
        seconds_to_stop(truck, [&] { truck.told_speed = nonsense; });
        EXPECT_EQ(truck.out.status.state, LinkDriveState::kFault);
        EXPECT_EQ(truck.out.status.speed, 0.0);
    }
}

TEST(PilotStops, WhenPosesSayThemselvesThatTheyAreOld) {
    PilotedTruck truck;
    EXPECT_LE(seconds_to_stop(
                  truck, [&] { truck.spoil = [](LinkEvent&, LinkPose& pose) { pose.age = 1.0; }; }),
              0.1);
    EXPECT_EQ(truck.out.status.reason, "no fresh pose");
    EXPECT_GE(truck.out.status.pose_age, 1.0);
    truck.spoil = {};
    expect_goes_on(truck);
}

TEST(PilotStops, ListensOnlyToTheSourceThatIsNamed) {
    PilotConfig config;
    config.pose_source = "truck 7";
    PilotedTruck truck(config);
    truck.run(0.5);
    EXPECT_FALSE(truck.out.status.map_from_robot.has_value());
    EXPECT_THAT(truck.refusals, ElementsAre(HasSubstr("named 'truck 7'")));
    truck.tell(LinkConnected{"truck 7"}, PilotedTruck::kSlam);
    truck.run(0.5);
    EXPECT_TRUE(truck.out.status.map_from_robot.has_value());
}

/// The wheels are not measured there, so that they prove nothing.
TEST(PilotStops, NotInADryRun) {
    PilotedTruck truck;
    truck.has_feedback = false;
    truck.obeys = false;
    truck.go_to({kPlace});
    truck.run(4.0);
    EXPECT_EQ(truck.out.status.state, LinkDriveState::kDriving) << truck.out.status.reason;
}

}  // namespace
}  // namespace hybrid_slam
