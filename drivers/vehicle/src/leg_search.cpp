// SPDX-License-Identifier: Apache-2.0
#include "leg_search.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <queue>
#include <unordered_map>

#include "goal_distance.hpp"

namespace hybrid_slam {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();
/// Expansions between shots at the goal, for each metre that is still to go: long shots cost more
/// and meet more often something.
constexpr double kShotEvery = 4.0;
/// Turning radii from the goal within which the way to its heading is more than the way around
/// walls.
constexpr double kNearGoal = 12.0;

/// Of the sharpest turn.
const std::vector<double> kShares{0.0, 0.5, -0.5, 1.0, -1.0};
/// Away from a wall, since the overhang swings towards it in a sharp turn.
const std::vector<double> kGentle{0.0, 0.05, -0.05, 0.2, -0.2, 0.5, -0.5, 1.0, -1.0};

struct Node {
    DrivingState state;
    Arc arc;  ///< by which it was reached
    int parent = -1;
    double cost = 0.0;
    double to_go = 0.0;  ///< metres at least
    bool is_closed = false;
};

struct OpenEntry {
    double estimate = 0.0;
    int node = 0;
    /// For a queue with the lowest on top; the number makes ties the same everywhere.
    bool operator<(const OpenEntry& other) const {
        return estimate != other.estimate ? estimate > other.estimate : node > other.node;
    }
};

class LegSearch {
  public:
    LegSearch(const SearchSpace& space, const DrivingCost& driving, const Waypoint& goal)
        : config_(space.config),
          driving_(driving),
          goal_(goal),
          goal_distance_(space.field, goal.position, space.config.cell,
                         std::min({space.vehicle.footprint_front, space.vehicle.footprint_rear,
                                   space.vehicle.footprint_width / 2.0})) {}

    Leg run(const DrivingState& start) {
        add(start, {}, -1, 0.0);
        while (!open_.empty() && since_found_ < config_.improve_nodes) {
            const int index = open_.top().node;
            open_.pop();
            Node& node = nodes_[static_cast<std::size_t>(index)];
            if (node.is_closed || node.cost + node.to_go >= best_cost_) {
                continue;
            }
            node.is_closed = true;
            since_found_ += best_parent_ >= 0 ? 1 : 0;
            if (--until_shot_ <= 0) {
                until_shot_ = static_cast<int>(kShotEvery * node.to_go);
                try_shot(index);
            }
            if (static_cast<int>(nodes_.size()) > config_.max_nodes) {
                return result(PlanStatus::kUnfinished);
            }
            expand(index);
        }
        return result(PlanStatus::kNoWay);
    }

  private:
    std::uint64_t key_of(const Pose2d& pose) const {
        const double turn =
            std::floor(normalize_angle(pose.heading) / (2.0 * kPi) * config_.headings + 0.5);
        const int heading = (static_cast<int>(turn) + config_.headings) % config_.headings;
        const auto part = [this](double metres) {
            return static_cast<std::uint64_t>(
                static_cast<std::int64_t>(std::floor(metres / config_.cell)) & 0xffffff);
        };
        return part(pose.x()) << 40 | part(pose.y()) << 16 | static_cast<std::uint64_t>(heading);
    }

    double least_to_go(const Pose2d& pose) const {
        const double around = goal_distance_.at(pose.translation);
        const double straight = (pose.translation - goal_.position).norm();
        if (!goal_.heading || !std::isfinite(around) || straight > kNearGoal * driving_.radius()) {
            return around;
        }
        const Pose2d goal(goal_.position, *goal_.heading);
        return std::max(around, reeds_shepp_length(between(pose, goal), driving_.radius()));
    }

    void add(const DrivingState& state, const Arc& arc, int parent, double cost) {
        const auto [place, is_new] = places_.try_emplace(key_of(state.map_from_robot), -1);
        if (!is_new) {
            const Node& known = nodes_[static_cast<std::size_t>(place->second)];
            if (known.is_closed || known.cost <= cost) {
                return;
            }
        }
        const double to_go = least_to_go(state.map_from_robot);
        if (!(cost + to_go < best_cost_)) {
            if (is_new) {
                places_.erase(place);
            }
            return;
        }
        place->second = static_cast<int>(nodes_.size());
        nodes_.push_back({state, arc, parent, cost, to_go, false});
        open_.push({cost + config_.greed * to_go, place->second});
    }

    void expand(int index) {
        // Far enough to leave a cell by its diagonal.
        const double length = 1.5 * config_.cell;
        const bool leaving = nodes_[static_cast<std::size_t>(index)].state.leaving;
        for (const double along : {length, -length}) {
            for (const double share : leaving ? kGentle : kShares) {
                const Node& node = nodes_[static_cast<std::size_t>(index)];
                DrivingState state = node.state;
                const Arc arc{along, share / driving_.radius()};
                const double so_far = node.cost;
                if (const auto cost = driving_.drive(state, arc)) {
                    add(state, arc, index, so_far + *cost);
                }
            }
        }
    }

    void try_shot(int index) {
        const Node& node = nodes_[static_cast<std::size_t>(index)];
        double most = best_cost_ - node.cost;
        Arcs arcs = shoot(driving_, node.state, goal_, most);
        if (!arcs.empty() || most < best_cost_ - node.cost) {
            best_cost_ = node.cost + most;
            best_parent_ = index;
            best_shot_ = std::move(arcs);
        }
    }

    Leg result(PlanStatus without) const {
        Leg leg;
        leg.nodes = static_cast<int>(nodes_.size());
        leg.status = best_parent_ >= 0 ? PlanStatus::kFound : without;
        if (best_parent_ < 0) {
            return leg;
        }
        for (int i = best_parent_; nodes_[static_cast<std::size_t>(i)].parent >= 0;
             i = nodes_[static_cast<std::size_t>(i)].parent) {
            leg.arcs.push_back(nodes_[static_cast<std::size_t>(i)].arc);
        }
        std::reverse(leg.arcs.begin(), leg.arcs.end());
        leg.arcs.insert(leg.arcs.end(), best_shot_.begin(), best_shot_.end());
        return leg;
    }

    const PlannerConfig& config_;
    const DrivingCost& driving_;
    const Waypoint& goal_;
    GoalDistance goal_distance_;
    std::vector<Node> nodes_;
    std::unordered_map<std::uint64_t, int> places_;
    std::priority_queue<OpenEntry> open_;
    double best_cost_ = kNever;
    int best_parent_ = -1;
    Arcs best_shot_;
    int since_found_ = 0;
    int until_shot_ = 0;
};

std::vector<Arcs> ways_to(const DrivingCost& driving, const DrivingState& from,
                          const Waypoint& goal) {
    const Pose2d robot_from_map = from.map_from_robot.inverse();
    if (goal.heading) {
        return reeds_shepp_ways(robot_from_map * Pose2d(goal.position, *goal.heading),
                                driving.radius());
    }
    std::vector<Arcs> ways;
    for (const double wider : {1.0, 2.0, 4.0}) {
        for (Arcs& arcs :
             ways_to_position(robot_from_map * goal.position, wider * driving.radius())) {
            ways.push_back(std::move(arcs));
        }
    }
    return ways;
}

}  // namespace

Arcs shoot(const DrivingCost& driving, const DrivingState& from, const Waypoint& goal,
           double& most) {
    const std::vector<Arcs> ways = ways_to(driving, from, goal);
    std::vector<std::pair<double, std::size_t>> order;
    for (std::size_t i = 0; i < ways.size(); ++i) {
        order.emplace_back(driving.least_cost(from, ways[i]), i);
    }
    std::sort(order.begin(), order.end());
    Arcs best;
    for (const auto& [least, i] : order) {
        if (least >= most) {
            break;
        }
        DrivingState state = from;
        const std::optional<double> cost = driving.drive(state, ways[i]);
        if (cost && *cost < most && !state.leaving) {
            most = *cost;
            best = ways[i];
        }
    }
    return best;
}

Leg search_leg(const SearchSpace& space, const DrivingCost& driving, const DrivingState& start,
               const Waypoint& goal) {
    return LegSearch(space, driving, goal).run(start);
}

}  // namespace hybrid_slam
