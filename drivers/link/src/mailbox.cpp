// SPDX-License-Identifier: Apache-2.0
#include "mailbox.hpp"

#include <chrono>
#include <iterator>
#include <utility>

namespace hybrid_slam {
namespace {

constexpr std::size_t kMostOrders = 64;
constexpr std::size_t kMostReceived = 256;

using Lock = std::unique_lock<std::mutex>;

template <typename Condition>
void wait(std::condition_variable& changed, Lock& lock, double timeout, Condition&& condition) {
    if (timeout > 0.0) {
        changed.wait_for(lock, std::chrono::duration<double>(timeout), condition);
    }
}

}  // namespace

void Mailbox::put_pose(std::string line, double now) {
    const Lock lock(mutex_);
    report_.poses_replaced += pose_ ? 1 : 0;
    pose_ = {std::move(line), now};
}

void Mailbox::put_invalid_pose() {
    const Lock lock(mutex_);
    ++report_.poses_invalid;
    report_.poses_replaced += pose_ ? 1 : 0;
    pose_.reset();
}

bool Mailbox::put_order(std::string line) {
    const Lock lock(mutex_);
    if (report_.state != LinkState::kConnected || orders_.size() >= kMostOrders) {
        return false;
    }
    orders_.push_back(std::move(line));
    return true;
}

bool Mailbox::wait_connected(double timeout) {
    Lock lock(mutex_);
    const auto is_connected = [this] { return report_.state == LinkState::kConnected; };
    wait(changed_, lock, timeout, is_connected);
    return is_connected();
}

std::vector<ServerMessage> Mailbox::take_received(double timeout) {
    Lock lock(mutex_);
    wait(changed_, lock, timeout, [this] { return !received_.empty(); });
    std::vector<ServerMessage> messages(std::make_move_iterator(received_.begin()),
                                        std::make_move_iterator(received_.end()));
    received_.clear();
    return messages;
}

LinkClientReport Mailbox::report() const {
    const Lock lock(mutex_);
    return report_;
}

std::optional<std::string> Mailbox::next_order() {
    const Lock lock(mutex_);
    if (orders_.empty()) {
        return std::nullopt;
    }
    std::string line = std::move(orders_.front());
    orders_.pop_front();
    return line;
}

std::optional<std::string> Mailbox::next_pose(double now, double stale_after) {
    const Lock lock(mutex_);
    if (!pose_) {
        return std::nullopt;
    }
    WaitingPose pose = std::move(*pose_);
    pose_.reset();
    if (now - pose.since > stale_after) {
        ++report_.poses_stale;
        return std::nullopt;
    }
    return std::move(pose.line);
}

bool Mailbox::has_pose() const {
    const Lock lock(mutex_);
    return pose_.has_value();
}

void Mailbox::connecting() {
    const Lock lock(mutex_);
    report_.state = LinkState::kConnecting;
    ++report_.attempts;
}

void Mailbox::connected() {
    {
        const Lock lock(mutex_);
        report_.state = LinkState::kConnected;
        report_.trouble.clear();
        ++report_.connections;
    }
    changed_.notify_all();
}

void Mailbox::disconnected(const std::string& trouble) {
    const Lock lock(mutex_);
    report_.state = LinkState::kWaiting;
    report_.trouble = trouble;
    orders_.clear();  // who gave them may have gone on; they must not come as a surprise later
}

void Mailbox::came(const ServerMessage& message) {
    {
        const Lock lock(mutex_);
        if (const auto* const refusal = std::get_if<LinkRefusal>(&message)) {
            ++report_.refusals;
            report_.trouble = refusal->reason;
        }
        if (received_.size() >= kMostReceived) {
            received_.pop_front();
            ++report_.received_dropped;
        }
        received_.push_back(message);
    }
    changed_.notify_all();
}

void Mailbox::sent() {
    const Lock lock(mutex_);
    ++report_.sent;
}

}  // namespace hybrid_slam
