// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <utility>
#include <vector>

#include "hybrid_slam/core/metrics.hpp"
#include "running.hpp"
#include "support/markup.hpp"

namespace hybrid_slam::test {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

/// A few seconds with a small camera that is covered for a while, in the folder sim1.
void simulate_with_images(const TempFolder& folder) {
    write_room(folder);
    folder.write("small.yaml",
                 "camera:\n  rate: 15\n  model: {width: 160, height: 120, fx: 180, fy: 180, "
                 "cx: 80, cy: 60, k1: 0, k2: 0, p1: 0, p2: 0}\n");
    run_well(folder,
             "simulate room.yaml --robot small.yaml --out sim1 -q --set distance=2.5 --set "
             "speed=0.8 --set 'render.covered=[1.5,2.7]'");
}

Json variant(const Json& comparison, const std::string& name) {
    for (const Json& one : comparison["variants"]) {
        if (one["name"] == name) {
            return one;
        }
    }
    ADD_FAILURE() << name;
    return {};
}

void expect_all_variants(const TempFolder& folder, const Json& json) {
    std::vector<std::string> names;
    for (const Json& one : json["variants"]) {
        names.push_back(one["name"]);
    }
    EXPECT_THAT(names, ElementsAre("plain ICP", "VO only, thesis", "VO only", "thesis pipeline",
                                   "VO-seeded ICP", "VO-seeded ICP + graph"));
    EXPECT_EQ(json["yardstick"], "truth.tum");
    TruthOptions first;
    first.alignment = TruthAlignment::kFirstPose;
    const TruthError error = truth_error(read_tum(folder / "there/vo_seeded_icp_graph.tum"),
                                         read_tum(folder / "sim1/truth.tum"), first);
    const Json best = variant(json, "VO-seeded ICP + graph")["error"];
    EXPECT_NEAR(best["ate_rmse_m"].get<double>(), error.ate_rmse, 1e-5);
    EXPECT_LT(error.ate_rmse, 0.05);
}

void expect_told_what_became_of_the_images(const TempFolder& folder, const Json& json) {
    EXPECT_TRUE(variant(json, "plain ICP")["vision"].is_null());
    EXPECT_TRUE(variant(json, "VO only")["icp_failures"].is_null());
    const Json vision = variant(json, "VO-seeded ICP")["vision"];
    EXPECT_EQ(vision["method"], "joint");
    EXPECT_EQ(variant(json, "thesis pipeline")["vision"]["method"], "thesis");
    EXPECT_EQ(vision["images"], json["input"]["images"]);
    EXPECT_GE(vision["statuses"]["too_dark"], 10U);
    EXPECT_GT(variant(json, "VO-seeded ICP")["timings"]["vision_ms_per_image"], 0.0);
    EXPECT_THAT(bytes_of(folder / "there/compare.txt"),
                AllOf(HasSubstr("of them: too dark"), HasSubstr("ms per image"),
                      HasSubstr("sim1 against truth.tum, anchored at the first true pose")));
}

void expect_page_with_pictures(const TempFolder& folder) {
    const std::string html = bytes_of(folder / "there/compare.html");
    EXPECT_EQ(markup_fault(html), "");
    EXPECT_THAT(html, AllOf(HasSubstr("camera too dark for 1."), HasSubstr("VO only, thesis"),
                            Not(HasSubstr("http"))));
    std::size_t pictures = 0;
    for (std::size_t at = html.find("<img"); at != std::string::npos;
         at = html.find("<img", at + 1)) {
        ++pictures;
    }
    EXPECT_EQ(pictures, 3U);
    for (const char* file : {"compare.png", "compare_errors.png", "compare_maps.png"}) {
        EXPECT_GT(std::filesystem::file_size(folder / ("there/" + std::string(file))), 0U);
    }
}

void expect_same_as_direct(const TempFolder& folder) {
    const std::string config = "--config '" HYBRID_SLAM_SOURCE_DIR "/config/";
    const std::pair<const char*, std::string> runs[] = {
        {"plain_icp", config + "plain_icp.yaml'"},
        {"thesis_pipeline", config + "thesis.yaml'"},
        {"vo_only", "--config there/vo_only.yaml"}};
    for (const auto& [name, options] : runs) {
        run_well(folder, "map sim1 --out direct -q " + options);
        EXPECT_TRUE(same_bytes(folder / "direct/trajectory.tum",
                               folder / ("there/" + std::string(name) + ".tum")))
            << name;
    }
}

void expect_map_tells_about_the_camera(const TempFolder& folder, const Json& comparison) {
    const Outcome result = run_well(folder, "map sim1 --out hall");
    EXPECT_TRUE(
        same_bytes(folder / "hall/trajectory.tum", folder / "there/vo_seeded_icp_graph.tum"));
    EXPECT_THAT(result.err, HasSubstr("warning: camera too dark for 1."));
    EXPECT_THAT(result.out,
                AllOf(HasSubstr("vision     "), HasSubstr(" % good; prior visual in ")));
    const Json vision = Json::parse(bytes_of(folder / "hall/summary.json"))["vision"];
    EXPECT_EQ(vision["images"], comparison["input"]["images"]);
    double dark = 0.0;
    for (const Json& spell : vision["bad_spells"]) {
        dark += spell["status"] == "too_dark" ? spell["duration_s"].get<double>() : 0.0;
    }
    EXPECT_NEAR(dark, 1.2, 0.2);
}

// One test, so that the drive is made and compared once.
TEST(CompareWithImages, TellsAndKeepsAllThatItFinds) {
    const TempFolder folder;
    simulate_with_images(folder);
    const Json json = run_well(folder, "compare sim1 --out there --json").json();
    expect_all_variants(folder, json);
    expect_told_what_became_of_the_images(folder, json);
    expect_page_with_pictures(folder);
    expect_same_as_direct(folder);
    expect_map_tells_about_the_camera(folder, json);
}

}  // namespace
}  // namespace hybrid_slam::test
