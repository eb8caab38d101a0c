// SPDX-License-Identifier: Apache-2.0
#include "frame_stream.hpp"

#include <algorithm>
#include <utility>

namespace hybrid_slam::tools {

FrameStream::FrameStream(Input& input)
    : input_(input), assembler_(input.live() ? 0.0 : FrameAssembler::kVisualWait) {}

std::optional<DriveStep> FrameStream::next() {
    DriveStep step;
    if (std::optional<Measurement> measurement = input_.source().next()) {
        if (const auto* motion = std::get_if<VisualMotion>(&*measurement)) {
            step.motion = *motion;
        }
        step.frame = assembler_.push(std::move(*measurement));
    } else {
        step.frame = assembler_.flush();
        if (!step.frame) {
            return std::nullopt;
        }
    }
    if (step.frame) {
        look_at(step.frame->scan);
    }
    return step;
}

void FrameStream::look_at(const Scan& scan) {
    ++frames_;
    saw_anything_ = saw_anything_ || std::any_of(scan.ranges.begin(), scan.ranges.end(),
                                                 [&](float r) { return scan.is_return(r); });
    earliest_ = std::min(earliest_, scan.stamp);
    latest_ = std::max(latest_, scan.stamp);
}

}  // namespace hybrid_slam::tools
