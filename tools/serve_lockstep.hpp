// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <functional>
#include <optional>

#include "hybrid_slam/lockstep/lockstep_server.hpp"
#include "serve_stage.hpp"

namespace hybrid_slam::tools {

/// A run on virtual time: as fast as everybody computes, and always the same.
class ServeLockstep {
  public:
    static constexpr double kTick = 0.02;  ///< seconds

    ServeLockstep(const ServeScene& scene, ServeStage& stage);

    std::string url() const { return clock_.url(); }
    /// False when `ended` says so before both clients have come.
    bool wait_for_clients(const std::function<bool()>& ended);
    /// One tick; false when the drive has gone.
    bool tick();
    /// Lets the sensors' end read what is on its lines, before these go.
    void finish() { clock_.wait_until_read(); }

  private:
    struct Image {
        double arrival = 0.0;
        EncodedImage jpeg;
    };

    void deliver(const std::vector<LidarBytes>& telegrams);
    void deliver_images(double until);
    void listen(double timeout);
    void hear_all(std::size_t frames);

    ServeStage& stage_;
    LockstepServer clock_;
    std::optional<MomentRenderer> renderer_;
    std::deque<Image> images_;  ///< on their way
    std::vector<CanFrame> heard_;
    std::uint64_t ticks_ = 0;
    std::uint64_t frames_told_ = 0;
};

}  // namespace hybrid_slam::tools
