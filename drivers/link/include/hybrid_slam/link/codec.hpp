// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "hybrid_slam/link/messages.hpp"

namespace hybrid_slam {

/// Lines are without their line end. Encoders throw Error for what a decoder would refuse: numbers
/// that are not finite or out of range, texts that are too long. Decoders throw Error with a short
/// reason; unknown keys are ignored, unknown types are not.

std::string encode_json(const ClientMessage& message);
std::string encode_json(const ServerMessage& message);
ClientMessage decode_client_json(std::string_view line);
ServerMessage decode_server_json(std::string_view line);

/// The words for a PLC. Only what each end has to write or read: a status loses its names there.
ClientMessage decode_client_text(std::string_view line);
std::string encode_text(const ServerMessage& message);

/// Whether a connection's first line asks for words instead of JSON.
bool is_text_hello(std::string_view line);

}  // namespace hybrid_slam
