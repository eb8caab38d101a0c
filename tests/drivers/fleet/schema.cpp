// SPDX-License-Identifier: Apache-2.0
#include "schema.hpp"

#include <fstream>
#include <nlohmann/json.hpp>
#include <valijson/adapters/nlohmann_json_adapter.hpp>
#include <valijson/schema.hpp>
#include <valijson/schema_parser.hpp>
#include <valijson/validation_results.hpp>
#include <valijson/validator.hpp>

namespace hybrid_slam::test {

struct TopicSchema::State {
    valijson::Schema schema;
};

TopicSchema::TopicSchema(const std::string& topic) : state_(std::make_unique<State>()) {
    std::ifstream file(std::string(HYBRID_SLAM_SOURCE_DIR) + "/tests/drivers/fleet/data/" + topic +
                       ".schema");
    const nlohmann::json document = nlohmann::json::parse(file);
    const valijson::adapters::NlohmannJsonAdapter adapter(document);
    valijson::SchemaParser().populateSchema(adapter, state_->schema);
}
TopicSchema::~TopicSchema() = default;

std::string TopicSchema::fault(const nlohmann::json& message) const {
    valijson::Validator validator(valijson::Validator::kStrongTypes);
    valijson::ValidationResults results;
    const valijson::adapters::NlohmannJsonAdapter adapter(message);
    if (validator.validate(state_->schema, adapter, &results)) {
        return {};
    }
    std::string text;
    valijson::ValidationResults::Error error;
    while (results.popError(error)) {
        for (const std::string& part : error.context) {
            text += part;
        }
        text += ": " + error.description + "\n";
    }
    return text;
}

std::string topic_name(const FleetMessage& message) {
    return message.topic.substr(message.topic.rfind('/') + 1);
}

std::string schema_fault(const FleetMessage& message) {
    static const TopicSchema state("state");
    static const TopicSchema visualization("visualization");
    static const TopicSchema connection("connection");
    static const TopicSchema factsheet("factsheet");
    const std::string name = topic_name(message);
    const TopicSchema& schema = name == "state"           ? state
                                : name == "visualization" ? visualization
                                : name == "connection"    ? connection
                                                          : factsheet;
    return schema.fault(nlohmann::json::parse(message.payload));
}

}  // namespace hybrid_slam::test
