// SPDX-License-Identifier: Apache-2.0
#include "route_finder.hpp"

#include <chrono>
#include <exception>
#include <string>

#include "messages.hpp"

namespace hybrid_slam::tools {

void RouteFinder::serve(Pilot& pilot) {
    if (route_.valid()) {
        if (route_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) {
            return;  // also when another way is wanted by now: one at a time
        }
        try {
            pilot.take(number_, route_.get());
        } catch (const std::exception& error) {
            print_warning(std::string("no way was found: ") + error.what());
            pilot.take(number_, Route());
        }
    }
    const std::optional<RouteRequest> request = pilot.wanted_route();
    if (!request) {
        return;
    }
    number_ = request->number;
    const auto find = [field = field_, vehicle = vehicle_, config = config_, wanted = *request] {
        return plan_route(*field, vehicle, wanted.start, wanted.waypoints, config);
    };
    if (at_once_) {
        pilot.take(number_, find());
    } else {
        route_ = std::async(std::launch::async, find);
    }
}

}  // namespace hybrid_slam::tools
