// SPDX-License-Identifier: Apache-2.0
// Scans in, poses out: what the README promises to take thirty lines.
#include <hybrid_slam/backend/slam.hpp>
#include <hybrid_slam/core/frame.hpp>
#include <hybrid_slam/simulator/simulator.hpp>
#include <iostream>

namespace hs = hybrid_slam;

int main() {
    hs::World room;
    room.walls = {{{0, 0}, {8, 0}}, {{8, 0}, {8, 6}}, {{8, 6}, {0, 6}}, {{0, 6}, {0, 0}}};
    room.posts = {{{3, 3}, 0.3}};
    room.path = {{1.5, 1.5}, {6, 1.5}, {6, 4.5}, {1.5, 4.5}};
    hs::Simulator source(room, hs::SimulatorConfig{});

    hs::Slam slam{hs::SlamConfig{}};
    hs::FrameAssembler assembler;
    while (auto measurement = source.next()) {
        if (auto frame = assembler.push(std::move(*measurement))) {
            const hs::SlamResult result = slam.process(*frame);
            if (result.keyframe) {
                std::cout << result.stamp << ": " << result.map_from_robot << '\n';
            }
        }
    }
    slam.refine();
    const hs::SlamMap map = slam.map();

    // The map starts at the first pose, so motions are compared, not places.
    const hs::Trajectory& truth = source.truth();
    const hs::Pose2d driven = between(map.trajectory.front().pose, map.trajectory.back().pose);
    const hs::Pose2d true_motion = between(truth.front().pose, truth.back().pose);
    const double error = (driven.translation - true_motion.translation).norm();
    std::cout << map.trajectory.size() << " poses, off by " << error << " m at the end\n";
    return error < 0.1 ? 0 : 1;
}
