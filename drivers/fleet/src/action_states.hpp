// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <deque>
#include <string>

namespace hybrid_slam {

enum class ActionStatus { kWaiting, kRunning, kFinished, kFailed };

struct ActionState {
    std::string id;
    std::string type;
    ActionStatus status = ActionStatus::kWaiting;
    std::string result;

    bool is_over() const {
        return status == ActionStatus::kFinished || status == ActionStatus::kFailed;
    }
};

/// The instant actions since the last order, in the order of their coming.
class ActionStates {
  public:
    static constexpr std::size_t kMost = 100;

    bool has(const std::string& id) const {
        return std::any_of(list_.begin(), list_.end(),
                           [&id](const ActionState& state) { return state.id == id; });
    }

    /// When there are too many, the oldest that is over goes; false when none is.
    bool add(const std::string& id, const std::string& type) {
        if (list_.size() >= kMost) {
            const auto over =
                std::find_if(list_.begin(), list_.end(),
                             [](const ActionState& state) { return state.is_over(); });
            if (over == list_.end()) {
                return false;
            }
            list_.erase(over);
        }
        list_.push_back({id, type, ActionStatus::kRunning, {}});
        return true;
    }

    void set(const std::string& id, ActionStatus status, const std::string& result = {}) {
        for (ActionState& state : list_) {
            if (state.id == id) {
                state.status = status;
                state.result = result;
            }
        }
    }

    bool is_running(const std::string& type) const {
        return std::any_of(list_.begin(), list_.end(), [&type](const ActionState& state) {
            return state.type == type && !state.is_over();
        });
    }

    /// Ends all of a type that are not over; whether there were any.
    bool end_all(const std::string& type, ActionStatus status, const std::string& result = {}) {
        bool is_any = false;
        for (ActionState& state : list_) {
            if (state.type == type && !state.is_over()) {
                state.status = status;
                state.result = result;
                is_any = true;
            }
        }
        return is_any;
    }

    void forget_over() {
        list_.erase(std::remove_if(list_.begin(), list_.end(),
                                   [](const ActionState& state) { return state.is_over(); }),
                    list_.end());
    }

    const std::deque<ActionState>& list() const { return list_; }

  private:
    std::deque<ActionState> list_;
};

}  // namespace hybrid_slam
