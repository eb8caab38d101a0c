// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace hybrid_slam::tools {

/// Plain text in columns: the first to the left, the others to the right.
class Table {
  public:
    explicit Table(std::vector<std::string> header);
    void add_row(std::vector<std::string> cells);
    std::string text() const;  ///< without a line end after the last row

  private:
    std::vector<std::vector<std::string>> rows_;
};

}  // namespace hybrid_slam::tools
