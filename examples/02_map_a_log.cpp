// SPDX-License-Identifier: Apache-2.0
// Maps a CARMEN log and writes a map folder: 02_map_a_log LOG FOLDER
#include <exception>
#include <iostream>
#include <utility>

#include "hybrid_slam/backend/map_folder.hpp"
#include "hybrid_slam/backend/slam.hpp"
#include "hybrid_slam/core/frame.hpp"
#include "hybrid_slam/logs/carmen_log.hpp"

int main(int argc, char** argv) {
    if (argc != 3) {
        std::cerr << "usage: 02_map_a_log LOG FOLDER\n";
        return 2;
    }
    try {
        hybrid_slam::CarmenLog log(argv[1]);
        hybrid_slam::FrameAssembler assembler;
        hybrid_slam::Slam slam{hybrid_slam::SlamConfig()};

        while (auto measurement = log.next()) {
            const auto frame = assembler.push(std::move(*measurement));
            if (!frame) {
                continue;
            }
            const hybrid_slam::SlamResult result = slam.process(*frame);
            for (const hybrid_slam::Closure& closure : result.closures) {
                if (closure.verdict == hybrid_slam::ClosureVerdict::kAccepted) {
                    std::cout << "been here before: keyframe " << closure.from << ", now at "
                              << result.map_from_robot << '\n';
                }
            }
        }
        slam.refine();

        hybrid_slam::MapFolderWriter writer(argv[2]);
        write_map(writer.path(), slam.map());
        writer.commit();
    } catch (const std::exception& error) {
        std::cerr << "02_map_a_log: " << error.what() << '\n';
        return 1;
    }
    return 0;
}
