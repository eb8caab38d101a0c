// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
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

std::string_view to_string(TruthAlignment alignment);

/// What a true trajectory tells beyond TruthError.
struct DriftError {
    double best_fit_rmse = 0.0;   ///< metres (ATE), whatever the alignment of the other figures
    double way = 0.0;             ///< metres, along the truth
    double final_position = 0.0;  ///< metres, at the last pose that has a truth
    double final_heading = 0.0;   ///< radians, above 0
    double over = 10.0;           ///< metres of true path, of the following two
    double translation = 0.0;     ///< share of the way, RMS; NaN when the way is shorter
    double rotation = 0.0;        ///< radians in `over` metres, likewise
};

/// One number about a trajectory, for the row of a table; the smaller the better.
struct ErrorFigure {
    std::string name;
    std::string text;
    double value = 0.0;  ///< NaN for what cannot be compared
};

/// How good a trajectory is; has the one for which there was a yardstick.
struct Evaluation {
    std::optional<RelationsError> relations;
    std::optional<TruthError> truth;  ///< or what another trajectory is taken for
    TruthAlignment alignment = TruthAlignment::kBestFit;
    std::optional<DriftError> drift;  ///< with a real truth only

    /// The numbers that fit a caption: "2.11 cm, 0.523 deg".
    std::string brief() const;
    /// The names are the same for all evaluations by the same yardstick.
    std::vector<ErrorFigure> figures() const;
};
nlohmann::ordered_json to_json(const Evaluation& evaluation);

/// Measures trajectories against one file.
class Yardstick {
  public:
    /// Reads the file. Throws Error.
    explicit Yardstick(const YardstickFiles& files);
    /// Another trajectory in place of the truth: what is measured are differences, from the same
    /// first pose on.
    Yardstick(std::string name, Trajectory other);

    Evaluation measure(const Trajectory& trajectory) const;
    /// The figures above, for one trajectory, as text for people.
    static std::string report(const Evaluation& evaluation);

    /// Name of the file, without folders.
    const std::string& name() const { return name_; }
    const std::vector<Relation>& relations() const { return relations_; }
    const Trajectory& truth() const { return truth_; }
    /// Whether there is a true trajectory or true relations.
    bool has_truth() const { return has_truth_; }
    /// What trajectories are held against, and how: "truth.tum, anchored at the first true pose".
    std::string description() const;

  private:
    std::string name_;
    bool has_truth_ = true;
    TruthAlignment alignment_ = TruthAlignment::kBestFit;
    std::vector<Relation> relations_;
    Trajectory truth_;
};

}  // namespace hybrid_slam::tools
