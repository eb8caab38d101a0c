// SPDX-License-Identifier: Apache-2.0
#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <optional>
#include <system_error>

#include "can_buses.hpp"
#include "deadline.hpp"
#include "hybrid_slam/core/error.hpp"

namespace hybrid_slam {
namespace {

constexpr double kMostStuck = 0.3;  // seconds in which it takes nothing

can_frame to_kernel(const CanFrame& frame) {
    can_frame raw{};
    raw.can_id =
        frame.id | (frame.extended ? CAN_EFF_FLAG : 0U) | (frame.remote ? CAN_RTR_FLAG : 0U);
    raw.can_dlc = frame.size;
    std::copy(frame.data.begin(), frame.data.end(), raw.data);
    return raw;
}

CanFrame from_kernel(const can_frame& raw) {
    CanFrame frame;
    frame.extended = (raw.can_id & CAN_EFF_FLAG) != 0;
    frame.remote = (raw.can_id & CAN_RTR_FLAG) != 0;
    frame.id = raw.can_id & (frame.extended ? CAN_EFF_MASK : CAN_SFF_MASK);
    frame.size = std::min<std::uint8_t>(raw.can_dlc, CAN_MAX_DLEN);
    std::copy_n(raw.data, frame.remote ? 0 : frame.size, frame.data.begin());
    return frame;
}

class SocketCan : public CanBus {
  public:
    SocketCan(int descriptor, std::string name) : name_(std::move(name)), descriptor_(descriptor) {}
    ~SocketCan() override { ::close(descriptor_); }

    bool send(const CanFrame& frame) override {
        if (!fault_.empty() || !frame.valid()) {
            ++counts_.dropped;
            return false;
        }
        const can_frame raw = to_kernel(frame);
        if (::send(descriptor_, &raw, sizeof raw, MSG_DONTWAIT | MSG_NOSIGNAL) == sizeof raw) {
            ++counts_.sent;
            stuck_.reset();
            return true;
        }
        ++counts_.dropped;
        stuck_ = stuck_.value_or(Deadline(kMostStuck));
        if (stuck_->passed()) {
            // What lies in the queue must not go out when the plug is back: closing drops it.
            fault_ = name_ + ": takes no frames (does anybody on the bus acknowledge?)";
            return false;
        }
        // Full queues empty themselves as soon as anybody on the bus acknowledges.
        if (errno != EAGAIN && errno != ENOBUFS && errno != EINTR) {
            fail();
        }
        return false;
    }

    std::optional<CanFrame> receive(double timeout) override {
        const Deadline deadline(timeout);
        while (fault_.empty() && deadline.wait_for(descriptor_)) {
            can_frame raw{};
            const ssize_t count = ::recv(descriptor_, &raw, sizeof raw, MSG_DONTWAIT);
            if (count == sizeof raw && (raw.can_id & CAN_ERR_FLAG) == 0) {
                ++counts_.received;
                return from_kernel(raw);
            }
            note_trouble(count, raw);
        }
        return std::nullopt;
    }

  private:
    void fail() { fault_ = name_ + ": " + std::generic_category().message(errno); }

    void note_trouble(ssize_t count, const can_frame& raw) {
        if (count < 0) {
            if (errno != EAGAIN && errno != EINTR) {
                fail();
            }
        } else if (count == 0) {
            fault_ = name_ + ": closed";
        } else {
            ++counts_.errors;
            if (count == sizeof raw && (raw.can_id & CAN_ERR_BUSOFF) != 0) {
                fault_ = name_ + ": bus off (wiring, termination or bit rate?)";
            }
        }
    }

    std::string name_;
    int descriptor_;
    std::optional<Deadline> stuck_;  // since it took nothing
};

void check_interface(int descriptor, const std::string& interface) {
    const std::string advice =
        " (sudo ip link set " + interface + " up type can bitrate 250000; or slcan:, candump:)";
    ifreq request{};
    if (interface.size() >= sizeof request.ifr_name) {
        throw Error(interface + ": too long for the name of an interface");
    }
    std::copy(interface.begin(), interface.end(), request.ifr_name);
    if (ioctl(descriptor, SIOCGIFFLAGS, &request) != 0) {
        throw Error(interface + ": " + std::generic_category().message(errno) + advice);
    }
    if ((request.ifr_flags & IFF_UP) == 0) {
        throw Error(interface + ": is down" + advice);
    }
}

}  // namespace

std::unique_ptr<CanBus> socket_can_on(int descriptor, const std::string& name) {
    return std::make_unique<SocketCan>(descriptor, name);
}

std::unique_ptr<CanBus> open_socket_can(const std::string& interface) {
    const int descriptor = ::socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC, CAN_RAW);
    if (descriptor < 0) {
        const bool missing = errno == EAFNOSUPPORT || errno == EPROTONOSUPPORT;
        throw Error(interface + ": " +
                    (missing ? "this kernel has no SocketCAN; slcan:/dev/ttyACM0 (a serial "
                               "adapter) and candump:FILE (a dry run) need none"
                             : std::generic_category().message(errno)));
    }
    auto bus = socket_can_on(descriptor, interface);
    check_interface(descriptor, interface);
    const can_err_mask_t errors = CAN_ERR_BUSOFF | CAN_ERR_CRTL | CAN_ERR_ACK;
    setsockopt(descriptor, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, &errors, sizeof errors);
    sockaddr_can address{};
    address.can_family = AF_CAN;
    address.can_ifindex = static_cast<int>(if_nametoindex(interface.c_str()));
    if (::bind(descriptor, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
        throw Error(interface + ": " + std::generic_category().message(errno));
    }
    return bus;
}

}  // namespace hybrid_slam
