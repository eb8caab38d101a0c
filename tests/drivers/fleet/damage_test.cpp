// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <random>

#include "fleet_truck.hpp"

namespace hybrid_slam {
namespace {

using test::FleetTruck;
using test::Json;
using Random = std::mt19937;

std::size_t below(Random& random, std::size_t count) {
    return std::uniform_int_distribution<std::size_t>(0, count - 1)(random);
}

/// A few bytes changed, removed, repeated or put in.
std::string with_damaged_bytes(std::string text, Random& random) {
    const std::string spice = "{}[]\",:-+.eE0129nulltrue \t\\u\xff\x01";
    for (std::size_t i = 1 + below(random, 3); i > 0 && !text.empty(); --i) {
        const std::size_t place = below(random, text.size());
        switch (below(random, 3)) {
            case 0:
                text[place] = spice[below(random, spice.size())];
                break;
            case 1:
                text.erase(place, 1 + below(random, 8));
                break;
            default:
                text.insert(place, 1, spice[below(random, spice.size())]);
        }
    }
    return text;
}

/// One value anywhere replaced by one of another kind, or gone.
Json with_damaged_value(const Json& message, Random& random) {
    const Json flat = message.flatten();
    const auto member = std::next(flat.begin(), static_cast<long>(below(random, flat.size())));
    Json::json_pointer pointer(member.key());
    while (pointer != Json::json_pointer("") && below(random, 3) == 0) {
        pointer = pointer.parent_pointer();
    }
    if (pointer.empty()) {
        return Json();
    }
    static const Json strange = {nullptr,
                                 true,
                                 -1,
                                 0,
                                 1e300,
                                 4294967296,
                                 "",
                                 "n1",
                                 "a",
                                 {},
                                 Json::array(),
                                 Json::array({1}),
                                 2,
                                 false,
                                 1.25,
                                 "\n",
                                 std::string(200, 'x')};
    Json spoiled = message;
    spoiled[pointer] = strange[below(random, strange.size())];
    return spoiled;
}

/// A long time of a truck and a master control whose messages are damaged on the way.
void run(unsigned seed, int& taken, int& refused) {
    Random random(seed);
    FleetTruck truck;
    for (std::uint32_t step = 0; step < 60; ++step) {
        const auto here = static_cast<std::uint32_t>(truck.status.pose->map_from_robot.x() + 0.5);
        Json message = test::order("o" + std::to_string(below(random, 3)), step, here,
                                   1 + static_cast<std::uint32_t>(below(random, 4)),
                                   static_cast<std::uint32_t>(below(random, 2)));
        const char* const types[] = {"cancelOrder",  "startPause",       "stopPause",
                                     "stateRequest", "factsheetRequest", "dance"};
        Json actions = test::instant(
            Json::array({test::action("a" + std::to_string(step), types[below(random, 6)]),
                         test::init_position("i" + std::to_string(step), here, 0.0, 0.0)}));
        if (below(random, 2) == 0) {
            message = with_damaged_value(message, random);
            actions = with_damaged_value(actions, random);
        }
        const bool is_torn = below(random, 3) == 0;
        const std::string text = message.dump();
        truck.protocol.take_order(is_torn ? with_damaged_bytes(text, random) : text, truck.now);
        truck.protocol.take_instant_actions(
            is_torn ? with_damaged_bytes(actions.dump(), random) : actions.dump(), truck.now);
        truck.take_events();
        if (!truck.queue.empty() && below(random, 2) == 0) {
            truck.drive();
        } else {
            truck.status.drive.mode =
                below(random, 10) == 0 ? LinkMode::kManual : LinkMode::kAutomatic;
            truck.tell();
        }
        truck.state();  // and what it publishes obeys the schemas
    }
    taken += static_cast<int>(truck.protocol.counts().orders);
    refused += static_cast<int>(truck.protocol.counts().orders_refused);
    for (const FleetEvent& event : truck.events) {
        if (const auto* goals = std::get_if<LinkGoals>(&event)) {
            EXPECT_FALSE(goals->waypoints.empty());
            for (const LinkWaypoint& waypoint : goals->waypoints) {
                EXPECT_TRUE(waypoint.place.allFinite());
            }
        }
    }
}

TEST(FleetDamage, NoMessageBreaksAnything) {
    int taken = 0;
    int refused = 0;
    for (unsigned seed = 1; seed <= 16; ++seed) {
        run(seed, taken, refused);
    }
    // Both kinds are many, or this would test little.
    EXPECT_GT(taken, 80);
    EXPECT_GT(refused, 240);
}

}  // namespace
}  // namespace hybrid_slam
