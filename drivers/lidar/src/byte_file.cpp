// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <deque>
#include <fstream>
#include <optional>
#include <system_error>
#include <thread>

#include "byte_sources.hpp"
#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/lidar/s300_telegram.hpp"

namespace hybrid_slam {
namespace {

using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;
using Time = std::chrono::time_point<Clock, Seconds>;

/// Bytes alone carry no times. The scan counter tells them: each telegram is handed out when its
/// scanner would have sent it; bytes of no telegram take the time that they take on the line.
class ByteFile : public ByteSource {
  public:
    explicit ByteFile(const LidarConfig& config)
        : config_(config), file_(config.port, std::ios::binary) {
        if (!file_) {
            throw Error(config.port + ": " + std::generic_category().message(errno));
        }
        fill();
    }

    void read(std::vector<std::uint8_t>& bytes, double timeout) override {
        bytes.clear();
        if (pieces_.empty()) {
            return;
        }
        const Time now = Clock::now();
        if (!due_) {
            due_ = now;
        }
        const Time until = now + Seconds(timeout);
        std::this_thread::sleep_until(std::min(*due_, until));
        if (*due_ > until) {
            return;
        }
        const auto end = buffer_.begin() + static_cast<std::ptrdiff_t>(pieces_.front().size);
        bytes.assign(buffer_.begin(), end);
        buffer_.erase(buffer_.begin(), end);
        pieces_.pop_front();
        if (pieces_.empty()) {
            fill();
        }
        if (!pieces_.empty()) {
            // Who was kept waiting does not catch up: a burst is nothing that a scanner sends.
            const Time in_time = *due_ + Seconds(pieces_.front().pause);
            due_ = std::max<Time>(in_time, Clock::now() - kMostLag);
        }
    }

    bool ended() const override { return pieces_.empty(); }

  private:
    struct Piece {
        std::size_t size = 0;
        double pause = 0.0;  // seconds after the piece before
    };

    static constexpr Seconds kMostLag{0.1};
    static constexpr double kMostPause = 1.0;  // seconds; longer ones were pauses of the recording
    static constexpr std::uint64_t kLeftover = 256;  // bytes in a piece that is no telegram
    static constexpr std::size_t kBlock = 4 * S300Decoder::kMostBytes;

    /// Reads on until there is a piece, or nothing more.
    void fill() {
        while (pieces_.empty() && file_) {
            std::vector<char> block(kBlock);
            file_.read(block.data(), static_cast<std::streamsize>(block.size()));
            const auto count = static_cast<std::size_t>(file_.gcount());
            buffer_.insert(buffer_.end(), block.begin(),
                           block.begin() + static_cast<std::ptrdiff_t>(count));
            read_ += count;
            cut(reinterpret_cast<const std::uint8_t*>(block.data()), count);
        }
    }

    void cut(const std::uint8_t* bytes, std::size_t count) {
        decoder_.push(bytes, count);
        S300Telegram telegram;
        while (decoder_.next(telegram)) {
            if (telegram.end > cut_) {
                add(telegram.end, pause_before(telegram));
            }
        }
        // What no telegram has claimed by now: all of it at the end, or when it is too long to
        // become one.
        if (!file_ || read_ - cut_ >= 2 * S300Decoder::kMostBytes) {
            const std::uint64_t end = file_ ? read_ - S300Decoder::kMostBytes : read_;
            while (cut_ < end) {
                const std::uint64_t size = std::min(end - cut_, kLeftover);
                add(cut_ + size, config_.wire_time(static_cast<std::size_t>(size)));
            }
        }
    }

    void add(std::uint64_t end, double pause) {
        pieces_.push_back({static_cast<std::size_t>(end - cut_), pause});
        cut_ = end;
    }

    double pause_before(const S300Telegram& telegram) {
        const std::uint32_t steps = scan_number_ ? telegram.scan_number - *scan_number_ : 0;
        scan_number_ = telegram.scan_number;
        const double pause = steps * config_.count_period;
        const bool plausible = steps > 0 && pause <= kMostPause;
        return plausible ? pause : config_.wire_time(telegram.end - telegram.begin);
    }

    LidarConfig config_;
    std::ifstream file_;
    S300Decoder decoder_;
    std::deque<std::uint8_t> buffer_;  // read but not handed out
    std::deque<Piece> pieces_;         // of the buffer, in their order
    std::uint64_t read_ = 0;           // bytes of the file
    std::uint64_t cut_ = 0;            // bytes of the file that are in a piece
    std::optional<std::uint32_t> scan_number_;
    std::optional<Time> due_;  // of the first piece
};

}  // namespace

std::unique_ptr<ByteSource> open_byte_file(const LidarConfig& config) {
    return std::make_unique<ByteFile>(config);
}

}  // namespace hybrid_slam
