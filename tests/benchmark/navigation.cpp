// SPDX-License-Identifier: Apache-2.0
#include "navigation.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "hybrid_slam/core/error.hpp"

namespace hybrid_slam {
namespace {

struct Topic {
    const char* name;
    int (*measure)(const NavigationOptions&, const test::LoopMap&, std::ostream&);
};

constexpr Topic kTopics[] = {{"tables", measure_tables},
                             {"random", measure_random_trips},
                             {"faults", measure_faults},
                             {"latency", measure_latency}};

}  // namespace

std::vector<std::string> navigation_topics() {
    std::vector<std::string> names;
    for (const Topic& topic : kTopics) {
        names.emplace_back(topic.name);
    }
    return names;
}

int run_navigation_benchmark(const NavigationOptions& options, std::ostream& out) {
    if (options.program.empty()) {
        throw Error("navigation: the program hybrid-slam was not built");
    }
    const test::WorkFolder folder;
    const test::LoopMap map =
        test::make_loop_map(options.program, options.worlds / "thesis_hall.yaml", folder.path());
    int misses = 0;
    for (const Topic& topic : kTopics) {
        if (std::find(options.topics.begin(), options.topics.end(), topic.name) !=
            options.topics.end()) {
            misses += topic.measure(options, map, out);
            out.flush();
        }
    }
    return misses;
}

}  // namespace hybrid_slam
