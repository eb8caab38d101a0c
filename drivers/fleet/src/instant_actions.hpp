// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "action_states.hpp"
#include "hybrid_slam/fleet/fleet_messages.hpp"
#include "incoming.hpp"
#include "order_book.hpp"

namespace hybrid_slam {

/// What the instant actions start, and when each of them is over.
class InstantActions {
  public:
    /// What is asked of the others.
    struct Outcome {
        std::vector<FleetEvent> events;
        std::vector<FleetProblem> problems;
        bool wants_state = false;
        bool wants_factsheet = false;
        bool is_refused = false;
    };

    InstantActions(const FleetConfig& config, OrderBook& book) : config_(config), book_(book) {}

    /// One that is there already is ignored.
    Outcome start(const FleetAction& action, const FleetStatus& status, double now);

    /// Ends what the drive has done by now; whether anything ended.
    bool follow(const FleetStatus& status, double now);

    /// By hand from now on: nothing waits for the drive any more.
    void drop_for_manual();

    void forget_over() { states_.forget_over(); }
    const ActionStates& states() const { return states_; }

  private:
    struct Initial {
        std::string action;
        FleetInitialPose start;
        std::string last_node;
        double stamp_before = 0.0;
        double deadline = 0.0;
    };

    void begin(const FleetAction& action, const FleetStatus& status, double now, Outcome& out);
    void begin_pause(const FleetAction& action, const FleetStatus& status, Outcome& out);
    void begin_cancel(Outcome& out) const;
    void begin_initial(const FleetAction& action, const FleetStatus& status, double now,
                       Outcome& out);
    bool follow_initial(const FleetStatus& status, double now);

    const FleetConfig& config_;
    OrderBook& book_;
    ActionStates states_;
    std::optional<Initial> initial_;
};

}  // namespace hybrid_slam
