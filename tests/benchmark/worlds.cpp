// SPDX-License-Identifier: Apache-2.0
#include <fmt/ostream.h>

#include <algorithm>

#include "benchmarks.hpp"
#include "hybrid_slam/simulator/simulator.hpp"
#include "session.hpp"

namespace hybrid_slam {

int run_worlds_benchmark(const std::filesystem::path& worlds,
                         const std::vector<std::string>& overrides, std::ostream& out) {
    constexpr int kSeeds = 3;
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::directory_iterator(worlds)) {
        files.push_back(entry.path());
    }
    std::sort(files.begin(), files.end());
    fmt::print(out, "Synthetic worlds with truth, seeds 1 to {}\n", kSeeds);
    fmt::print(out, "{:<20} {:>4} {:>6} {:>9} {:>9} {:>9} {:>8} {:>6} {:>7} {:>9}\n", "world",
               "seed", "scans", "ATE m", "no graph", "deg", "closures", "wrong", "worst m",
               "slowest");
    std::size_t wrong = 0;
    for (const auto& file : files) {
        for (int seed = 1; seed <= kSeeds; ++seed) {
            SimulatorConfig config;
            read_simulator_section(file, config);
            config.seed = seed;
            Simulator simulator(read_world(file), config);
            const Session session = run_session(simulator, slam_config(overrides));
            const TruthError error = truth_error(session.map.trajectory, simulator.truth());
            const TruthError open = truth_error(session.map.odometry_trajectory, simulator.truth());
            const ClosureAudit audit = audit_by_truth(session.map, simulator.truth());
            wrong += audit.wrong;
            fmt::print(
                out,
                "{:<20} {:>4} {:>6} {:>9.3f} {:>9.3f} {:>9.2f} {:>8} {:>6} {:>7.2f} {:>6.1f} ms\n",
                file.stem().string(), seed, session.scans, error.ate_rmse, open.ate_rmse,
                degrees(error.heading_rmse), audit.accepted, audit.wrong, audit.worst_translation,
                session.slowest_scan_ms);
        }
    }
    fmt::print(out, "wrong closures: {}   asked 0   {}\n\n", wrong, wrong == 0 ? "ok" : "MISS");
    return wrong == 0 ? 0 : 1;
}

}  // namespace hybrid_slam
