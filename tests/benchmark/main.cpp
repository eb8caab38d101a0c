// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <algorithm>
#include <exception>
#include <functional>
#include <iostream>

#include "benchmarks.hpp"

namespace {

/// A part of the benchmark; returns how many figures miss.
struct Part {
    std::string name;
    std::function<int()> run;
};

}  // namespace

int main(int argc, char** argv) {
    CLI::App app{
        "Measures hybrid_slam against what is asked of it. Prints tables; the exit code is 1 when "
        "a figure misses."};
    std::string shared = HYBRID_SLAM_SHARED_DIR;
    std::vector<std::string> overrides;
    double megabytes = 1000.0;
    double minutes = 10.0;
    const std::vector<Part> all{
        {"pairs", [&] { return hybrid_slam::run_pairs_benchmark(shared, std::cout); }},
        {"graphs", [&] { return hybrid_slam::run_graphs_benchmark(shared, std::cout); }},
        {"logs", [&] { return hybrid_slam::run_logs_benchmark(shared, overrides, std::cout); }},
        {"worlds",
         [&] {
             return hybrid_slam::run_worlds_benchmark(HYBRID_SLAM_WORLDS_DIR, overrides, std::cout);
         }},
        {"forklift",
         [&] {
             return hybrid_slam::run_forklift_benchmark(HYBRID_SLAM_WORLDS_DIR, overrides,
                                                        std::cout);
         }},
        {"recording", [&] { return hybrid_slam::run_recording_benchmark(std::cout); }},
        {"s300", [&] { return hybrid_slam::run_s300_benchmark(shared, megabytes, std::cout); }},
        {"live", [&] { return hybrid_slam::run_live_benchmark(minutes, std::cout); }},
    };
    std::vector<std::string> names;
    for (const Part& part : all) {
        names.push_back(part.name);
    }
    std::vector<std::string> chosen = names;
    chosen.erase(std::remove(chosen.begin(), chosen.end(), "live"), chosen.end());
    app.add_option("parts", chosen, "what to measure (everything but live by default)")
        ->check(CLI::IsMember(names));
    app.add_option("--shared", shared,
                   "folder that holds data/slam2d, posegraph and s300_telegrams");
    app.add_option("--set", overrides, "key=value of the configuration, for logs and worlds");
    app.add_option("--megabytes", megabytes, "of torture for s300")->check(CLI::Range(1.0, 1e6));
    app.add_option("--minutes", minutes, "of live, in real time")->check(CLI::Range(0.05, 1e4));
    CLI11_PARSE(app, argc, argv);
    int misses = 0;
    try {
        for (const Part& part : all) {
            if (std::find(chosen.begin(), chosen.end(), part.name) != chosen.end()) {
                misses += part.run();
            }
        }
    } catch (const std::exception& error) {
        std::cerr << "hybrid_slam_benchmark: " << error.what() << '\n';
        return 2;
    }
    return misses == 0 ? 0 : 1;
}
