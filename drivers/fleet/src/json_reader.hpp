// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>

#include "fleet_problem.hpp"

namespace hybrid_slam {

using Json = nlohmann::json;

/// The members of one JSON object of a message; each call throws FleetRefusal (validationError)
/// that names the member by its path. Optional members may be null.
class JsonReader {
  public:
    static constexpr std::size_t kMostText = 128;  // bytes of an id, so that states stay small
    static constexpr std::size_t kMostItems = 256;

    JsonReader(const Json& object, std::string path) : object_(object), path_(std::move(path)) {
        if (!object.is_object()) {
            throw FleetRefusal(kValidationError,
                               (path_.empty() ? "the message" : path_) + ": must be an object");
        }
    }

    bool has(const char* key) const { return find(key) != nullptr; }

    std::string text(const char* key) const {
        const Json& value = required(key);
        if (!value.is_string()) {
            fail(key, "must be a text");
        }
        if (value.get_ref<const std::string&>().size() > kMostText) {
            fail(key, "is longer than 128 bytes");
        }
        return value.get<std::string>();
    }

    double number(const char* key) const {
        const Json& value = required(key);
        if (!value.is_number()) {
            fail(key, "must be a number");
        }
        return value.get<double>();
    }
    std::optional<double> maybe_number(const char* key) const {
        return has(key) ? std::optional(number(key)) : std::nullopt;
    }

    /// A whole number may be written as 2.0: to JSON it is the same.
    std::uint32_t whole(const char* key) const {
        const double value = number(key);
        if (!(value >= 0.0 && value <= std::numeric_limits<std::uint32_t>::max()) ||
            value != static_cast<double>(static_cast<std::uint32_t>(value))) {
            fail(key, "must be a whole number from 0 to 4294967295");
        }
        return static_cast<std::uint32_t>(value);
    }

    bool flag(const char* key) const {
        const Json& value = required(key);
        if (!value.is_boolean()) {
            fail(key, "must be true or false");
        }
        return value.get<bool>();
    }

    const Json& array(const char* key) const {
        const Json& value = required(key);
        if (!value.is_array()) {
            fail(key, "must be an array");
        }
        if (value.size() > kMostItems) {
            fail(key, "has more than 256 items");
        }
        return value;
    }

    const Json& value(const char* key) const { return required(key); }

    std::string path(const char* key) const { return path_.empty() ? key : path_ + "." + key; }
    std::string path(const char* key, std::size_t index) const {
        return path(key) + "[" + std::to_string(index) + "]";
    }
    [[noreturn]] void fail(const char* key, const std::string& reason) const {
        throw FleetRefusal(kValidationError, path(key) + ": " + reason);
    }

  private:
    const Json* find(const char* key) const {
        const auto found = object_.find(key);
        return found == object_.end() || found->is_null() ? nullptr : &*found;
    }
    const Json& required(const char* key) const {
        const Json* const value = find(key);
        if (value == nullptr) {
            fail(key, "is missing");
        }
        return *value;
    }

    const Json& object_;
    std::string path_;
};

}  // namespace hybrid_slam
