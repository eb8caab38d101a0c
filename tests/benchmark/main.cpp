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
    hybrid_slam::VisionOptions vision;
    vision.worlds = HYBRID_SLAM_WORLDS_DIR;
    vision.topics = hybrid_slam::vision_topics();
    hybrid_slam::LocalizationOptions localization;
    localization.worlds = HYBRID_SLAM_WORLDS_DIR;
    localization.topics = hybrid_slam::localization_topics();
    hybrid_slam::NavigationOptions navigation;
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
        {"vision",
         [&] {
             vision.shared = shared;
             vision.overrides = overrides;
             return hybrid_slam::run_vision_benchmark(vision, std::cout);
         }},
        {"localization",
         [&] {
             localization.shared = shared;
             localization.seeds = vision.seeds;
             return hybrid_slam::run_localization_benchmark(localization, std::cout);
         }},
#ifdef HYBRID_SLAM_PROGRAM
        {"navigation",
         [&] {
             navigation.seeds = vision.seeds;
             return hybrid_slam::run_navigation_benchmark(navigation, std::cout);
         }},
#endif
        {"recording", [&] { return hybrid_slam::run_recording_benchmark(std::cout); }},
        {"s300", [&] { return hybrid_slam::run_s300_benchmark(shared, megabytes, std::cout); }},
        {"live", [&] { return hybrid_slam::run_live_benchmark(minutes, std::cout); }},
        {"pipeline",
         [&] {
             return hybrid_slam::run_pipeline_benchmark(HYBRID_SLAM_WORLDS_DIR, minutes, std::cout);
         }},
    };
    std::vector<std::string> names;
    std::vector<std::string> chosen;
    for (const Part& part : all) {
        names.push_back(part.name);
        if (part.name != "live" && part.name != "pipeline" && part.name != "navigation") {
            chosen.push_back(part.name);
        }
    }
    app.add_option("parts", chosen,
                   "what to measure (all but live, pipeline and navigation by default)")
        ->check(CLI::IsMember(names));
    app.add_option("--shared", shared,
                   "folder that holds data/slam2d, posegraph, s300_telegrams and kitti");
    app.add_option("--set", overrides,
                   "key=value of the configuration, for logs, worlds, forklift and vision");
    app.add_option("--megabytes", megabytes, "of torture for s300")->check(CLI::Range(1.0, 1e6));
    app.add_option("--minutes", minutes, "of live and pipeline, in real time")
        ->check(CLI::Range(0.05, 1e4));
    app.add_option("--seeds", vision.seeds, "of vision, localization and navigation, 1 to this")
        ->check(CLI::Range(1, 1000));
    app.add_option("--topics", vision.topics, "of vision (all by default)")
        ->check(CLI::IsMember(hybrid_slam::vision_topics()));
    app.add_option("--places", localization.topics, "of localization (all by default)")
        ->check(CLI::IsMember(hybrid_slam::localization_topics()));
    app.add_option("--poses", localization.poses, "random ones of localization")
        ->check(CLI::Range(1, 1000000));
#ifdef HYBRID_SLAM_PROGRAM
    navigation.program = HYBRID_SLAM_PROGRAM;
    navigation.worlds = HYBRID_SLAM_WORLDS_DIR;
    navigation.topics = hybrid_slam::navigation_topics();
    app.add_option("--program", navigation.program, "hybrid-slam, of navigation");
    app.add_option("--loops", navigation.topics, "of navigation (all by default)")
        ->check(CLI::IsMember(hybrid_slam::navigation_topics()));
    app.add_option("--runs", navigation.runs, "of each fault and random trips of navigation")
        ->check(CLI::Range(1, 100000));
#endif
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
