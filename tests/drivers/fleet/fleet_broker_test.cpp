// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <mqtt/async_client.h>

#include <filesystem>
#include <memory>

#include "broker.hpp"
#include "fleet_truck.hpp"
#include "hybrid_slam/fleet/fleet_client.hpp"
#include "support/error_of.hpp"

namespace hybrid_slam {
namespace {

using test::Broker;
using test::eventually;
using test::Json;
using ::testing::HasSubstr;

/// A master control of paho's own making.
class Master {
  public:
    explicit Master(const std::string& broker)
        : client_(broker, "master_" + std::to_string(::getpid())) {
        client_.start_consuming();
        // The broker may just be starting.
        EXPECT_TRUE(eventually([this] { return connect(); }));
        client_.subscribe("uagv/v2/+/+/#", 1)->wait();
    }
    ~Master() {
        try {
            client_.disconnect()->wait();
            client_.stop_consuming();
        } catch (const mqtt::exception&) {
            return;  // its broker has gone
        }
    }
    Master(const Master&) = delete;
    Master& operator=(const Master&) = delete;

    void send(const std::string& name, const std::string& text) {
        client_.publish("uagv/v2/ExampleCo/FL-0001/" + name, text, 0, false)->wait();
    }

    /// Reads on until a message of this name pleases; all that the vehicle says obeys the schemas.
    template <typename Pleases>
    bool hears(const std::string& name, Pleases&& pleases) {
        return eventually([&] {
            mqtt::const_message_ptr message;
            while (client_.try_consume_message(&message)) {
                if (!message) {
                    continue;  // the connection was lost
                }
                const FleetMessage heard{message->get_topic(), message->to_string(),
                                         message->get_qos(), message->is_retained()};
                const std::string topic = test::topic_name(heard);
                if (topic == "order" || topic == "instantActions") {
                    continue;
                }
                EXPECT_EQ(test::schema_fault(heard), "") << heard.payload;
                if (topic == name && pleases(Json::parse(heard.payload), heard)) {
                    return true;
                }
            }
            return false;
        });
    }

    bool hears_connection(const std::string& state) {
        return hears("connection", [&state](const Json& json, const FleetMessage&) {
            return json["connectionState"] == state;
        });
    }

  private:
    bool connect() {
        try {
            client_.connect()->wait();
            return true;
        } catch (const mqtt::exception&) {
            return false;
        }
    }

    mqtt::async_client client_;
};

FleetConfig config_at(const std::string& broker) {
    FleetConfig config = test::example_config();
    config.broker = broker;
    config.retry_least = 0.1;
    config.retry_most = 0.3;
    config.state_period = 0.5;
    return config;
}

/// A drive in the loop that a program has: what the client says is obeyed, what it did is told.
class Loop {
  public:
    explicit Loop(const std::string& broker) : client(config_at(broker), FleetVehicle()) {}

    void cycle() {
        for (const FleetEvent& event : client.events()) {
            if (const auto* goals = std::get_if<LinkGoals>(&event)) {
                status.drive.goals = goals->id;
                status.drive.waypoints_left += static_cast<int>(goals->waypoints.size());
                status.drive.state = LinkDriveState::kDriving;
            }
        }
        client.publish(status);
    }

    template <typename Condition>
    bool runs_until(Condition&& condition) {
        return eventually([&] {
            cycle();
            return condition();
        });
    }

    void arrive() {
        status.drive.waypoints_left = 0;
        status.drive.state = LinkDriveState::kArrived;
        client.publish(status);
    }

    FleetStatus status = test::status_at(0.0, 0.0, 0.0);
    FleetClient client;
};

class FleetBroker : public ::testing::Test {
  protected:
    void SetUp() override {
        if (!std::filesystem::exists(test::kMosquitto)) {
            GTEST_SKIP() << "needs " << test::kMosquitto << ", which is not here";
        }
    }
};

TEST_F(FleetBroker, ADeadVehicleLeavesItsLastWill) {
    const Broker broker;
    Master master(broker.address());
    test::Process vehicle({HYBRID_SLAM_FLEET_CHILD, broker.address()});
    ASSERT_TRUE(master.hears_connection("ONLINE"));
    ASSERT_TRUE(master.hears("state", [](const Json&, const FleetMessage&) { return true; }));
    vehicle.kill_now();
    ASSERT_TRUE(master.hears_connection("CONNECTIONBROKEN"));
    Master late(broker.address());
    EXPECT_TRUE(late.hears("connection", [](const Json& json, const FleetMessage& message) {
        return json["connectionState"] == "CONNECTIONBROKEN" && message.is_retained;
    }));
}

TEST_F(FleetBroker, AVehicleSaysGoodBye) {
    const Broker broker;
    Master master(broker.address());
    {
        Loop loop(broker.address());
        ASSERT_TRUE(loop.runs_until([&] { return loop.client.report().is_connected; }));
        ASSERT_TRUE(master.hears_connection("ONLINE"));
    }
    EXPECT_TRUE(master.hears_connection("OFFLINE"));
    Master late(broker.address());
    EXPECT_TRUE(late.hears_connection("OFFLINE")) << "it is retained, and no will came behind it";
}

TEST_F(FleetBroker, AnOrderIsDriven) {
    const Broker broker;
    Master master(broker.address());
    Loop loop(broker.address());
    ASSERT_TRUE(loop.runs_until([&] { return loop.client.report().is_connected; }));
    ASSERT_TRUE(master.hears_connection("ONLINE"));
    master.send("order", test::order("o", 0, 0, 3).dump());
    ASSERT_TRUE(loop.runs_until([&] { return loop.status.drive.waypoints_left == 2; }));
    EXPECT_EQ(loop.status.drive.goals, "o:0");
    EXPECT_TRUE(master.hears("state", [](const Json& state, const FleetMessage&) {
        return state["orderId"] == "o" && state["nodeStates"].size() == 2;
    }));
    loop.arrive();
    EXPECT_TRUE(master.hears("state", [](const Json& state, const FleetMessage&) {
        return state["lastNodeId"] == "n2" && state["nodeStates"].empty();
    }));
    EXPECT_EQ(loop.client.report().counts.orders, 1u);
}

TEST_F(FleetBroker, ViewersSeeThePoseAndTheFactsheetWaits) {
    const Broker broker;
    Loop loop(broker.address());
    ASSERT_TRUE(loop.runs_until([&] { return loop.client.report().is_connected; }));
    ASSERT_TRUE(loop.runs_until([&] { return loop.client.report().published >= 3; }));
    Master late(broker.address());
    EXPECT_TRUE(late.hears(
        "factsheet", [](const Json&, const FleetMessage& message) { return message.is_retained; }));
    loop.status.pose->map_from_robot = {1.0, 2.0, 0.5};
    std::thread drive(
        [&loop] { loop.runs_until([&] { return loop.client.report().published >= 8; }); });
    EXPECT_TRUE(late.hears("visualization", [](const Json& seen, const FleetMessage&) {
        return seen["agvPosition"]["y"] == 2.0;
    }));
    drive.join();
}

TEST_F(FleetBroker, GarbageIsAnsweredWithAnError) {
    const Broker broker;
    Master master(broker.address());
    Loop loop(broker.address());
    ASSERT_TRUE(loop.runs_until([&] { return loop.client.report().is_connected; }));
    ASSERT_TRUE(master.hears_connection("ONLINE"));
    const auto hears_error = [&master](const std::string& words) {
        return master.hears("state", [&words](const Json& state, const FleetMessage&) {
            return state["errors"].dump().find(words) != std::string::npos;
        });
    };
    loop.cycle();
    master.send("order", "nonsense");
    EXPECT_TRUE(hears_error("is not JSON"));
    master.send("order", std::string(400000, ' '));
    EXPECT_TRUE(hears_error("longer than"));
    master.send("instantActions", test::instant(test::action("a", "cancelOrder")).dump());
    EXPECT_TRUE(hears_error("noOrderToCancel"));
}

TEST_F(FleetBroker, AnOrderOutlivesTheBroker) {
    Broker broker;
    Loop loop(broker.address());
    ASSERT_TRUE(loop.runs_until([&] { return loop.client.report().is_connected; }));
    {
        Master master(broker.address());
        // By then it listens, too.
        ASSERT_TRUE(master.hears_connection("ONLINE"));
        master.send("order", test::order("o", 0, 0, 2).dump());
        ASSERT_TRUE(loop.runs_until([&] { return loop.status.drive.waypoints_left == 1; }));
    }
    broker.stop();
    ASSERT_TRUE(loop.runs_until([&] { return !loop.client.report().is_connected; }));
    EXPECT_NE(loop.client.report().trouble, "");
    loop.arrive();
    ASSERT_TRUE(loop.runs_until([&] { return loop.client.report().attempts >= 3; }));
    broker.start();
    ASSERT_TRUE(loop.runs_until([&] { return loop.client.report().connections == 2; }));
    EXPECT_EQ(loop.client.report().trouble, "");
    Master master(broker.address());
    EXPECT_TRUE(master.hears_connection("ONLINE"));
    EXPECT_TRUE(master.hears("state", [](const Json& state, const FleetMessage&) {
        return state["orderId"] == "o" && state["lastNodeId"] == "n1";
    }));
    // It still listens.
    loop.status.pose->map_from_robot = {1.0, 0.0, 0.0};
    loop.cycle();
    master.send("order", test::order("p", 0, 1, 2).dump());
    EXPECT_TRUE(loop.runs_until([&] { return loop.status.drive.goals == "p:0"; }));
}

TEST_F(FleetBroker, ABrokerThatLetsNobodyInIsTold) {
    const Broker broker(false);
    Loop loop(broker.address());
    EXPECT_TRUE(loop.runs_until(
        [&] { return loop.client.report().trouble == "the broker does not let this user in"; }));
    EXPECT_TRUE(loop.runs_until([&] { return loop.client.report().attempts >= 3; }));
    EXPECT_FALSE(loop.client.report().is_connected);
}

TEST(FleetClient, WithoutABrokerTheDriveGoesOn) {
    Loop loop("tcp://127.0.0.1:" + std::to_string(test::free_port()));
    EXPECT_TRUE(loop.runs_until([&] { return loop.client.report().attempts >= 3; }));
    EXPECT_FALSE(loop.client.report().is_connected);
    EXPECT_NE(loop.client.report().trouble, "");
    loop.client.refuse("nothing");
}

TEST(FleetClient, BadConfigsAreRefused) {
    const auto error_of = [](const std::string& broker) {
        return test::error_of([&] { FleetClient client(config_at(broker), {}); });
    };
    EXPECT_THAT(error_of(""), HasSubstr("broker"));
    EXPECT_THAT(error_of("tcp://127.0.0.1:0"), HasSubstr("port"));
    EXPECT_THAT(error_of("http://127.0.0.1:1883"), HasSubstr("tcp://"));
}

}  // namespace
}  // namespace hybrid_slam
