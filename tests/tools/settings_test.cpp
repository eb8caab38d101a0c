// SPDX-License-Identifier: Apache-2.0
#include "settings.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "drive_settings.hpp"
#include "support/error_of.hpp"
#include "support/temp_folder.hpp"

namespace hybrid_slam::test {
namespace {

using tools::load_settings;
using tools::Settings;
using tools::with_overrides;

const std::filesystem::path kConfigs = std::filesystem::path(HYBRID_SLAM_SOURCE_DIR) / "config";

/// Without the comment lines before the first key.
std::string without_heading(const std::string& text) {
    std::istringstream lines(text);
    std::string line;
    std::size_t begin = 0;
    while (std::getline(lines, line) && (line.empty() || line[0] == '#')) {
        begin += line.size() + 1;
    }
    return text.substr(begin);
}

std::string effect_of(const std::string& file) {
    return to_yaml(load_settings(kConfigs / file, {}));
}

TEST(Settings, DefaultFileIsWhatHoldsWithoutAFile) {
    const TempFolder folder;
    const std::string expected = to_yaml(Settings{});
    EXPECT_EQ(without_heading(bytes_of(kConfigs / "default.yaml")), expected)
        << "to renew it, keep its heading and take the config.yaml of a map made without --config";
}

TEST(Settings, DriveFileIsWhatHoldsWithoutAFile) {
#ifndef HYBRID_SLAM_HAS_FLEET
    GTEST_SKIP() << "without MQTT there are fewer keys";
#endif
    EXPECT_EQ(without_heading(bytes_of(kConfigs / "drive.yaml")), to_yaml(tools::DriveSettings{}));
    EXPECT_EQ(to_yaml(tools::load_drive_settings(kConfigs / "drive.yaml", {})),
              to_yaml(tools::DriveSettings{}));
}

TEST(Settings, MistakesInADriveFileNameTheLineAndTheKey) {
    const TempFolder folder;
    const auto mistake = [&](const std::string& text) {
        return error_of([&] { tools::load_drive_settings(folder.write("d.yaml", text), {}); });
    };
    EXPECT_THAT(mistake("follower:\n  speed: 1\n"), ::testing::HasSubstr("d.yaml:2"));
    EXPECT_THAT(mistake("pilot: {pose_valid: 60}\n"), ::testing::HasSubstr("pilot.pose_valid"));
    EXPECT_THAT(error_of([] { tools::load_drive_settings({}, {"planner.cell=0"}); }),
                ::testing::HasSubstr("planner.cell"));
}

const tools::Variant& named(const std::vector<tools::Variant>& variants, const std::string& name) {
    const auto found =
        std::find_if(variants.begin(), variants.end(),
                     [&](const tools::Variant& variant) { return variant.name == name; });
    EXPECT_NE(found, variants.end()) << name;
    return *found;
}

std::string effect_of(const tools::Variant& variant) {
    return to_yaml(with_overrides(Settings{}, variant.overrides));
}

TEST(Settings, PlainIcpFileHasTheEffectOfTheComparisonsFirstVariant) {
    for (const bool images : {false, true}) {
        const auto variants = tools::comparison_variants(images);
        EXPECT_EQ(effect_of("plain_icp.yaml"), effect_of(variants.front()));
        EXPECT_EQ(variants.front().name, "plain ICP");
    }
}

TEST(Settings, ThesisFileHasTheEffectOfTheComparisonsVariant) {
    const auto variants = tools::comparison_variants(true);
    EXPECT_EQ(effect_of("thesis.yaml"), effect_of(named(variants, "thesis pipeline")));
}

TEST(Settings, ThesisIsPlainIcpWithItsPriorAndAGraph) {
    EXPECT_EQ(to_yaml(load_settings(kConfigs / "thesis.yaml", {})),
              to_yaml(load_settings(kConfigs / "plain_icp.yaml",
                                    {"odometry.prior=visual", "odometry.doubtful_chi2=1e9",
                                     "vo.method=thesis", "graph.enabled=true"})));
}

TEST(Settings, LastVariantWithImagesIsTheDefault) {
    const auto variants = tools::comparison_variants(true);
    ASSERT_EQ(variants.size(), 6U);
    EXPECT_EQ(effect_of(variants.back()), to_yaml(Settings{}));
    EXPECT_EQ(effect_of(variants.back()), effect_of(tools::comparison_variants(false).back()));
}

TEST(Settings, VisualOdometryAloneAsksNeitherIcpNorGraph) {
    const auto variants = tools::comparison_variants(true);
    const Settings thesis = with_overrides({}, named(variants, "VO only, thesis").overrides);
    const Settings ours = with_overrides({}, named(variants, "VO only").overrides);
    for (const Settings& settings : {thesis, ours}) {
        EXPECT_TRUE(tools::uses_images(settings));
        EXPECT_EQ(settings.slam.odometry.reference, ReferenceKind::kNone);
        EXPECT_FALSE(settings.slam.graph.enabled);
    }
    EXPECT_EQ(thesis.vision.odometry.method, VisualMethod::kThesis);
    EXPECT_EQ(ours.vision.odometry.method, VisualMethod::kJoint);
}

TEST(Settings, SeededVariantsKeepTheUsersValues) {
    const auto variants = tools::comparison_variants(false);
    ASSERT_EQ(variants.size(), 3U);
    const Settings mine =
        load_settings({}, {"odometry.prior=constant_velocity", "log.range_max=20"});
    const Settings seeded = with_overrides(mine, variants[1].overrides);
    EXPECT_EQ(seeded.slam.odometry.prior.kind, PriorKind::kConstantVelocity);
    EXPECT_FALSE(seeded.slam.graph.enabled);
    EXPECT_DOUBLE_EQ(seeded.log.range_max, 20.0);
    const Settings full = with_overrides(mine, variants[2].overrides);
    EXPECT_TRUE(full.slam.graph.enabled);
    EXPECT_DOUBLE_EQ(with_overrides(mine, variants[0].overrides).log.range_max, 20.0);
}

/// What the program's settings describe on their own must stay what the library describes.
TEST(Settings, LocalizationHasTheKeysOfTheLibrary) {
    Settings settings;
    ConfigSchema ours;
    describe(ours, settings);
    LocalizationConfig config;
    ConfigSchema theirs;
    describe(theirs, config);
    for (const ConfigField& field : theirs.fields()) {
        const auto same =
            std::find_if(ours.fields().begin(), ours.fields().end(),
                         [&](const ConfigField& own) { return own.key == field.key; });
        ASSERT_NE(same, ours.fields().end()) << field.key;
        EXPECT_EQ(same->help, field.help) << field.key;
        EXPECT_EQ(same->get(), field.get()) << field.key;
    }
}

TEST(Settings, LocalizationTakesTheOdometryOfTheSession) {
    const Settings settings = load_settings(
        {}, {"icp.max_iterations=9", "tracking.window=7", "localization.query_path=4"});
    const LocalizationConfig config = tools::localization_of(settings);
    EXPECT_EQ(config.odometry.icp.max_iterations, 9);
    EXPECT_EQ(config.tracking.window, 7);
    EXPECT_DOUBLE_EQ(config.query_path, 4.0);
}

TEST(Settings, OtherDefaultsHoldForWhatNothingSays) {
    Settings defaults;
    defaults.localization.relocalization.max_seconds = 0.5;
    const auto seconds = [&](const tools::Overrides& overrides) {
        return load_settings({}, overrides, defaults).localization.relocalization.max_seconds;
    };
    EXPECT_DOUBLE_EQ(seconds({}), 0.5);
    EXPECT_DOUBLE_EQ(seconds({"relocalization.max_seconds=0"}), 0.0);
}

TEST(Settings, OverridesBeatTheFile) {
    const TempFolder folder;
    const auto file =
        folder.write("mine.yaml", "icp: {max_iterations: 9}\nmap: {resolution: 0.1}\n");
    const Settings settings = load_settings(file, {"icp.max_iterations=11"});
    EXPECT_EQ(settings.slam.odometry.icp.max_iterations, 11);
    EXPECT_DOUBLE_EQ(settings.map.resolution, 0.1);
}

TEST(Settings, ValuesOutOfRangeAreRefused) {
    EXPECT_THAT(error_of([] { load_settings({}, {"map.resolution=0"}); }),
                ::testing::HasSubstr("map.resolution"));
    EXPECT_THAT(error_of([] { load_settings({}, {"log.range_max=nan"}); }),
                ::testing::HasSubstr("log.range_max"));
}

}  // namespace
}  // namespace hybrid_slam::test
