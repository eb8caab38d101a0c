// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <thread>

#include "hybrid_slam/simulator/camera_moment.hpp"
#include "real_time.hpp"
#include "serve_stage.hpp"

namespace hybrid_slam::tools {

/// Renders in a thread of its own, so that neither telegrams nor the bus wait for an image, and
/// sends each when it is due. What is too slow is left out.
class ServeImages {
  public:
    /// `renderer` is made before the clock starts: it takes a while.
    ServeImages(std::unique_ptr<MomentRenderer> renderer, ServeDevices& devices,
                const RealTime& clock);
    ~ServeImages();
    ServeImages(const ServeImages&) = delete;
    ServeImages& operator=(const ServeImages&) = delete;

    /// Unless nobody is watching: a core is worth more than an image that nobody sees.
    void push(CameraMoment moment);

    std::uint64_t sent() const;
    std::uint64_t dropped() const;

  private:
    void run();
    bool wait_until(double simulated);

    std::unique_ptr<MomentRenderer> renderer_;
    ServeDevices& devices_;
    const RealTime& clock_;
    mutable std::mutex mutex_;
    std::condition_variable changed_;
    std::deque<CameraMoment> moments_;
    std::uint64_t sent_ = 0;
    std::uint64_t dropped_ = 0;
    bool stop_ = false;
    std::thread thread_;
};

}  // namespace hybrid_slam::tools
