// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "hybrid_slam/localization/anchored_session.hpp"
#include "settings.hpp"

namespace hybrid_slam::tools {

/// How a session was anchored to a stored map.
struct OntoResult {
    std::string map;  ///< name of the stored one
    Anchoring anchoring;
    std::size_t stored_keyframes = 0;
    std::size_t stored_scans = 0;
    std::size_t gone_points = 0;
    double seconds = 0.0;

    bool anchored() const { return anchoring.verdict == AnchoringVerdict::kAnchored; }
    std::size_t places(PlaceVerdict verdict) const;
    /// Searches whose places were believed.
    std::size_t believed() const;
};

/// A stored map to put a session onto.
class OntoMap {
  public:
    /// Throws Error as read_map does, and for a map without walls.
    explicit OntoMap(const std::filesystem::path& folder);

    /// Where the session is anchored, `map` becomes that of both.
    OntoResult anchor(SlamMap& map, const Settings& settings) const;

    const Trajectory& trajectory() const { return stored_.trajectory; }

  private:
    std::string name_;
    StoredMap stored_;
    std::shared_ptr<const ReferenceMap> reference_;
};

/// All but the seconds.
nlohmann::ordered_json to_json(const OntoResult& result);
/// For people: how it went, or in one line why it did not.
std::string text_of(const OntoResult& result);

}  // namespace hybrid_slam::tools
