// SPDX-License-Identifier: Apache-2.0
#include <deque>

#include "can_buses.hpp"
#include "deadline.hpp"
#include "hybrid_slam/can/slcan.hpp"
#include "hybrid_slam/core/error.hpp"
#include "io/serial_device.hpp"

namespace hybrid_slam {
namespace {

constexpr double kAnswerTimeout = 0.5;     // seconds
constexpr double kQuiet = 0.05;            // seconds of what an adapter still has to say
constexpr double kMostStuck = 0.3;         // seconds in which it takes or answers nothing
constexpr std::size_t kMostUnsent = 128;   // bytes, 5 frames: what waits longer is an old command
constexpr std::size_t kMostWaiting = 256;  // frames that nobody has fetched

class SlcanBus : public CanBus {
  public:
    SlcanBus(const CanConfig& config, const std::string& device)
        : name_(config.port), silent_(config.slcan_silent), line_(device, config.baud, name_) {
        const std::string rate = rate_command(config.bit_rate);
        // Ends whatever a killed program left on the line; the answers depend on what that was.
        line_.write("\r\rC\r");
        pass_over_answers();
        command(rate, "refuses " + std::to_string(config.bit_rate) + " bits per second");
        command("O", "does not open the bus");
    }

    ~SlcanBus() override {
        try {
            line_.write("\rC\r");
        } catch (const Error&) {  // it is gone
        }
    }

    bool send(const CanFrame& frame) override {
        if (!fault_.empty() || !frame.valid() || !ready_to_send()) {
            ++counts_.dropped;
            return false;
        }
        return guarded([this, &frame] {
            const std::string text = to_slcan(frame);
            const std::size_t taken = line_.write(text);
            if (taken == 0) {
                note_stuck();
                ++counts_.dropped;
                return false;
            }
            // What was begun has to be ended, or the next line would be spoilt too.
            torn_ = text.substr(taken);
            stuck_.reset();
            ++counts_.sent;
            if (!unanswered_) {
                unanswered_.emplace(kMostStuck);
            }
            return true;
        });
    }

    std::optional<CanFrame> receive(double timeout) override {
        const Deadline deadline(timeout);
        while (fault_.empty() && waiting_.empty() && deadline.wait_for(line_.descriptor())) {
            guarded([this] {
                take(line_.read());
                return true;
            });
        }
        if (waiting_.empty()) {
            return std::nullopt;
        }
        const CanFrame frame = waiting_.front();
        waiting_.pop_front();
        ++counts_.received;
        return frame;
    }

  private:
    std::string rate_command(int bit_rate) const {
        try {
            return slcan_bit_rate(bit_rate);
        } catch (const Error& error) {
            throw Error(name_ + ": " + error.what());
        }
    }

    template <typename Work>
    bool guarded(Work&& work) {
        try {
            return work();
        } catch (const Error& error) {
            fault_ = error.what();
            return false;
        }
    }

    void pass_over_answers() {
        constexpr int kMostPieces = 100;  // a bus full of traffic may never be quiet
        double wait = silent_ ? kQuiet : kAnswerTimeout;
        for (int i = 0; i < kMostPieces && Deadline(wait).wait_for(line_.descriptor()); ++i) {
            line_.read();
            wait = kQuiet;
        }
    }

    void command(const std::string& text, const std::string& trouble) {
        if (line_.write(text + "\r") != text.size() + 1) {
            throw Error(name_ + ": takes no bytes");
        }
        const Deadline deadline(kAnswerTimeout);
        while (!silent_ && deadline.wait_for(line_.descriptor()) && !deadline.passed()) {
            for (const SlcanLine& line : parser_.push(line_.read())) {
                if (line.kind == SlcanLine::Kind::kRefused) {
                    throw Error(name_ + ": the adapter " + trouble);
                }
                if (line.kind == SlcanLine::Kind::kDone) {
                    return;
                }
            }
        }
        if (!silent_) {
            throw Error(name_ + ": no answer (is it an SLCAN adapter? is slcan_silent needed?)");
        }
    }

    bool ready_to_send() {
        return guarded([this] {
            // Not all adapters answer frames; one that did and does so no more has died, though the
            // line's buffers go on taking commands that it would obey when it wakes up.
            if (unanswered_ && unanswered_->passed()) {
                take(line_.read());
                if (answers_frames_ && unanswered_) {
                    line_.forget_unsent();
                    throw Error(name_ + ": the adapter answers no more");
                }
            }
            torn_ = torn_.substr(torn_.empty() ? 0 : line_.write(torn_));
            const bool ready = torn_.empty() && line_.unsent() <= kMostUnsent;
            if (!ready) {
                note_stuck();
            }
            return ready;
        });
    }

    void note_stuck() {
        if (!stuck_) {
            stuck_.emplace(kMostStuck);
        } else if (stuck_->passed()) {
            line_.forget_unsent();
            fault_ = name_ + ": the adapter takes nothing any more";
        }
    }

    void take(const std::string& bytes) {
        const std::uint64_t dropped = parser_.dropped();
        for (const SlcanLine& line : parser_.push(bytes)) {
            if (line.kind == SlcanLine::Kind::kFrame) {
                waiting_.push_back(line.frame);
            } else if (line.kind != SlcanLine::Kind::kText && unanswered_) {
                answers_frames_ = true;
                unanswered_.reset();
            }
            counts_.errors += line.kind == SlcanLine::Kind::kRefused ? 1 : 0;
        }
        counts_.errors += parser_.dropped() - dropped;
        while (waiting_.size() > kMostWaiting) {
            waiting_.pop_front();
            ++counts_.dropped;
        }
    }

    std::string name_;
    bool silent_;
    SerialDevice line_;
    SlcanParser parser_;
    std::deque<CanFrame> waiting_;
    std::string torn_;                    // the rest of a line that was taken in part
    std::optional<Deadline> stuck_;       // since it took nothing
    std::optional<Deadline> unanswered_;  // since the first frame that it did not answer
    bool answers_frames_ = false;
};

}  // namespace

std::unique_ptr<CanBus> open_slcan(const CanConfig& config, const std::string& device) {
    return std::make_unique<SlcanBus>(config, device);
}

}  // namespace hybrid_slam
