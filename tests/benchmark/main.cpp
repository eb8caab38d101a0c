// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <exception>
#include <iostream>

#include "benchmarks.hpp"

int main(int argc, char** argv) {
    CLI::App app{
        "Measures hybrid_slam against what is asked of it. Prints tables; the exit code is 1 when "
        "a "
        "figure misses."};
    std::vector<std::string> parts{"pairs", "graphs", "logs", "worlds"};
    std::string shared = HYBRID_SLAM_SHARED_DIR;
    std::vector<std::string> overrides;
    app.add_option("parts", parts, "pairs, graphs, logs, worlds (all of them by default)")
        ->check(CLI::IsMember({"pairs", "graphs", "logs", "worlds"}));
    app.add_option("--shared", shared, "folder that holds data/slam2d and data/posegraph");
    app.add_option("--set", overrides, "key=value of the configuration, for logs and worlds");
    CLI11_PARSE(app, argc, argv);
    int misses = 0;
    try {
        for (const std::string& part : parts) {
            misses += part == "pairs"    ? hybrid_slam::run_pairs_benchmark(shared, std::cout)
                      : part == "graphs" ? hybrid_slam::run_graphs_benchmark(shared, std::cout)
                      : part == "logs"
                          ? hybrid_slam::run_logs_benchmark(shared, overrides, std::cout)
                          : hybrid_slam::run_worlds_benchmark(HYBRID_SLAM_WORLDS_DIR, overrides,
                                                              std::cout);
        }
    } catch (const std::exception& error) {
        std::cerr << "hybrid_slam_benchmark: " << error.what() << '\n';
        return 2;
    }
    return misses == 0 ? 0 : 1;
}
