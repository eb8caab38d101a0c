// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "comparison.hpp"

namespace hybrid_slam::tools {

struct ComparisonRow {
    std::string name;
    std::vector<std::string> cells;  ///< one for each column
    std::vector<bool> best;          ///< likewise; none where nothing is better than another
};

struct ComparisonTable {
    std::vector<std::string> columns;
    std::vector<ComparisonRow> results;
    std::vector<ComparisonRow> cost;  ///< all that differs between two runs on the same drive
    std::vector<std::string> notes;   ///< on the results
    std::vector<std::string> cost_notes;
};

ComparisonTable table_of(const Comparison& comparison);
std::string text_of(const ComparisonTable& table);
nlohmann::ordered_json to_json(const Comparison& comparison);

}  // namespace hybrid_slam::tools
