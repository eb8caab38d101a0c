// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "drivers/scratch_folder.hpp"
#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/simulator/simulated_vehicle.hpp"
#include "hybrid_slam/simulator/simulator.hpp"
#include "support/error_of.hpp"

namespace hybrid_slam::test {
namespace {

using ::testing::HasSubstr;

World read_text(const std::string& text) {
    const ScratchFolder folder;
    return read_world(folder.write("world.yaml", text));
}

TEST(WorldFile, ReadsEverything) {
    const World world = read_text(
        "name: small\n"
        "walls:\n"
        "  - [[0, 0], [4, 0], [4, 3]]\n"
        "  - {points: [[0, 0], [1, 0], [0, 1]], closed: true}\n"
        "boxes:\n"
        "  - {center: [2, 1], size: [2, 1], yaw_deg: 90}\n"
        "posts:\n"
        "  - {center: [1.5, 2.5], radius: 0.25}\n"
        "path: [[0.5, 0.5], [3, 0.5]]\n"
        "laps: 3\n"
        "start_heading_deg: 90\n");
    EXPECT_EQ(world.name, "small");
    ASSERT_EQ(world.walls.size(), 2U + 3U + 4U);
    EXPECT_EQ(world.walls[1].end, Point2(4, 3));
    EXPECT_EQ(world.walls[4].start, Point2(0, 1));
    EXPECT_EQ(world.walls[4].end, Point2(0, 0));
    EXPECT_LT((world.walls[5].start - Point2(1.5, 2.0)).norm(), 1e-12) << "the box, turned";
    ASSERT_EQ(world.posts.size(), 1U);
    EXPECT_EQ(world.posts[0].radius, 0.25);
    EXPECT_EQ(world.path.size(), 2U);
    EXPECT_EQ(world.laps, 3);
    EXPECT_EQ(world.start_heading, kPi / 2.0);
}

TEST(WorldFile, RepeatsInOneDirectionAndInTwo) {
    const World world = read_text(
        "name: rows\n"
        "walls: [{points: [[0, 0], [1, 0]], repeat: {count: 3, step: [0, 2]}}]\n"
        "posts: [{center: [1, 1], radius: 0.1,\n"
        "         repeat: [{count: 4, step: [1, 0]}, {count: 2, step: [0, 5]}]}]\n"
        "path: [[0, 1], [1, 1]]\n");
    ASSERT_EQ(world.walls.size(), 3U);
    EXPECT_EQ(world.walls[2].end, Point2(1, 4));
    ASSERT_EQ(world.posts.size(), 8U);
    Point2 sum(0.0, 0.0);
    for (const Circle& post : world.posts) {
        sum += post.center;
    }
    EXPECT_EQ(sum, Point2(2 * (1 + 2 + 3 + 4), 4 * (1 + 6)));
}

TEST(WorldFile, SimulatorSectionSetsOnlyWhatItNames) {
    const ScratchFolder folder;
    const auto file = folder.write(
        "w.yaml", "name: a\npath: [[0, 0], [1, 0]]\nsimulator: {speed: 1.25, seed: 7}\n");
    SimulatorConfig config;
    config.dropout = 0.5;
    read_simulator_section(file, config);
    EXPECT_EQ(config.speed, 1.25);
    EXPECT_EQ(config.seed, 7);
    EXPECT_EQ(config.dropout, 0.5);
}

TEST(WorldFile, DriveSectionTakesListsOfNumbers) {
    const ScratchFolder folder;
    const auto file =
        folder.write("w.yaml",
                     "name: a\npath: [[0, 0], [1, 0]]\n"
                     "drive: {speed: 0.4, render.covered: [20, 25.5], render.dimmed: '[1, 2]'}\n");
    SimulatedDriveConfig config;
    read_drive_section(file, config);
    EXPECT_EQ(config.speed, 0.4);
    EXPECT_EQ(config.render.covered, (std::vector<double>{20.0, 25.5}));
    EXPECT_EQ(config.render.dimmed, (std::vector<double>{1.0, 2.0}));
}

struct BadWorld {
    const char* text;
    const char* said;
};

class WorldFileErrors : public ::testing::TestWithParam<BadWorld> {};

TEST_P(WorldFileErrors, NameTheLineAndTheKey) {
    try {
        read_text(GetParam().text);
        FAIL() << "was taken";
    } catch (const Error& error) {
        EXPECT_THAT(error.what(), HasSubstr(std::string("world.yaml:") + GetParam().said));
        EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    }
}

INSTANTIATE_TEST_SUITE_P(
    Table, WorldFileErrors,
    ::testing::Values(
        BadWorld{"", "1: no world"}, BadWorld{"hello", "1: no world"},
        BadWorld{"name: a\npath: [[0, 0], [1, 0]\n", "3: "},
        BadWorld{"name: a\n", "1: path: is missing"},
        BadWorld{"path: [[0, 0], [1, 0]]\n", "1: name: is missing"},
        BadWorld{"name: a\nwals: []\n", "2: wals: unknown key"},
        BadWorld{"name: a\nname: b\n", "2: name: repeated key"},
        BadWorld{"name: a\npath: [[0, 0]]\n", "2: path: must be a list of 2"},
        BadWorld{"name: a\npath: [[0, 0], [1]]\n", "2: path: must be two numbers"},
        BadWorld{"name: a\npath: [[0, 0], [1, x]]\n", "2: path: must be a number"},
        BadWorld{"name: a\npath: [[0, 0], [1, .nan]]\n", "2: path: must be a number"},
        BadWorld{"name: a\npath: [[0, 0], [1, 1e9]]\n", "2: path: must be a number"},
        BadWorld{"name: a\nwalls: 5\n", "2: walls: must be a list"},
        BadWorld{"name: a\nwalls:\n  - [[0, 0]]\n", "3: walls: must be a list of 2"},
        BadWorld{"name: a\nwalls:\n  - {closed: true}\n", "3: points: is missing"},
        BadWorld{"name: a\nwalls:\n  - {points: [[0, 0], [1, 1]], closed: 5}\n", "3: closed: must"},
        BadWorld{"name: a\nwalls:\n  - {points: [[0, 0], [1, 1]], open: 5}\n", "3: open: unknown"},
        BadWorld{"name: a\nboxes:\n\n  - {center: [0, 0], size: [1, 0]}\n",
                 "4: size: must be more"},
        BadWorld{"name: a\nboxes:\n  - {center: [0, 0]}\n", "3: size: is missing"},
        BadWorld{"name: a\nboxes: [7]\n", "2: boxes: must be a map"},
        BadWorld{"name: a\nposts:\n  - {center: [0, 0], radius: -1}\n", "3: radius: must be more"},
        BadWorld{
            "name: a\nposts:\n  - {center: [0, 0], radius: 1, repeat: {count: 0, step: [1, 1]}}\n",
            "3: count: must be a whole number"},
        BadWorld{"name: a\nposts:\n  - {center: [0, 0], radius: 1, repeat: []}\n",
                 "3: repeat: must"},
        BadWorld{
            "name: a\nposts:\n  - {center: [0, 0], radius: 1, repeat: [{count: 1000, step: [1, 1]},"
            " {count: 1000, step: [1, 1]}]}\n",
            "3: repeat: makes too many"},
        BadWorld{"name: a\npath: [[0, 0], [1, 0]]\nlaps: 0\n", "3: laps: must be a whole"},
        BadWorld{"name: a\npath: [[0, 0], [1, 0]]\nsimulator: 5\n", "3: simulator: must be a map"},
        BadWorld{"name: a\npath: [[0, 0], [1, 0]]\nsimulator:\n  speeed: 1\n",
                 "4: key 'simulator.speeed': unknown key; did you mean 'simulator.speed'"},
        BadWorld{"name: a\npath: [[0, 0], [1, 0]]\nsimulator:\n  speed: -1\n",
                 "4: key 'simulator.speed': must be a number"},
        BadWorld{"name: a\npath: [[0, 0], [1, 0]]\ndrive:\n  render.covered: [1, x]\n",
                 "4: key 'drive.render.covered': must be a number"},
        BadWorld{"name: a\npath: [[0, 0], [1, 0]]\ndrive:\n  speed: [1]\n",
                 "4: key 'drive.speed': must be a number"},
        BadWorld{"name: a\npath: [[0, 0], [1, 0]]\ndrive:\n  render.covered: [[1, 2]]\n",
                 "4: drive: must hold lines like 'key: value'"}));

TEST(WorldFile, MissingFileIsAnError) {
    EXPECT_THROW(read_world("no_such_world.yaml"), Error);
}

TEST(WorldFile, ReadsPeopleAndNamedPaths) {
    const World world = read_text(
        "name: busy\n"
        "people:\n"
        "  - {way: [[0, 0], [2, 0]], speed: 1.5, radius: 0.3}\n"
        "  - {way: [[5, 5], [6, 6], [7, 5]]}\n"
        "path: [[0, 0], [1, 0]]\n"
        "paths:\n"
        "  back: [[1, 0], [0, 0]]\n"
        "drive: {speed: 0.7}\n");
    ASSERT_EQ(world.people.size(), 2U);
    EXPECT_EQ(world.people[0].speed, 1.5);
    EXPECT_EQ(world.people[0].radius, 0.3);
    EXPECT_EQ(world.people_at(1.0)[0].center, Point2(1.5, 0));
    EXPECT_EQ(world.path_named("").front(), Point2(0, 0));
    EXPECT_EQ(world.path_named("back").front(), Point2(1, 0));
    EXPECT_THAT(error_of([&] { (void)world.path_named("bcak"); }),
                HasSubstr("no path 'bcak'; there are back"));
}

TEST(WorldFile, RefusesPeopleWhoDoNotWalkAndBadDrives) {
    const std::string rest = "path: [[0, 0], [1, 0]]\n";
    EXPECT_THAT(error_of([&] { read_text("name: w\npeople: [{way: [[1, 1], [1, 1]]}]\n" + rest); }),
                HasSubstr("world.yaml:2: way: needs two different points"));
    EXPECT_THAT(error_of([&] { read_text("name: w\npeople: [{walk: 1}]\n" + rest); }),
                HasSubstr("world.yaml:2"));
    EXPECT_THAT(error_of([&] { read_text("name: w\npaths: [1]\n" + rest); }),
                HasSubstr("world.yaml:2: paths: must be a map"));
    EXPECT_THAT(error_of([&] { read_text("name: w\n" + rest + "drive: {sped: 1}\n"); }),
                HasSubstr("world.yaml:3"));
}

}  // namespace
}  // namespace hybrid_slam::test
