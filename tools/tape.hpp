// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "hybrid_slam/vision/visual_source.hpp"
#include "input.hpp"
#include "progress.hpp"
#include "settings.hpp"

namespace hybrid_slam::tools {

/// The measurements of a drive with the motion between its images in place of these, by each of
/// several ways to look at them: read and looked at once, replayed as often as one likes. An hour
/// of 541 beams at 12.5 Hz is 130 MB, an hour of images at 30 Hz 15 MB for each way.
class Tape {
  public:
    /// Reads the input to its end, or until a signal comes (see interrupt.hpp); each image is
    /// decoded once and shown to all `ways`. Throws Error for a camera that cannot be.
    Tape(Input& input, const std::vector<VisionConfig>& ways, Progress& progress);

    bool interrupted() const { return interrupted_; }
    std::uint64_t images() const;
    /// Of one of the ways.
    const VisualCounts& counts(std::size_t way) const { return counts_.at(way); }
    const nlohmann::ordered_json& input_counts() const { return input_counts_; }
    const std::vector<std::string>& warnings() const { return warnings_; }

    /// An input that yields what is on the tape, which must outlive it; without a way, or when the
    /// drive has no images, nothing of these.
    std::unique_ptr<Input> replay(std::optional<std::size_t> way) const;

  private:
    friend class TapeSource;

    bool interrupted_ = false;
    std::vector<Measurement> measurements_;           ///< motions are those of the first way
    std::vector<std::vector<VisualMotion>> motions_;  ///< of the further ways, in the same order
    std::vector<VisualCounts> counts_;
    nlohmann::ordered_json input_counts_;
    std::vector<std::string> warnings_;
};

}  // namespace hybrid_slam::tools
