// SPDX-License-Identifier: Apache-2.0
#include "map_identity.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <cstring>

namespace hybrid_slam::tools {
namespace {

std::string bytes_of(double value) {
    std::string bytes(sizeof value, '\0');
    std::memcpy(bytes.data(), &value, sizeof value);
    return bytes;
}

}  // namespace

std::string identity_of(const ReferenceMap& map) {
    const StateGrid& grid = map.grid();
    const GridGeometry& geometry = grid.geometry;
    std::string bytes;
    for (const double value :
         {geometry.resolution, geometry.origin.x(), geometry.origin.y(), grid.origin_yaw,
          static_cast<double>(geometry.width), static_cast<double>(geometry.height)}) {
        bytes += bytes_of(value);
    }
    for (const CellState state : grid.states) {
        bytes += static_cast<char>(state);
    }
    // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): zlib counts in unsigned bytes
    const auto* const data = reinterpret_cast<const Bytef*>(bytes.data());
    return fmt::format("{:08x}", crc32_z(0, data, bytes.size()));
}

}  // namespace hybrid_slam::tools
