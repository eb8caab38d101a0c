// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "hybrid_slam/localization/reference_map.hpp"

namespace hybrid_slam::tools {

/// CRC-32 over the grid of the map, place and cells, as eight hexadecimal digits: poses in maps of
/// one identity mean the same place, wherever the map's files are.
std::string identity_of(const ReferenceMap& map);

}  // namespace hybrid_slam::tools
