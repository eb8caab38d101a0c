// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "hybrid_slam/core/trajectory.hpp"
#include "hybrid_slam/logs/carmen_log.hpp"
#include "running.hpp"

namespace hybrid_slam::test {
namespace {

using ::testing::HasSubstr;

std::vector<double> scan_stamps(const std::filesystem::path& log) {
    CarmenLog source(log);
    std::vector<double> stamps;
    while (const auto measurement = source.next()) {
        if (const auto* scan = std::get_if<Scan>(&*measurement)) {
            stamps.push_back(scan->stamp);
        }
    }
    return stamps;
}

TEST(Simulate, TruthHasThePoseOfEveryScan) {
    const TempFolder folder;
    write_room(folder);
    const Json json = run_well(folder, "simulate room.yaml --out room.clf.gz --json").json();
    const std::vector<double> stamps = scan_stamps(folder / "room.clf.gz");
    const Trajectory truth = read_tum(folder / "room.truth.tum");
    ASSERT_EQ(truth.size(), stamps.size());
    EXPECT_EQ(json["scans"], stamps.size());
    for (std::size_t i = 0; i < stamps.size(); ++i) {
        EXPECT_NEAR(truth[i].stamp, stamps[i], 1e-6);
    }
    EXPECT_NEAR(truth.front().pose.x(), 1.5, 1e-6);
    EXPECT_NEAR(truth.front().pose.y(), 1.2, 1e-6);
}

TEST(Simulate, SeedDecidesTheBytes) {
    const TempFolder folder;
    write_room(folder);
    run_well(folder, "simulate room.yaml --out a.clf --seed 7");
    run_well(folder, "simulate room.yaml --out b.clf --set seed=7 --quiet");
    run_well(folder, "simulate room.yaml --out c.clf --seed 8");
    EXPECT_TRUE(same_bytes(folder / "a.clf", folder / "b.clf"));
    EXPECT_FALSE(same_bytes(folder / "a.clf", folder / "c.clf"));
    EXPECT_TRUE(same_bytes(folder / "a.truth.tum", folder / "c.truth.tum"));
}

TEST(Simulate, OverridesBeatTheWorld) {
    const TempFolder folder;
    write_room(folder);
    const double slow =
        run_well(folder, "simulate room.yaml --out a.clf --json").json()["duration_s"];
    const double fast = run_well(folder, "simulate room.yaml --out a.clf --json --set speed=2")
                            .json()["duration_s"];
    EXPECT_LT(fast, 0.8 * slow);
}

TEST(Simulate, BrokenWorldNamesTheLine) {
    const TempFolder folder;
    folder.write("broken.yaml", "name: broken\npath: [[0, 0], [1, 0]]\nwalls: [[[0, 0], [1]]]\n");
    const Outcome result = run(folder, "simulate broken.yaml --out o.clf");
    EXPECT_EQ(result.code, 1);
    EXPECT_THAT(result.err, HasSubstr("hybrid-slam: broken.yaml:3: "));
    EXPECT_FALSE(std::filesystem::exists(folder / "o.clf"));
    EXPECT_FALSE(std::filesystem::exists(folder / "o.truth.tum"));
}

}  // namespace
}  // namespace hybrid_slam::test
