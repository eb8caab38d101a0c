// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/fleet/fleet_client.hpp"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <optional>
#include <string_view>
#include <thread>
#include <utility>

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/core/stopwatch.hpp"
#include "mqtt_connection.hpp"

namespace hybrid_slam {
namespace {

constexpr std::size_t kMostWaiting = 64;  // messages; a master sends few
/// The worker looks at the clock so often, though nobody wakes it.
constexpr auto kRest = std::chrono::milliseconds(50);

const FleetConfig& checked(const FleetConfig& config) {
    if (config.broker.empty()) {
        throw Error("broker: is missing; wanted is tcp://host:1883");
    }
    check(config);
    return config;
}

}  // namespace

/// The worker alone touches the protocol and the connection; the mutex guards what goes between it,
/// the drive's thread and paho's. Nobody holds it while he speaks to paho.
struct FleetClient::Impl {
    struct Received {
        bool is_order;
        std::string text;
    };
    /// What the worker has to do now.
    struct Work {
        std::deque<Received> received;
        std::optional<FleetStatus> status;
        std::vector<std::string> refusals;
        bool is_over = false;
    };

    Impl(const FleetConfig& fleet_config, const FleetVehicle& vehicle)
        : config(checked(fleet_config)),
          protocol(config, vehicle),
          order_topic(protocol.topic("order")),
          actions_topic(protocol.topic("instantActions")),
          retry(config.retry_least),
          connection(config, [this](const std::string& topic,
                                    std::string_view payload) { take(topic, payload); }),
          worker([this] { run(); }) {}

    ~Impl() {
        {
            const std::lock_guard lock(mutex);
            waiting.is_over = true;
        }
        wake.notify_one();
        worker.join();
    }

    void take(const std::string& topic, std::string_view payload) {
        {
            const std::lock_guard lock(mutex);
            ++report.received;
            if (waiting.received.size() >= kMostWaiting) {
                ++report.dropped;  // the newest: what came first may have been answered already
                return;
            }
            waiting.received.push_back({topic == order_topic, std::string(payload)});
        }
        wake.notify_one();
    }

    Work wait_for_work() {
        std::unique_lock lock(mutex);
        wake.wait_for(lock, kRest, [this] {
            return waiting.is_over || waiting.status || !waiting.received.empty() ||
                   !waiting.refusals.empty();
        });
        return std::exchange(waiting, {});
    }

    void run() {
        for (;;) {
            Work work = wait_for_work();
            if (work.is_over) {
                connection.close(protocol.offline());
                return;
            }
            const double now = steady_seconds();
            try {
                work_on(work, now);
                keep_connected(now);
                tell(now);
            } catch (const std::exception&) {
                continue;  // no memory, at worst, for one message; the vehicle drives on
            }
        }
    }

    void work_on(const Work& work, double now) {
        for (const std::string& reason : work.refusals) {
            protocol.refuse(reason);
        }
        // Before the messages: these are judged by where the vehicle is now.
        if (work.status) {
            protocol.update(*work.status, now);
        }
        for (const Received& message : work.received) {
            if (message.is_order) {
                protocol.take_order(message.text, now);
            } else {
                protocol.take_instant_actions(message.text, now);
            }
        }
    }

    void keep_connected(double now) {
        const MqttConnection::State before = state;
        state = connection.state();
        if (state == MqttConnection::State::kConnected && before != state) {
            retry = config.retry_least;
            ++connections;
            // First the ears, then the voice: a master may answer to ONLINE with an order.
            connection.subscribe(order_topic);
            connection.subscribe(actions_topic);
            publish(protocol.online());
            protocol.announce();
        }
        if (state != MqttConnection::State::kIdle) {
            return;
        }
        if (before != state) {
            next_attempt = now + retry;
            retry = std::min(2.0 * retry, config.retry_most);
        } else if (now >= next_attempt) {
            ++attempts;
            connection.connect(protocol.will());
            state = MqttConnection::State::kConnecting;
        }
    }

    void publish(const FleetMessage& message) { published += connection.publish(message) ? 1 : 0; }

    void tell(double now) {
        const bool is_connected = state == MqttConnection::State::kConnected;
        if (is_connected) {
            for (const FleetMessage& message : protocol.due(now)) {
                publish(message);
            }
        }
        std::vector<FleetEvent> fresh = protocol.events();
        const std::lock_guard lock(mutex);
        events.insert(events.end(), fresh.begin(), fresh.end());
        report.is_connected = is_connected;
        report.trouble = connection.trouble();
        report.attempts = attempts;
        report.connections = connections;
        report.published = published;
        report.counts = protocol.counts();
    }

    const FleetConfig config;
    FleetProtocol protocol;
    const std::string order_topic;
    const std::string actions_topic;
    double retry;
    double next_attempt = 0.0;
    MqttConnection::State state = MqttConnection::State::kIdle;
    std::uint64_t attempts = 0;
    std::uint64_t connections = 0;
    std::uint64_t published = 0;

    std::mutex mutex;
    std::condition_variable wake;
    Work waiting;
    std::vector<FleetEvent> events;
    FleetReport report;

    MqttConnection connection;  // calls take()
    std::thread worker;
};

FleetClient::FleetClient(const FleetConfig& config, const FleetVehicle& vehicle)
    : impl_(std::make_unique<Impl>(config, vehicle)) {}

FleetClient::~FleetClient() = default;

std::vector<FleetEvent> FleetClient::events() {
    const std::lock_guard lock(impl_->mutex);
    return std::exchange(impl_->events, {});
}

void FleetClient::publish(const FleetStatus& status) {
    {
        const std::lock_guard lock(impl_->mutex);
        impl_->waiting.status = status;
    }
    impl_->wake.notify_one();
}

void FleetClient::refuse(const std::string& reason) {
    {
        const std::lock_guard lock(impl_->mutex);
        impl_->waiting.refusals.push_back(reason);
    }
    impl_->wake.notify_one();
}

FleetReport FleetClient::report() const {
    const std::lock_guard lock(impl_->mutex);
    return impl_->report;
}

}  // namespace hybrid_slam
