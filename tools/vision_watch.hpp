// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "hybrid_slam/core/measurements.hpp"

namespace hybrid_slam::tools {

/// A while during which the images told less than they should.
struct BadSpell {
    VisualStatus status = VisualStatus::kTooDark;  ///< of most of its images
    double from = 0.0;                             ///< seconds
    double to = 0.0;                               ///< seconds

    double duration() const { return to - from; }
};

/// What came of the images of a drive.
struct Vision {
    std::size_t images = 0;
    std::map<VisualStatus, std::size_t> statuses;
    std::vector<BadSpell> spells;  ///< those of at least kLeastSpell seconds
    std::size_t extrapolated = 0;  ///< scans newer than the newest image, however little
    std::size_t late = 0;          ///< of these: by more than kLateImage seconds

    std::size_t with(VisualStatus status) const;
    std::size_t usable() const;
    /// What is to be warned of: "camera too dark for 5.0 s".
    std::vector<std::string> warnings() const;

    static constexpr double kLeastSpell = 1.0;
    static constexpr double kLateImage = 0.1;  ///< three images of a webcam
};

/// "too dark" and the like, for people.
std::string words_for(VisualStatus status);

/// Watches the images of a drive go by.
class VisionWatch {
  public:
    void see(const VisualMotion& motion);
    /// A scan, and the seconds that it was newer than the newest image.
    void see_scan(const std::optional<double>& lag);
    Vision finish();

  private:
    void end_spell();

    Vision vision_;
    std::optional<double> newest_;  ///< stamp, seconds
    std::optional<BadSpell> spell_;
    std::map<VisualStatus, std::size_t> spell_statuses_;
};

}  // namespace hybrid_slam::tools
