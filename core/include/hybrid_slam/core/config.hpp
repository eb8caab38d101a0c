// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace hybrid_slam {

/// One key of a configuration, bound to the struct member that it sets. A config struct lists its
/// keys once, in a function `void describe(ConfigSchema&, XConfig&)`; reading, overriding,
/// validating and writing all go through that list.
struct ConfigField {
    std::string key;                            ///< dotted: "icp.max_iterations"
    std::string help;                           ///< one line with the unit
    std::function<void(std::string_view)> set;  ///< throws Error that says what would be accepted
    std::function<std::string()> get;           ///< the value as text that `set` takes back
    bool is_text = false;                       ///< takes quotes in YAML
    bool is_list = false;                       ///< a YAML sequence
};

class ConfigSchema {
  public:
    void add(std::string_view key, bool& value, std::string_view help);
    void add(std::string_view key, int& value, int least, int most, std::string_view help);
    void add(std::string_view key, double& value, double least, double most, std::string_view help);
    /// One line of text; written in quotes where YAML needs them.
    void add(std::string_view key, std::string& value, std::string_view help);
    /// A list: [1, 2.5], of which each number is in range.
    void add(std::string_view key, std::vector<double>& values, double least, double most,
             std::string_view help);
    /// An angle in radians that is written in degrees; the key ends in _deg.
    void add_degrees(std::string_view key, double& angle, double least_deg, double most_deg,
                     std::string_view help);
    /// An enumeration by names, in the file's spelling.
    template <typename Enum>
    void add(std::string_view key, Enum& value,
             const std::vector<std::pair<std::string_view, Enum>>& names, std::string_view help) {
        std::vector<std::pair<std::string, int>> numbers;
        numbers.reserve(names.size());
        for (const auto& [name, number] : names) {
            numbers.emplace_back(name, static_cast<int>(number));
        }
        add_enum(
            key, numbers, [&value](int number) { value = static_cast<Enum>(number); },
            [&value] { return static_cast<int>(value); }, help);
    }

    /// Keys added while a Section is alive are prefixed: "icp" gives "icp.max_iterations".
    class Section {
      public:
        Section(ConfigSchema& schema, std::string_view name);
        ~Section();
        Section(const Section&) = delete;
        Section& operator=(const Section&) = delete;

      private:
        ConfigSchema& schema_;
        std::string outer_prefix_;
    };

    const std::vector<ConfigField>& fields() const { return fields_; }

    /// Sets the keys that a YAML file names. Throws Error "file:line: ..." for an unknown key (with
    /// the nearest known one), a value of the wrong type or out of range, a repeated key and broken
    /// YAML.
    void load(const std::filesystem::path& file);

    /// Applies one "key=value". Throws Error that names the key.
    void override_with(std::string_view assignment);

    /// The whole configuration as YAML with the help as comments; `load` reads it back to the bit.
    std::string to_yaml() const;

  private:
    void add_enum(std::string_view key, const std::vector<std::pair<std::string, int>>& names,
                  const std::function<void(int)>& set, const std::function<int()>& get,
                  std::string_view help);
    void add_field(std::string_view key, std::string_view help,
                   std::function<void(std::string_view)> set, std::function<std::string()> get);
    void set(std::string_view key, std::string_view value);

    std::string prefix_;
    std::vector<ConfigField> fields_;
};

}  // namespace hybrid_slam
