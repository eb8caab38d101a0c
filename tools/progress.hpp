// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>

#include "measure.hpp"

namespace hybrid_slam::tools {

/// A bar on standard error with scans per second and the real-time factor, when that is a terminal.
class Progress {
  public:
    Progress(std::string label, bool quiet);
    ~Progress();  ///< removes the bar
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;

    /// `share` from 0 to 1, negative when there is no telling; `recorded` in seconds of the log.
    void update(double share, std::size_t scans, double recorded);
    /// What goes on after the last scan.
    void say(const std::string& what);

  private:
    std::string label_;
    bool visible_;
    Stopwatch clock_;
    double drawn_at_ = 0.0;
};

}  // namespace hybrid_slam::tools
