// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "hybrid_slam/link/link_client.hpp"
#include "hybrid_slam/localization/reference_map.hpp"
#include "hybrid_slam/vehicle/surroundings.hpp"
#include "localization_run.hpp"

namespace CLI {
class App;
}

namespace hybrid_slam::tools {

/// --token, or the environment variable HYBRID_SLAM_TOKEN, which is not seen in a list of
/// processes.
void add_token_option(CLI::App& command, std::string& token);

/// Who is to be told where the vehicle is.
struct PublishOptions {
    std::vector<std::string> servers;  ///< tcp://host:port
    std::string token;
    std::string name = "hybrid-slam localize";  ///< a drive may listen to one name alone
};

/// Sends each pose of a localization to the drives that want it, with what is free in the corridor
/// that the vehicle steers into. Never waits for the network.
class PosePublisher : public LocalizationListener {
  public:
    struct Setup {
        std::shared_ptr<const ReferenceMap> map;
        std::string identity;  ///< of the map
        VehicleConfig vehicle;
        SurroundingsConfig surroundings;
        /// Seconds of the clock that the scans' stamps are of.
        std::function<double()> now;
        /// Time stands while others compute: each drive's answer to the pose before is waited for.
        bool lockstep = false;
    };
    /// Throws Error for an address that is none.
    PosePublisher(const PublishOptions& options, Setup setup);

    void before(Localizer& localizer) override;
    void after(const Frame& frame, const LocalizationResult& result, bool known) override;

    nlohmann::ordered_json counts() const;

  private:
    struct Server {
        std::string name;
        std::unique_ptr<LinkClient> client;
        LinkState said = LinkState::kConnecting;
        std::string trouble;
        double steering = 0.0;  ///< radians, as its drive says
        double answered = 0.0;  ///< stamp of the newest pose that its drive knows
    };

    void listen(Server& server, double patience = 0.0);
    void wait_for_answer(Server& server);
    static void tell_news(Server& server);
    void look_around(const Frame& frame, const LocalizationResult& result);
    /// All that is told to each drive alike.
    LinkPose pose_of(const Frame& frame, const LocalizationResult& result, bool known) const;
    /// What is free where a drive steers.
    void look_along(double steering, const Points& obstacles, LinkPose& pose) const;

    Setup setup_;
    Surroundings surroundings_;
    std::vector<Server> servers_;
    std::optional<Pose2d> asked_;  ///< where somebody says that the vehicle stands
    std::optional<double> sent_;   ///< stamp of the newest pose
};

}  // namespace hybrid_slam::tools
