// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "words.hpp"

namespace hybrid_slam {

using Json = nlohmann::json;

/// The members of one JSON object; each call throws Error that names the key.
class JsonFields {
  public:
    explicit JsonFields(const Json& object) : object_(object) {}

    bool has(const char* key) const { return find(key) != nullptr; }
    double number(const char* key) const { return as_number(key, required(key)); }
    std::optional<double> maybe_number(const char* key) const {
        const Json* const value = find(key);
        return value == nullptr ? std::nullopt : std::optional(as_number(key, *value));
    }
    /// A whole number may be written as 2.0, since some languages do.
    int whole(const char* key) const {
        const double value = number(key);
        constexpr double kMost = std::numeric_limits<int>::max();
        if (!(value >= -kMost && value <= kMost) || value != static_cast<int>(value)) {
            throw Error(std::string(key) + ": must be a whole number");
        }
        return static_cast<int>(value);
    }
    bool flag(const char* key) const {
        const Json& value = required(key);
        if (!value.is_boolean()) {
            throw Error(std::string(key) + ": must be true or false");
        }
        return value.get<bool>();
    }
    bool maybe_flag(const char* key) const { return has(key) && flag(key); }
    std::string text(const char* key) const {
        const Json& value = required(key);
        if (!value.is_string()) {
            throw Error(std::string(key) + ": must be a text");
        }
        return value.get<std::string>();
    }
    std::string maybe_text(const char* key) const { return has(key) ? text(key) : std::string(); }
    template <typename Enum, std::size_t Count>
    Enum word(const char* key, const Words<Enum, Count>& words) const {
        return value_of(words, text(key), key);
    }
    const Json& array(const char* key) const {
        const Json& value = required(key);
        if (!value.is_array()) {
            throw Error(std::string(key) + ": must be an array");
        }
        return value;
    }

    static double as_number(const char* key, const Json& value) {
        if (!value.is_number()) {
            throw Error(std::string(key) + ": must be a number");
        }
        return value.get<double>();
    }

  private:
    /// A null is as good as no key.
    const Json* find(const char* key) const {
        const auto found = object_.find(key);
        return found == object_.end() || found->is_null() ? nullptr : &*found;
    }
    const Json& required(const char* key) const {
        const Json* const value = find(key);
        if (value == nullptr) {
            throw Error(std::string(key) + ": is missing");
        }
        return *value;
    }

    const Json& object_;
};

}  // namespace hybrid_slam
