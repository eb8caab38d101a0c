// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "hybrid_slam/fleet/fleet_protocol.hpp"

namespace hybrid_slam::test {

/// The standard's own schema of one topic. The validator, which takes long to compile, is out of
/// sight.
class TopicSchema {
  public:
    explicit TopicSchema(const std::string& topic);
    ~TopicSchema();

    /// What is wrong with it; empty: nothing.
    std::string fault(const nlohmann::json& message) const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

std::string topic_name(const FleetMessage& message);

/// The schema's word on one of our messages.
std::string schema_fault(const FleetMessage& message);

}  // namespace hybrid_slam::test
