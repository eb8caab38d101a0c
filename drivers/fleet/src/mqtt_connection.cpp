// SPDX-License-Identifier: Apache-2.0
#include "mqtt_connection.hpp"

#include <mqtt/async_client.h>

#include <atomic>
#include <chrono>
#include <utility>

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/io/endpoint.hpp"
#include "incoming.hpp"

namespace hybrid_slam {
namespace {

constexpr auto kConnectPatience = std::chrono::seconds(5);
constexpr auto kFarewell = std::chrono::seconds(1);

mqtt::message_ptr message_of(const FleetMessage& message) {
    return mqtt::make_message(message.topic, message.payload, message.qos, message.is_retained);
}

mqtt::connect_options options_of(const FleetConfig& config, const FleetMessage& will) {
    mqtt::connect_options options;
    options.set_clean_session(true);
    options.set_mqtt_version(MQTTVERSION_3_1_1);
    options.set_keep_alive_interval(config.keep_alive);
    options.set_connect_timeout(kConnectPatience);
    options.set_will(mqtt::will_options(*message_of(will)));
    if (!config.user.empty()) {
        options.set_user_name(config.user);
        options.set_password(config.password);
    }
    return options;
}

/// MQTT 3.1.1, table 3.1: what a broker answers to a connection.
std::string reason_of(int code) {
    switch (code) {
        case 2:
            return "the broker refuses this client id";
        case 4:
            return "the broker refuses user or password";
        case 5:
            return "the broker does not let this user in";
        default:
            return "the broker does not answer";
    }
}

}  // namespace

struct MqttConnection::Impl {
    Impl(const FleetConfig& fleet_config, Received on_received)
        : config(fleet_config),
          received(std::move(on_received)),
          // Nothing is stored on a disk, nor kept for later: what is old need not be told.
          client("tcp://" + parse_endpoint(config.broker).text(),
                 "hybrid_slam_" + config.manufacturer + "_" + config.serial_number) {
        client.set_connection_lost_handler([this](const std::string&) { is_lost = true; });
        client.set_message_callback([this](const mqtt::const_message_ptr& message) {
            if (message->is_retained()) {
                return;  // from before we listened: nobody waits for that to be done
            }
            const std::string& payload = message->get_payload_ref().str();
            // One byte too long is told as such, and the rest need not be copied.
            received(message->get_topic(),
                     std::string_view(payload).substr(0, kMostMessageBytes + 1));
        });
    }

    void forget(const std::string& reason) {
        trouble = reason;
        state = State::kIdle;
        token.reset();
    }

    const FleetConfig config;
    const Received received;
    std::atomic<bool> is_lost = false;
    State state = State::kIdle;
    std::string trouble;
    mqtt::async_client client;
    mqtt::token_ptr token;  ///< of the attempt
    std::chrono::steady_clock::time_point give_up;
};

MqttConnection::MqttConnection(const FleetConfig& config, Received received) {
    try {
        impl_ = std::make_unique<Impl>(config, std::move(received));
    } catch (const mqtt::exception& error) {
        throw Error(config.broker + ": " + error.what());
    }
}

MqttConnection::~MqttConnection() = default;

void MqttConnection::connect(const FleetMessage& will) {
    try {
        impl_->is_lost = false;
        impl_->token = impl_->client.connect(options_of(impl_->config, will));
        impl_->state = State::kConnecting;
        // Paho's own patience should come first.
        impl_->give_up = std::chrono::steady_clock::now() + 3 * kConnectPatience;
    } catch (const mqtt::exception& error) {
        impl_->forget(error.what());
    }
}

MqttConnection::State MqttConnection::state() {
    if (impl_->state == State::kConnecting && impl_->token->is_complete()) {
        if (impl_->token->get_return_code() == MQTTASYNC_SUCCESS && impl_->client.is_connected()) {
            impl_->state = State::kConnected;
            impl_->trouble.clear();
        } else {
            impl_->forget(reason_of(impl_->token->get_return_code()));
        }
    } else if (impl_->state == State::kConnecting &&
               std::chrono::steady_clock::now() > impl_->give_up) {
        impl_->forget("the broker does not answer");
    } else if (impl_->state == State::kConnected &&
               (impl_->is_lost || !impl_->client.is_connected())) {
        impl_->forget("the broker has gone");
    }
    return impl_->state;
}

void MqttConnection::subscribe(const std::string& topic) {
    try {
        impl_->client.subscribe(topic, 0);
    } catch (const mqtt::exception& error) {
        impl_->trouble = error.what();
    }
}

bool MqttConnection::publish(const FleetMessage& message) {
    try {
        impl_->client.publish(message_of(message));
        return true;
    } catch (const mqtt::exception& error) {
        impl_->trouble = error.what();
        return false;
    }
}

void MqttConnection::close(const FleetMessage& last) {
    if (state() != State::kConnected) {
        return;
    }
    try {
        impl_->client.publish(message_of(last))->wait_for(kFarewell);
        impl_->client.disconnect()->wait_for(kFarewell);
    } catch (const mqtt::exception& error) {
        impl_->trouble = error.what();  // it has gone before we did
    }
    impl_->state = State::kIdle;
}

const std::string& MqttConnection::trouble() const {
    return impl_->trouble;
}

}  // namespace hybrid_slam
