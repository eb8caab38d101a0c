// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/simulator/world.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "fan_caster.hpp"
#include "hybrid_slam/core/error.hpp"

namespace hybrid_slam {

Circle Person::at(double time) const {
    double length = 0.0;
    for (std::size_t i = 1; i < way.size(); ++i) {
        length += (way[i] - way[i - 1]).norm();
    }
    if (!(length > 0.0)) {
        return {way.front(), radius};
    }
    double left = std::fmod(std::max(time, 0.0) * speed, 2.0 * length);
    left = std::min(left, 2.0 * length - left);  // on the way back
    for (std::size_t i = 1; i < way.size(); ++i) {
        const Eigen::Vector2d leg = way[i] - way[i - 1];
        if (left <= leg.norm() && leg.norm() > 0.0) {
            return {way[i - 1] + left / leg.norm() * leg, radius};
        }
        left -= leg.norm();
    }
    return {way.back(), radius};
}

const Points& World::path_named(const std::string& path_name) const {
    if (path_name.empty()) {
        return path;
    }
    const auto found = paths.find(path_name);
    if (found != paths.end()) {
        return found->second;
    }
    std::vector<std::string> names;
    for (const auto& [known, points] : paths) {
        names.push_back(known);
    }
    throw Error(fmt::format("world {}: no path '{}'; {}", name, path_name,
                            names.empty() ? std::string("it names none")
                                          : fmt::format("there are {}", fmt::join(names, ", "))));
}

std::vector<Circle> World::people_at(double time) const {
    std::vector<Circle> circles;
    circles.reserve(people.size());
    for (const Person& person : people) {
        circles.push_back(person.at(time));
    }
    return circles;
}

double World::cast_ray(const Point2& origin, const Eigen::Vector2d& direction) const {
    double nearest = kNothingHit;
    for (const Segment& wall : walls) {
        nearest = std::min(nearest, hybrid_slam::cast_ray(wall, origin, direction));
    }
    for (const Circle& post : posts) {
        nearest = std::min(nearest, hybrid_slam::cast_ray(post, origin, direction));
    }
    return nearest;
}

}  // namespace hybrid_slam
