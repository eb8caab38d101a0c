// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <system_error>
#include <thread>

#include "can_buses.hpp"
#include "deadline.hpp"
#include "hybrid_slam/can/candump.hpp"
#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/text_file.hpp"

namespace hybrid_slam {
namespace {

std::int64_t microseconds_since_1970() {
    return std::chrono::duration_cast<std::chrono::microseconds>(
               std::chrono::system_clock::now().time_since_epoch())
        .count();
}

/// Each line is in the file when `send` returns, so that it can be watched.
class CandumpSink : public CanBus {
  public:
    explicit CandumpSink(const std::string& file)
        : name_("candump:" + file),
          descriptor_(::open(replaceable_file(file).c_str(),
                             O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644)) {
        if (descriptor_ < 0) {
            throw Error(name_ + ": " + std::generic_category().message(errno));
        }
    }
    ~CandumpSink() override { ::close(descriptor_); }

    bool send(const CanFrame& frame) override {
        if (!fault_.empty() || !frame.valid()) {
            ++counts_.dropped;
            return false;
        }
        CandumpLine line;
        line.microseconds = microseconds_since_1970();
        line.frame = frame;
        const std::string text = to_candump(line) + "\n";
        const ssize_t count = ::write(descriptor_, text.data(), text.size());
        if (count != static_cast<ssize_t>(text.size())) {
            fault_ = name_ + ": " +
                     (count < 0 ? std::generic_category().message(errno) : "the disk is full");
            ++counts_.dropped;
            return false;
        }
        ++counts_.sent;
        return true;
    }

    std::optional<CanFrame> receive(double timeout) override {
        if (fault_.empty()) {
            std::this_thread::sleep_for(std::chrono::duration<double>(Deadline(timeout).left()));
        }
        return std::nullopt;
    }

    bool hears() const override { return false; }

  private:
    std::string name_;
    int descriptor_;
};

}  // namespace

std::unique_ptr<CanBus> open_candump_sink(const std::string& file) {
    return std::make_unique<CandumpSink>(file);
}

}  // namespace hybrid_slam
