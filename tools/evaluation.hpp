// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "hybrid_slam/core/metrics.hpp"

namespace CLI {
class App;
}

namespace hybrid_slam::tools {

/// Where the truth about a trajectory stands, one of the two, and how to hold it against that.
struct YardstickFiles {
    std::filesystem::path relations;
    std::filesystem::path truth;
    TruthAlignment alignment = TruthAlignment::kBestFit;
};
/// `least` files that must be given: 0 or 1.
void add_yardstick_options(CLI::App& command, YardstickFiles& files, int least = 1);

/// How good a trajectory is; has the one for which there was a yardstick.
struct Evaluation {
    std::optional<RelationsError> relations;
    std::optional<TruthError> truth;

    /// The numbers that fit a caption: "0.0211 m, 0.523 deg".
    std::string brief() const;
    /// Name and value of each figure, for the rows of a table; the names are the same for all
    /// evaluations by the same yardstick.
    std::vector<std::pair<std::string, std::string>> figures() const;
};
nlohmann::ordered_json to_json(const Evaluation& evaluation);

/// Measures trajectories against one file.
class Yardstick {
  public:
    /// Reads the file. Throws Error.
    explicit Yardstick(const YardstickFiles& files);

    Evaluation measure(const Trajectory& trajectory) const;
    /// The figures above, for one trajectory, as text for people.
    static std::string report(const Evaluation& evaluation);

    /// Name of the file, without folders.
    const std::string& name() const { return name_; }
    const std::vector<Relation>& relations() const { return relations_; }
    const Trajectory& truth() const { return truth_; }

  private:
    std::string name_;
    TruthAlignment alignment_ = TruthAlignment::kBestFit;
    std::vector<Relation> relations_;
    Trajectory truth_;
};

}  // namespace hybrid_slam::tools
