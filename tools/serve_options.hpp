// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "serve_unplug.hpp"
#include "settings.hpp"

namespace CLI {
class App;
}

namespace hybrid_slam::tools {

/// `simulate --serve`: the forklift and its sensors as bytes.
struct ServeOptions {
    std::filesystem::path folder = "sim";
    std::filesystem::path world;
    std::filesystem::path robot;  ///< empty: the defaults
    std::string path;             ///< whose first leg is the start, unless `start` says it
    Overrides overrides;
    std::optional<int> seed;
    bool no_camera = false;
    std::vector<double> start;  ///< metres, metres, degrees; empty: the path's
    double duration = 0.0;      ///< seconds; 0 = until a signal
    bool lockstep = false;
    bool images = false;  ///< the camera in lockstep too
    int camera_port = 0;  ///< 0 = any
    std::vector<std::string> unplug;
    bool json = false;
};

/// --serve and all that goes with it alone.
void add_serve_options(CLI::App& command, ServeOptions& options);
/// Throws CLI::ValidationError when one of them stands there without --serve.
void expect_served(const CLI::App& command);

int run_serve(const ServeOptions& options);

}  // namespace hybrid_slam::tools
