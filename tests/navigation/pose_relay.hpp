// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace hybrid_slam::test {

enum class RelayMode {
    kPass,
    kSilent,     ///< a cable is cut: nothing passes, nobody is told
    kClosed,     ///< both ends are closed, and again when the client comes back
    kRepeatOld,  ///< in place of each new pose, the last one goes on as it was
    kRepeatNew   ///< the same, with the stamp and the age of the new one
};

/// A pose line that went on to the drive.
struct PassedPose {
    std::int64_t wall = 0;  ///< microseconds since 1970
    double stamp = 0.0;
    bool genuine = false;  ///< as it came
    bool known = false;
};

/// The network between `localize` and `drive`, for one client at a time: passes lines on, and
/// knows when it did.
class PoseRelay {
  public:
    /// Throws Error when it cannot listen.
    explicit PoseRelay(std::uint16_t drive_port);
    ~PoseRelay();
    PoseRelay(const PoseRelay&) = delete;
    PoseRelay& operator=(const PoseRelay&) = delete;

    std::uint16_t port() const { return port_; }
    void set(RelayMode mode) { mode_ = mode; }
    std::vector<PassedPose> passed() const;

  private:
    void run();
    void serve_client();
    void close_both();
    void take_from_client();
    void take_from_drive();
    void pass_line(std::string line);

    std::uint16_t drive_port_;
    std::uint16_t port_ = 0;
    int listener_ = -1;
    int client_ = -1;
    int drive_ = -1;
    std::string from_client_;  ///< a line that is not whole yet
    std::string last_pose_;    ///< as it was passed on
    std::atomic<RelayMode> mode_{RelayMode::kPass};
    std::atomic<bool> stop_{false};
    mutable std::mutex mutex_;
    std::vector<PassedPose> passed_;
    std::thread thread_;
};

/// Microseconds since 1970.
std::int64_t wall_microseconds();

/// A TCP port of this computer that was free a moment ago.
std::uint16_t free_port();

}  // namespace hybrid_slam::test
