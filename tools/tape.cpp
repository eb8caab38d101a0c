// SPDX-License-Identifier: Apache-2.0
#include "tape.hpp"

#include <algorithm>
#include <utility>

#include "interrupt.hpp"
#include "visual_input.hpp"

namespace hybrid_slam::tools {
namespace {

/// Hands on one measurement at a time.
class Hatch : public Source {
  public:
    void put(const Measurement& measurement) { held_ = measurement; }
    std::optional<Measurement> next() override { return std::exchange(held_, std::nullopt); }

  private:
    std::optional<Measurement> held_;
};

/// One way to look at the images.
class Viewer {
  public:
    Viewer(const CameraConfig& camera, const VisionConfig& config)
        : odometry_(visual_odometry_of(camera, config)), source_(hatch_, odometry_) {}

    /// What comes of a measurement: nothing of an image that is left out.
    std::optional<Measurement> look_at(const Measurement& measurement) {
        hatch_.put(measurement);
        return source_.next();
    }
    const VisualCounts& counts() const { return source_.counts(); }

  private:
    Hatch hatch_;
    VisualOdometry odometry_;
    VisualSource source_;
};

/// For a progress bar.
class Clock {
  public:
    void see(const Measurement& measurement) {
        if (const auto* scan = std::get_if<Scan>(&measurement)) {
            ++scans_;
            first_ = std::min(first_.value_or(scan->stamp), scan->stamp);
            last_ = std::max(last_.value_or(scan->stamp), scan->stamp);
        }
    }
    std::size_t scans() const { return scans_; }
    double elapsed() const { return first_ ? *last_ - *first_ : 0.0; }

  private:
    std::size_t scans_ = 0;
    std::optional<double> first_;
    std::optional<double> last_;
};

}  // namespace

Tape::Tape(Input& input, const std::vector<VisionConfig>& ways, Progress& progress) {
    std::vector<std::unique_ptr<Viewer>> viewers;
    if (input.camera() != nullptr) {
        for (const VisionConfig& way : ways) {
            viewers.push_back(std::make_unique<Viewer>(*input.camera(), way));
        }
    }
    motions_.resize(viewers.empty() ? 0 : viewers.size() - 1);
    Clock clock;
    while (!interrupted_) {
        std::optional<Measurement> measurement = input.source().next();
        if (!measurement) {
            break;
        }
        std::optional<Measurement> seen;
        for (std::size_t way = 0; way < viewers.size(); ++way) {
            std::optional<Measurement> by_this = viewers[way]->look_at(*measurement);
            if (way == 0) {
                seen = std::move(by_this);
            } else if (by_this && std::holds_alternative<VisualMotion>(*by_this)) {
                motions_[way - 1].push_back(std::get<VisualMotion>(*by_this));
            }
        }
        if (viewers.empty()) {
            seen = std::move(measurement);
        }
        if (seen && !std::holds_alternative<Image>(*seen)) {
            clock.see(*seen);
            measurements_.push_back(std::move(*seen));
            progress.update(input.source().progress(), clock.scans(), clock.elapsed());
        }
        interrupted_ = hybrid_slam::tools::interrupted();
    }
    for (const auto& viewer : viewers) {
        counts_.push_back(viewer->counts());
    }
    input_counts_ = input.counts();
    warnings_ = input.warnings();
    if (!counts_.empty()) {
        // All ways have met the same images.
        const std::vector<std::string> more = warnings_of(counts_.front());
        warnings_.insert(warnings_.end(), more.begin(), more.end());
    }
}

std::uint64_t Tape::images() const {
    return counts_.empty() ? 0 : counts_.front().images;
}

/// Plays a tape.
class TapeSource : public Source {
  public:
    TapeSource(const Tape& tape, std::optional<std::size_t> way) : tape_(tape), way_(way) {}

    std::optional<Measurement> next() override {
        while (place_ < tape_.measurements_.size()) {
            const Measurement& measurement = tape_.measurements_[place_++];
            if (!std::holds_alternative<VisualMotion>(measurement)) {
                return measurement;
            }
            const std::size_t image = image_++;
            if (way_) {
                return *way_ == 0 ? measurement
                                  : Measurement(tape_.motions_.at(*way_ - 1).at(image));
            }
        }
        return std::nullopt;
    }
    double progress() const override {
        return static_cast<double>(place_) /
               static_cast<double>(std::max<std::size_t>(1, tape_.measurements_.size()));
    }

  private:
    const Tape& tape_;
    std::optional<std::size_t> way_;
    std::size_t place_ = 0;
    std::size_t image_ = 0;
};

namespace {

class TapeInput : public Input {
  public:
    TapeInput(const Tape& tape, std::optional<std::size_t> way)
        : tape_(tape), way_(tape.images() > 0 ? way : std::nullopt), source_(tape, way_) {}

    Source& source() override { return source_; }
    nlohmann::ordered_json counts() const override {
        nlohmann::ordered_json counts = tape_.input_counts();
        if (way_) {
            counts["vision"] = to_json(tape_.counts(*way_));
        }
        return counts;
    }
    std::vector<std::string> warnings() const override {
        std::vector<std::string> warnings = tape_.warnings();
        if (way_) {
            const std::vector<std::string> more = warnings_of(tape_.counts(*way_));
            warnings.insert(warnings.end(), more.begin(), more.end());
        }
        return warnings;
    }

  private:
    const Tape& tape_;
    std::optional<std::size_t> way_;
    TapeSource source_;
};

}  // namespace

std::unique_ptr<Input> Tape::replay(std::optional<std::size_t> way) const {
    return std::make_unique<TapeInput>(*this, way);
}

}  // namespace hybrid_slam::tools
