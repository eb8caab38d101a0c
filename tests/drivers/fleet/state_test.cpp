// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "fleet_truck.hpp"
#include "outgoing.hpp"
#include "support/error_of.hpp"

namespace hybrid_slam {
namespace {

using test::FleetTruck;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::vector<std::string> names_of(const std::vector<FleetMessage>& messages) {
    std::vector<std::string> names;
    for (const FleetMessage& message : messages) {
        EXPECT_EQ(test::schema_fault(message), "") << message.payload;
        names.push_back(test::topic_name(message));
    }
    return names;
}

TEST(FleetState, BeforeAnyOrder) {
    FleetTruck truck;
    const Json state = truck.state();
    EXPECT_EQ(state["orderId"], "");
    EXPECT_EQ(state["orderUpdateId"], 0);
    EXPECT_EQ(state["lastNodeId"], "");
    EXPECT_EQ(state["operatingMode"], "AUTOMATIC");
    EXPECT_EQ(state["driving"], false);
    EXPECT_EQ(state["paused"], false);
    EXPECT_EQ(state["version"], "2.1.0");
    EXPECT_EQ(state["manufacturer"], "ExampleCo");
    EXPECT_EQ(state["serialNumber"], "FL-0001");
    EXPECT_EQ(state["timestamp"], "1970-01-01T00:00:00.000Z");
    EXPECT_EQ(state["safetyState"]["eStop"], "NONE");
    EXPECT_EQ(state["safetyState"]["fieldViolation"], false);
}

TEST(FleetState, BeforeTheDriveHasSaidAnything) {
    FleetProtocol protocol(test::example_config(), FleetVehicle());
    const auto messages = protocol.due(0.0);
    EXPECT_THAT(names_of(messages), ElementsAre("factsheet", "state"));
    const Json state = Json::parse(messages[1].payload);
    EXPECT_EQ(state["errors"][0]["errorType"], "driveSilent");
    EXPECT_EQ(state["errors"][0]["errorLevel"], "FATAL");
    EXPECT_FALSE(state.contains("agvPosition"));
}

TEST(FleetState, TheKnownPose) {
    FleetTruck truck;
    truck.status = test::status_at(1.25, -2.5, 3.5);
    truck.tell();
    const Json position = truck.state()["agvPosition"];
    EXPECT_EQ(position["x"], 1.25);
    EXPECT_EQ(position["y"], -2.5);
    EXPECT_DOUBLE_EQ(position["theta"].get<double>(), 3.5 - 2.0 * kPi);
    EXPECT_EQ(position["mapId"], "hall");
    EXPECT_EQ(position["positionInitialized"], true);
    EXPECT_EQ(position["localizationScore"], 0.9);
    EXPECT_NEAR(position["deviationRange"].get<double>(), 2.4477 * 0.02, 1e-5);
}

TEST(FleetState, APoseWithoutAMapIsInTheDrives) {
    FleetTruck truck;
    truck.status.pose->map.clear();
    truck.tell();
    EXPECT_EQ(truck.state()["agvPosition"]["mapId"], "hall");
}

TEST(FleetState, APoseThatIsNotKnownIsToldAsSuch) {
    FleetTruck truck;
    truck.status.pose->status = LinkPoseStatus::kLost;
    truck.tell();
    const Json position = truck.state()["agvPosition"];
    EXPECT_EQ(position["positionInitialized"], false);
    EXPECT_EQ(position["localizationScore"], 0.0);
    EXPECT_THAT(truck.error_types(), ElementsAre("localizationError"));
    truck.status.drive.map_from_robot.reset();
    truck.tell();
    EXPECT_FALSE(truck.state().contains("agvPosition"));
}

/// 95 of 100 points of the distribution lie within the radius along its long axis, and no fewer
/// in all.
TEST(FleetState, TheDeviationHoldsTheTruth) {
    std::mt19937 random(7);
    std::normal_distribution<double> gauss;
    Eigen::Matrix2d root;
    root << 0.05, 0.02, -0.01, 0.004;
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    covariance.topLeftCorner<2, 2>() = root * root.transpose();
    const double range = deviation_range(covariance);
    int within = 0;
    constexpr int kCount = 20000;
    for (int i = 0; i < kCount; ++i) {
        within += (root * Eigen::Vector2d(gauss(random), gauss(random))).norm() <= range ? 1 : 0;
    }
    EXPECT_GT(within, 0.945 * kCount);
    const Eigen::Matrix3d round = Eigen::Vector3d(0.01, 0.01, 0.0).asDiagonal();
    within = 0;
    for (int i = 0; i < kCount; ++i) {
        within += 0.1 * std::hypot(gauss(random), gauss(random)) <= deviation_range(round) ? 1 : 0;
    }
    EXPECT_NEAR(within, 0.95 * kCount, 0.005 * kCount);
}

TEST(FleetState, TheVelocityOfASteeredWheel) {
    FleetVehicle vehicle;
    vehicle.wheelbase = -1.2;
    FleetTruck truck(test::example_config(), vehicle);
    truck.status.drive.speed = 0.24;
    truck.status.drive.steering = std::atan(0.5);
    truck.tell();
    const Json state = truck.state();
    EXPECT_EQ(state["driving"], true);
    EXPECT_EQ(state["velocity"]["vx"], 0.24);
    EXPECT_EQ(state["velocity"]["vy"], 0.0);
    EXPECT_NEAR(state["velocity"]["omega"].get<double>(), -0.1, 1e-12);
}

TEST(FleetState, StopsAndFaults) {
    FleetTruck truck;
    truck.status.is_protective = true;
    truck.status.drive.state = LinkDriveState::kStopped;
    truck.status.drive.reason = "the protective field is broken";
    truck.tell();
    EXPECT_THAT(truck.error_types(), IsEmpty()) << "it may be planning";
    truck.now += 1.0;
    truck.tell();
    Json state = truck.state();
    EXPECT_EQ(state["safetyState"]["eStop"], "AUTOACK");
    EXPECT_EQ(state["safetyState"]["fieldViolation"], true);
    EXPECT_EQ(state["errors"][0]["errorType"], "driveStopped");
    EXPECT_EQ(state["errors"][0]["errorLevel"], "WARNING");
    truck.status.is_emergency_stop = true;
    truck.status.drive.state = LinkDriveState::kFault;
    truck.status.drive.fault = "\xff bus off";
    truck.tell();
    state = truck.state();
    EXPECT_EQ(state["safetyState"]["eStop"], "MANUAL");
    EXPECT_EQ(state["errors"][0]["errorType"], "driveFault");
    EXPECT_EQ(state["errors"][0]["errorLevel"], "FATAL");
}

TEST(FleetState, TheBattery) {
    FleetTruck truck;
    EXPECT_EQ(truck.state()["information"][0]["infoType"], "batteryUnknown");
    truck.status.battery = 42.5;
    truck.status.is_charging = true;
    truck.tell();
    const Json state = truck.state();
    EXPECT_EQ(state["batteryState"]["batteryCharge"], 42.5);
    EXPECT_EQ(state["batteryState"]["charging"], true);
    EXPECT_EQ(state["information"].size(), 0u);
}

/// Whatever the drive tells: the schema has no null for a number.
TEST(FleetState, NumbersThatAreNoneAreNotTold) {
    constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    for (const double bad : {kNan, kInfinity, -kInfinity}) {
        FleetTruck truck;
        truck.status.drive.speed = bad;
        truck.status.drive.steering = bad;
        truck.status.pose->score = bad;
        truck.status.pose->covariance.setConstant(bad);
        truck.status.battery = bad;
        truck.tell();
        EXPECT_EQ(truck.state()["agvPosition"]["positionInitialized"], true);
        truck.status.pose->map_from_robot.heading = bad;
        truck.status.drive.map_from_robot = Pose2d(bad, 0.0, 0.0);
        truck.tell();
        EXPECT_FALSE(truck.state().contains("agvPosition"));
    }
}

TEST(FleetState, ASilentDriveIsTold) {
    FleetTruck truck;
    truck.status.drive.speed = 0.3;
    truck.tell();
    truck.state();
    truck.now += 2.5;
    const Json state = truck.state();
    EXPECT_EQ(state["driving"], false);
    EXPECT_EQ(state["agvPosition"]["positionInitialized"], false);
    EXPECT_FALSE(state.contains("velocity"));
    EXPECT_EQ(state["errors"][0]["errorType"], "driveSilent");
    truck.tell();
    EXPECT_THAT(truck.error_types(), IsEmpty());
}

TEST(FleetState, AStateComesInTimeAndAtEvents) {
    FleetConfig config = test::example_config();
    config.visualization_period = 0.0;
    FleetTruck truck(config);
    EXPECT_THAT(names_of(truck.protocol.due(100.0)), ElementsAre("factsheet", "state"));
    EXPECT_THAT(truck.protocol.due(100.5), IsEmpty());
    EXPECT_THAT(names_of(truck.protocol.due(101.0)), ElementsAre("state"));
    truck.status.drive.speed = 0.3;
    truck.tell();
    EXPECT_THAT(truck.protocol.due(101.05), IsEmpty()) << "events are told ten times a second";
    EXPECT_THAT(names_of(truck.protocol.due(101.15)), ElementsAre("state"));
    EXPECT_THAT(truck.protocol.due(101.3), IsEmpty());
    truck.protocol.announce();
    EXPECT_THAT(names_of(truck.protocol.due(101.3)), ElementsAre("factsheet", "state"));
}

TEST(FleetState, AReasonsMetresAreNoEvent) {
    FleetConfig config = test::example_config();
    config.visualization_period = 0.0;
    FleetTruck truck(config);
    truck.status.drive.state = LinkDriveState::kStopped;
    truck.status.drive.reason = "obstacle at 0.83 m";
    truck.now = 101.1;
    truck.tell();
    EXPECT_THAT(names_of(truck.protocol.due(101.2)), ElementsAre("factsheet", "state"));
    truck.status.drive.reason = "obstacle at 0.79 m";
    truck.tell();
    EXPECT_THAT(truck.protocol.due(101.5), IsEmpty());
    truck.status.drive.reason = "no pose";
    truck.tell();
    EXPECT_THAT(names_of(truck.protocol.due(101.6)), ElementsAre("state"));
}

TEST(FleetState, ViewersGetEachPoseOnce) {
    FleetTruck truck;
    truck.protocol.due(100.02);
    EXPECT_THAT(truck.protocol.due(100.5), IsEmpty()) << "no new pose";
    truck.tell();
    const auto messages = truck.protocol.due(100.6);
    EXPECT_THAT(names_of(messages), ElementsAre("visualization"));
    EXPECT_EQ(Json::parse(messages[0].payload)["agvPosition"]["x"], 0.0);
    truck.tell();
    EXPECT_THAT(truck.protocol.due(100.7), IsEmpty()) << "not five times a second";
}

TEST(FleetState, HeadersCountByTopic) {
    FleetTruck truck;
    for (int i = 0; i < 3; ++i) {
        EXPECT_EQ(truck.state()["headerId"], i);
    }
    EXPECT_EQ(Json::parse(truck.protocol.will().payload)["headerId"], 0);
    EXPECT_EQ(Json::parse(truck.protocol.online().payload)["headerId"], 1);
    EXPECT_EQ(Json::parse(truck.protocol.offline().payload)["headerId"], 2);
}

TEST(FleetState, TheConnectionsMessages) {
    FleetTruck truck;
    for (const FleetMessage& message :
         {truck.protocol.will(), truck.protocol.online(), truck.protocol.offline()}) {
        EXPECT_EQ(test::schema_fault(message), "");
        EXPECT_EQ(message.topic, "uagv/v2/ExampleCo/FL-0001/connection");
        EXPECT_EQ(message.qos, 1);
        EXPECT_TRUE(message.is_retained);
    }
}

TEST(FleetState, TheFactsheet) {
    FleetVehicle vehicle;
    vehicle.footprint = {{1.6, 0.45}, {1.6, -0.45}, {-0.4, -0.45}, {-0.4, 0.45}};
    FleetConfig config = test::example_config();
    config.ignore_edge_hints = true;
    FleetProtocol protocol(config, vehicle);
    const FleetMessage message = protocol.due(0.0)[0];
    EXPECT_EQ(test::schema_fault(message), "");
    EXPECT_TRUE(message.is_retained);
    const Json sheet = Json::parse(message.payload);
    EXPECT_EQ(sheet["typeSpecification"]["localizationTypes"], Json::array({"NATURAL"}));
    EXPECT_EQ(sheet["physicalParameters"]["speedMax"], 0.3);
    EXPECT_EQ(sheet["agvGeometry"]["envelopes2d"][0]["polygonPoints"].size(), 4u);
    EXPECT_EQ(sheet["protocolFeatures"]["agvActions"].size(), 6u);
    EXPECT_EQ(sheet["protocolLimits"]["maxArrayLens"]["order.nodes"], 256);
}

TEST(FleetState, TimesAreOfTheCalendar) {
    using std::chrono::milliseconds;
    const auto at = [](long long ms) {
        return iso_time(std::chrono::system_clock::time_point(milliseconds(ms)));
    };
    EXPECT_EQ(at(0), "1970-01-01T00:00:00.000Z");
    EXPECT_EQ(at(951827696789), "2000-02-29T12:34:56.789Z");
    EXPECT_EQ(at(1767225599007), "2025-12-31T23:59:59.007Z");
    EXPECT_EQ(at(-1), "1969-12-31T23:59:59.999Z");
}

TEST(FleetConfig, BadOnesAreNamed) {
    const auto error_of = [](auto&& spoil) {
        FleetConfig config = test::example_config();
        spoil(config);
        return test::error_of([&config] { check(config); });
    };
    EXPECT_THAT(error_of([](FleetConfig& c) { c.manufacturer = "a/b"; }),
                HasSubstr("manufacturer"));
    EXPECT_THAT(error_of([](FleetConfig& c) { c.manufacturer = ""; }), HasSubstr("manufacturer"));
    EXPECT_THAT(error_of([](FleetConfig& c) { c.interface_name = "#"; }),
                HasSubstr("interface_name"));
    EXPECT_THAT(error_of([](FleetConfig& c) { c.serial_number = "FL 1"; }),
                HasSubstr("serial_number"));
    EXPECT_THAT(error_of([](FleetConfig& c) { c.serial_number = "FL(1)"; }),
                HasSubstr("serial_number"));
    EXPECT_THAT(error_of([](FleetConfig& c) { c.state_period = 31.0; }), HasSubstr("state_period"));
    EXPECT_THAT(error_of([](FleetConfig& c) { c.retry_most = 0.1; }), HasSubstr("retry_most"));
    EXPECT_THAT(error_of([](FleetConfig& c) { c.broker = "tcp://broker"; }), HasSubstr("no port"));
    EXPECT_THAT(error_of([](FleetConfig& c) { c.broker = "ssl://broker:8883"; }),
                HasSubstr("only tcp://"));
    EXPECT_NO_THROW(check(test::example_config()));
    EXPECT_NO_THROW(check(FleetConfig()));
}

}  // namespace
}  // namespace hybrid_slam
