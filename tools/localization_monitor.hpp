// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "hybrid_slam/core/stopwatch.hpp"
#include "hybrid_slam/localization/localizer.hpp"
#include "progress.hpp"
#include "recorder.hpp"

namespace hybrid_slam::tools {

/// Tells whoever watches how a localization goes: of a recorded drive a progress bar, live a line
/// with the pose (outside of a terminal one every few seconds) and each change of the status.
class LocalizationMonitor {
  public:
    /// `name`: of the drive.
    LocalizationMonitor(const std::string& name, bool live, bool quiet);

    const std::string& name() const { return name_; }

    struct Progressed {
        double share = 0.0;  ///< of the drive; negative when there is no telling
        std::size_t scans = 0;
        double recorded = 0.0;  ///< seconds
    };
    void look(const LocalizationResult& result, const Progressed& progressed);

  private:
    void tell(const LocalizationResult& result);

    std::string name_;
    bool live_;
    Progress bar_;
    StatusLine line_;
    Stopwatch clock_;
    double next_line_ = 0.0;  ///< seconds of the clock
    RateMeter rate_;
    std::optional<LocalizationStatus> status_;
};

}  // namespace hybrid_slam::tools
