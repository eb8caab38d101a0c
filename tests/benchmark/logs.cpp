// SPDX-License-Identifier: Apache-2.0
#include <fmt/ostream.h>

#include "benchmarks.hpp"
#include "hybrid_slam/logs/carmen_log.hpp"
#include "session.hpp"

namespace hybrid_slam {

namespace {

struct AskedOfLog {
    const char* name;
    double translation;  // metres
    double rotation;     // degrees
    double seconds;      // of CPU; 0 = nothing asked
    double memory;       // MB; 0 = nothing asked
};

constexpr AskedOfLog kAsked[] = {{"mit-csail", 0.045, 1.1, 0.0, 0.0},
                                 {"fr079", 0.065, 0.9, 0.0, 0.0},
                                 {"intel", 0.030, 0.6, 13.0, 120.0}};
constexpr double kSlowestAskedMs = 60.0;

// Relations error of a variant on one log: "m / deg".
std::string score(const std::filesystem::path& log, const std::vector<Relation>& relations,
                  const SlamConfig& config) {
    CarmenLog source(log);
    const Session session = run_session(source, config);
    const RelationsError error = relations_error(session.map.trajectory, relations);
    return fmt::format("{:.4f} / {:.2f} ({:.1f} s CPU)", error.translation.mean,
                       degrees(error.rotation.mean), session.cpu_seconds);
}

int map_one(const AskedOfLog& asked, const std::filesystem::path& folder,
            const std::vector<std::string>& overrides, std::ostream& out) {
    const std::filesystem::path log = folder / (std::string(asked.name) + ".clf.gz");
    const auto relations = read_relations(folder / (std::string(asked.name) + ".relations"));
    CarmenLog source(log);
    const Session session = run_session(source, slam_config(overrides));
    const double memory = peak_memory_mb();  // the shortest log runs first: the peak is this one's
    const RelationsError error = relations_error(session.map.trajectory, relations);
    const ClosureAudit audit = audit_by_relations(session.map, relations);
    int misses = 0;
    const auto check = [&](bool ok) {
        misses += ok ? 0 : 1;
        return ok ? "ok" : "MISS";
    };
    fmt::print(out, "{} ({} scans, {} keyframes)\n", asked.name, session.scans,
               session.map.keyframes.size());
    fmt::print(out, "  relations error   {:.4f} m  {:.3f} deg   asked {:.3f} / {:.1f}   {}\n",
               error.translation.mean, degrees(error.rotation.mean), asked.translation,
               asked.rotation,
               check(error.translation.mean <= asked.translation &&
                     degrees(error.rotation.mean) <= asked.rotation));
    fmt::print(out,
               "  closures          {} accepted, {} wrong, {} undecided, worst {:.2f} m {:.2f} deg"
               "   asked 0 wrong   {}\n",
               audit.accepted, audit.wrong, audit.undecided, audit.worst_translation,
               degrees(audit.worst_rotation), check(audit.wrong == 0));
    fmt::print(out, "  CPU               {:.2f} s ({:.2f} ms a scan)   asked {}   {}\n",
               session.cpu_seconds, 1e3 * session.cpu_seconds / static_cast<double>(session.scans),
               asked.seconds > 0.0 ? fmt::format("{:.0f} s", asked.seconds) : "-",
               asked.seconds > 0.0 ? check(session.cpu_seconds <= asked.seconds) : "");
    fmt::print(out, "  slowest scan      {:.1f} ms   asked {:.0f}   {}\n", session.slowest_scan_ms,
               kSlowestAskedMs, check(session.slowest_scan_ms <= kSlowestAskedMs));
    fmt::print(out, "  peak memory       {:.0f} MB   asked {}   {}\n", memory,
               asked.memory > 0.0 ? fmt::format("{:.0f}", asked.memory) : "-",
               asked.memory > 0.0 ? check(memory <= asked.memory) : "");
    fmt::print(out, "  without the graph {}\n",
               score(log, relations, slam_config({"graph.enabled=false"})));
    fmt::print(out, "  plain ICP         {}\n\n",
               score(log, relations,
                     slam_config({"graph.enabled=false", "odometry.prior=none",
                                  "odometry.reference=previous_scan", "icp.metric=point_to_point",
                                  "icp.kernel=none", "odometry.doubtful_overlap=0"})));
    return misses;
}

}  // namespace

int run_logs_benchmark(const std::filesystem::path& shared_data,
                       const std::vector<std::string>& overrides, std::ostream& out) {
    fmt::print(out, "Mapping real logs, default configuration, one thread\n");
    int misses = 0;
    for (const AskedOfLog& asked : kAsked) {
        misses += map_one(asked, shared_data / "data" / "slam2d", overrides, out);
    }
    return misses;
}

}  // namespace hybrid_slam
