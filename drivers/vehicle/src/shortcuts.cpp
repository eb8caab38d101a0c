// SPDX-License-Identifier: Apache-2.0
#include "shortcuts.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace hybrid_slam {
namespace {

constexpr double kLeastSpacing = 0.5;  ///< metres between places
constexpr double kMostPlaces = 40.0;   ///< so long ways take longer steps
constexpr std::size_t kSpan = 12;      ///< places that a shortcut may bridge

/// A place on the way, and the cheapest known way there from the place before.
struct Place {
    Pose2d map_from_robot;  ///< on the old way
    Arcs from_last;         ///< the old way from the place before
    double cost = std::numeric_limits<double>::infinity();
    DrivingState state;
    std::size_t before = 0;
    Arcs arcs;  ///< from the place `before`
};

std::vector<Place> places_along(const Pose2d& start, const Arcs& arcs) {
    const double spacing = std::max(kLeastSpacing, length_of(arcs) / kMostPlaces);
    std::vector<Place> places(1);
    places.front().map_from_robot = start;
    Place next;
    next.map_from_robot = start;
    for (const Arc& arc : arcs) {
        const int pieces = std::max(1, static_cast<int>(std::ceil(std::abs(arc.length) / spacing)));
        const double piece = arc.length / pieces;
        for (int i = 0; i < pieces; ++i) {
            next.from_last.push_back({piece, arc.curvature});
            next.map_from_robot =
                next.map_from_robot * Pose2d::exp({piece, 0.0, piece * arc.curvature});
            if (length_of(next.from_last) >= spacing) {
                places.push_back(next);
                next.from_last.clear();
            }
        }
    }
    if (!next.from_last.empty()) {
        places.push_back(next);
    }
    return places;
}

void improve(const DrivingCost& driving, std::vector<Place>& places, std::size_t from,
             std::size_t to, const Waypoint& goal) {
    Place& target = places[to];
    const Place& source = places[from];
    double most = target.cost - source.cost;
    Arcs arcs;
    DrivingState state = source.state;
    if (to == from + 1) {
        // The old way stays possible, so that there always is one.
        arcs = target.from_last;
        most = driving.drive(state, arcs).value_or(std::numeric_limits<double>::infinity());
    } else {
        Waypoint there;
        there.position = target.map_from_robot.translation;
        there.heading = target.map_from_robot.heading;
        arcs = shoot(driving, source.state, to + 1 == places.size() ? goal : there, most);
        if (arcs.empty()) {
            return;
        }
        driving.drive(state, arcs);
    }
    if (source.cost + most < target.cost) {
        target.cost = source.cost + most;
        target.before = from;
        target.arcs = std::move(arcs);
        target.state = state;
    }
}

}  // namespace

Arcs with_shortcuts(const DrivingCost& driving, const DrivingState& start, const Waypoint& goal,
                    const Arcs& arcs) {
    std::vector<Place> places = places_along(start.map_from_robot, arcs);
    places.front().cost = 0.0;
    places.front().state = start;
    for (std::size_t to = 1; to < places.size(); ++to) {
        for (std::size_t from = to; from-- > 0 && to - from <= kSpan;) {
            improve(driving, places, from, to, goal);
        }
    }
    if (!std::isfinite(places.back().cost)) {
        return arcs;
    }
    std::vector<std::size_t> used;
    for (std::size_t i = places.size() - 1; i > 0; i = places[i].before) {
        used.push_back(i);
    }
    Arcs better;
    for (auto i = used.rbegin(); i != used.rend(); ++i) {
        better.insert(better.end(), places[*i].arcs.begin(), places[*i].arcs.end());
    }
    return better;
}

}  // namespace hybrid_slam
