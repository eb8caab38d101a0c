// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "hybrid_slam/core/measurements.hpp"

namespace hybrid_slam {

/// Where measurements come from: a log, the simulator, a recording, live devices. Pulled, so that
/// all of them run through the same loop.
class Source {
  public:
    Source() = default;
    Source(const Source&) = delete;
    Source& operator=(const Source&) = delete;
    virtual ~Source() = default;

    /// The next measurement in the order in which it was taken; empty at the end. Bad data is
    /// skipped and counted, never thrown.
    virtual std::optional<Measurement> next() = 0;

    /// How much has been read, from 0 to 1; negative when there is no telling (live sources).
    virtual double progress() const { return -1.0; }
};

/// Where measurements go: the writer of a log, a recorder.
class Sink {
  public:
    Sink() = default;
    Sink(const Sink&) = delete;
    Sink& operator=(const Sink&) = delete;
    virtual ~Sink() = default;

    virtual void push(const Measurement& measurement) = 0;
};

}  // namespace hybrid_slam
