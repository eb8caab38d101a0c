// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/core/config.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "hybrid_slam/core/pose2.hpp"
#include "support/error_of.hpp"
#include "support/temp_folder.hpp"

namespace hybrid_slam {
namespace {

using test::error_of;
using test::TempFolder;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

enum class Prior { kNone, kWheel, kVisual };

struct Settings {
    Prior prior = Prior::kVisual;
    int max_iterations = 30;
    double max_distance = 0.3;
    double kernel = 0.1;
    bool enabled = true;
    double limit = 1e9;
};

void describe(ConfigSchema& schema, Settings& settings) {
    schema.add("prior", settings.prior,
               {{"none", Prior::kNone}, {"wheel", Prior::kWheel}, {"visual", Prior::kVisual}},
               "where the guess comes from");
    {
        const ConfigSchema::Section icp(schema, "icp");
        schema.add("max_iterations", settings.max_iterations, 1, 1000, "iterations at most");
        {
            const ConfigSchema::Section pairs(schema, "pairs");
            schema.add("max_distance", settings.max_distance, 0.0, 10.0, "metres");
        }
        schema.add("kernel", settings.kernel, -1.0, 1.0, "metres");
    }
    schema.add("graph.enabled", settings.enabled, "refine the graph");
    schema.add("icp.limit", settings.limit, -kInfinity, kInfinity, "any");
}

struct Config : ::testing::Test {
    Config() { describe(schema, settings); }

    void load(std::string_view yaml) { schema.load(folder.write("c.yaml", yaml)); }
    std::string load_error(std::string_view yaml) {
        return error_of([&] { load(yaml); });
    }
    std::string at_line(int line, const std::string& rest) const {
        return (folder / "c.yaml").string() + ":" + std::to_string(line) + ": " + rest;
    }

    TempFolder folder;
    Settings settings;
    ConfigSchema schema;
};

TEST_F(Config, ReadsNestedMaps) {
    load(
        "prior: wheel\nicp:\n  max_iterations: 7\n  pairs:\n    max_distance: 1.5\n"
        "graph: {enabled: false}\n");
    EXPECT_EQ(settings.prior, Prior::kWheel);
    EXPECT_EQ(settings.max_iterations, 7);
    EXPECT_EQ(settings.max_distance, 1.5);
    EXPECT_FALSE(settings.enabled);
    EXPECT_EQ(settings.kernel, 0.1);
}

TEST_F(Config, ReadsDottedKeysAtAnyDepth) {
    load("icp.max_iterations: 8\nicp.pairs: {max_distance: 2}\nicp:\n  kernel: '0.5'\n");
    EXPECT_EQ(settings.max_iterations, 8);
    EXPECT_EQ(settings.max_distance, 2.0);
    EXPECT_EQ(settings.kernel, 0.5);
}

TEST_F(Config, EmptyFilesAndSectionsChangeNothing) {
    load("");
    load("# nothing but a comment\n");
    load("---\n");
    load("icp:\n  # kernel: 0.5\n");
    EXPECT_EQ(settings.kernel, 0.1);
}

TEST_F(Config, AnUnknownKeyIsNamedWithItsLineAndTheNearestOne) {
    EXPECT_EQ(load_error("prior: none\nicp:\n  max_iteration: 5\n"),
              at_line(3,
                      "key 'icp.max_iteration': unknown key; did you mean "
                      "'icp.max_iterations'?"));
    EXPECT_EQ(load_error("max_distance: 5\n"),
              at_line(1,
                      "key 'max_distance': unknown key; did you mean "
                      "'icp.pairs.max_distance'?"));
    EXPECT_THAT(load_error("ipc:\n  kernel: 5\n"), HasSubstr("did you mean 'icp'?"));
    EXPECT_EQ(load_error("zzzzzzzzzzzzzz: 5\n"), at_line(1, "key 'zzzzzzzzzzzzzz': unknown key"));
}

TEST_F(Config, AValueOutOfRangeTellsTheRange) {
    EXPECT_EQ(load_error("icp.max_iterations: 1001"),
              at_line(1,
                      "key 'icp.max_iterations': must be a whole number from 1 to 1000, not "
                      "'1001'"));
    EXPECT_EQ(load_error("\nicp.kernel: -1.01"),
              at_line(2, "key 'icp.kernel': must be a number from -1 to 1, not '-1.01'"));
    EXPECT_EQ(settings.kernel, 0.1);
    EXPECT_EQ(settings.max_iterations, 30);
}

TEST_F(Config, AValueOfTheWrongTypeTellsWhatIsTaken) {
    for (const char* text : {"2.0", "many", "1e1", "99999999999999999999", "0x10"}) {
        EXPECT_THAT(load_error("icp.max_iterations: " + std::string(text)),
                    HasSubstr("must be a whole number"));
    }
    for (const char* text : {"nan", ".nan", ".inf", "1,5", "much", "''"}) {
        EXPECT_THAT(load_error("icp.kernel: " + std::string(text)), HasSubstr("must be a number"));
    }
    EXPECT_THAT(load_error("graph.enabled: 1"), HasSubstr("must be true or false, not '1'"));
    EXPECT_THAT(load_error("prior: wheels"),
                HasSubstr("must be one of none, wheel, visual, not 'wheels'"));
    EXPECT_THAT(load_error("icp.kernel:"), HasSubstr("needs a single value"));
    EXPECT_THAT(load_error("icp.kernel: [1]"), HasSubstr("needs a single value"));
    EXPECT_THAT(load_error("icp.kernel: {a: 1}"), HasSubstr("needs a single value"));
    EXPECT_THAT(load_error("icp: 3"), HasSubstr("key 'icp': is a section"));
}

TEST_F(Config, RepeatedKeysAreRefused) {
    EXPECT_EQ(load_error("icp:\n  kernel: 0.1\n  kernel: 0.2\n"),
              at_line(3, "key 'icp.kernel': repeated, it is in line 2 already"));
    EXPECT_EQ(load_error("icp.kernel: 0.1\nicp:\n  kernel: 0.2\n"),
              at_line(3, "key 'icp.kernel': repeated, it is in line 1 already"));
    EXPECT_THAT(load_error("icp: {kernel: 0.1}\nicp: {limit: 1}\n"), HasSubstr("repeated"));
}

TEST_F(Config, BrokenYamlIsRefusedWithItsLine) {
    EXPECT_THAT(load_error("prior: none\nicp: [1, 2\n"), HasSubstr("c.yaml:"));
    EXPECT_EQ(load_error("prior: none\n\ticp: 1\n").rfind(at_line(2, ""), 0), 0U);
    EXPECT_THAT(load_error("- a\n- b\n"), HasSubstr("must hold lines like 'key: value'"));
    EXPECT_THAT(load_error("just words\n"), HasSubstr("must hold lines like 'key: value'"));
    EXPECT_THAT(load_error("prior: none\n---\nprior: wheel\n"), HasSubstr("more than one YAML"));
    EXPECT_THAT(load_error("? [a]\n: 1\n"), HasSubstr("a key must be a plain word"));
}

TEST_F(Config, AliasesToThemselvesAndBombsOfThemEnd) {
    EXPECT_THAT(load_error("icp: &x\n  pairs: *x\n"), HasSubstr("unknown key"));
    EXPECT_THAT(load_error("a: &x {b: *x}\n"), HasSubstr("key 'a': unknown key"));
    std::string bomb = "a0: &a0 [x, x]\n";
    for (int i = 1; i < 40; ++i) {
        const std::string before = "*a" + std::to_string(i - 1);
        bomb += "a" + std::to_string(i) + ": &a" + std::to_string(i) + " [" + before + ", " +
                before + "]\n";
    }
    EXPECT_THAT(load_error(bomb), HasSubstr("unknown key"));
    EXPECT_THAT(load_error(std::string(100000, '[')), HasSubstr("c.yaml:"));
}

TEST_F(Config, AFileThatCannotBeReadIsNamed) {
    EXPECT_EQ(error_of([&] { schema.load(folder / "no.yaml"); }),
              (folder / "no.yaml").string() + ": No such file or directory");
    EXPECT_THAT(error_of([&] { schema.load(folder.path()); }), EndsWith(": Is a directory"));
}

TEST_F(Config, OverridesApplyOneAssignment) {
    schema.override_with("icp.max_iterations=20");
    schema.override_with("prior=none");
    schema.override_with("icp.limit=.inf");
    EXPECT_EQ(settings.max_iterations, 20);
    EXPECT_EQ(settings.prior, Prior::kNone);
    EXPECT_EQ(settings.limit, kInfinity);
}

TEST_F(Config, OverridesThatFailNameTheKey) {
    const auto override_error = [this](const char* text) {
        return error_of([&] { schema.override_with(text); });
    };
    EXPECT_EQ(override_error("icp.kernl=1"),
              "key 'icp.kernl': unknown key; did you mean 'icp.kernel'?");
    EXPECT_EQ(override_error("icp.kernel=2"),
              "key 'icp.kernel': must be a number from -1 to 1, not '2'");
    EXPECT_EQ(override_error("icp.kernel="),
              "key 'icp.kernel': must be a number from -1 to 1, not ''");
    EXPECT_EQ(override_error("icp.kernel"), "'icp.kernel': must look like key=value");
    EXPECT_EQ(override_error("=3"), "'=3': must look like key=value");
    EXPECT_THAT(override_error("icp.kernel=0=1"), HasSubstr("not '0=1'"));
}

TEST_F(Config, WritesNestedYamlWithTheHelp) {
    EXPECT_EQ(schema.to_yaml(),
              "prior: visual  # where the guess comes from\n"
              "icp:\n"
              "  max_iterations: 30  # iterations at most\n"
              "  pairs:\n"
              "    max_distance: 0.3  # metres\n"
              "  kernel: 0.1  # metres\n"
              "  limit: 1000000000  # any\n"
              "graph:\n"
              "  enabled: true  # refine the graph\n");
}

TEST_F(Config, WhatIsWrittenReadsBackToTheBit) {
    std::mt19937_64 random(9);
    for (int i = 0; i < 300; ++i) {
        settings.limit = std::ldexp(static_cast<double>(random()) * (i % 2 == 0 ? 1.0 : -1.0),
                                    static_cast<int>(random() % 1900) - 1100);
        settings.kernel = static_cast<double>(random()) / 18446744073709551616.0;
        settings.max_distance = i == 0 ? -0.0 : 10.0 * settings.kernel;
        settings.max_iterations = 1 + static_cast<int>(random() % 1000);
        settings.enabled = random() % 2 == 0;
        settings.prior = static_cast<Prior>(random() % 3);
        if (i < 2) {
            settings.limit = i == 0 ? kInfinity : -kInfinity;
        }
        Settings back;
        ConfigSchema back_schema;
        describe(back_schema, back);
        back_schema.load(folder.write("c.yaml", schema.to_yaml()));
        ASSERT_EQ(back.limit, settings.limit);
        ASSERT_EQ(back.kernel, settings.kernel);
        ASSERT_EQ(back.max_distance, settings.max_distance);
        ASSERT_EQ(std::signbit(back.max_distance), std::signbit(settings.max_distance));
        ASSERT_EQ(back.max_iterations, settings.max_iterations);
        ASSERT_EQ(back.enabled, settings.enabled);
        ASSERT_EQ(back.prior, settings.prior);
    }
}

TEST_F(Config, EveryFieldTakesBackWhatItGives) {
    for (const ConfigField& field : schema.fields()) {
        const std::string text = field.get();
        field.set(text);
        EXPECT_EQ(field.get(), text) << field.key;
        EXPECT_FALSE(field.help.empty()) << field.key;
    }
    EXPECT_EQ(schema.fields().size(), 6U);
    EXPECT_EQ(schema.fields()[2].key, "icp.pairs.max_distance");
}

TEST_F(Config, AStructFilledByCodeIsHeldToTheRanges) {
    Settings bad;
    bad.max_distance = std::nan("");
    ConfigSchema other;
    EXPECT_THAT(error_of([&] { describe(other, bad); }),
                HasSubstr("key 'icp.pairs.max_distance': must be a number from 0 to 10"));
    bad = {};
    bad.prior = static_cast<Prior>(17);
    ConfigSchema another;
    EXPECT_THAT(error_of([&] { describe(another, bad); }), HasSubstr("must be one of none"));
}

TEST_F(Config, AKeyIsDeclaredOnce) {
    int value = 1;
    for (const char* key : {"icp.kernel", "icp", "icp.kernel.inner"}) {
        EXPECT_THAT(error_of([&] { schema.add(key, value, 0, 9, "again"); }),
                    HasSubstr("declared twice"))
            << key;
    }
    schema.add("icp.kerne", value, 0, 9, "a key that another one starts with");
    schema.override_with("icp.kerne=5");
    EXPECT_EQ(value, 5);
    EXPECT_THAT(schema.to_yaml(), Not(HasSubstr("icp.")));
}

struct Texts : ::testing::Test {
    Texts() {
        schema.add("name", name, "of the vehicle");
        schema.add("sectors", sectors, -180.0, 180.0, "deg");
        schema.add_degrees("yaw_deg", yaw, -180.0, 180.0, "deg");
    }
    std::string load_error(std::string_view yaml) {
        return error_of([&] { schema.load(folder.write("c.yaml", yaml)); });
    }

    TempFolder folder;
    std::string name = "truck";
    std::vector<double> sectors{1.0, 2.5};
    double yaw = 0.0;
    ConfigSchema schema;
};

TEST_F(Texts, AreReadFromYaml) {
    schema.load(folder.write("c.yaml", "name: no 7\nsectors: [-10, 20.5, 30]\nyaw_deg: 90\n"));
    EXPECT_EQ(name, "no 7");
    EXPECT_EQ(sectors, (std::vector<double>{-10.0, 20.5, 30.0}));
    EXPECT_DOUBLE_EQ(yaw, kPi / 2.0);
    schema.load(folder.write("c.yaml", "sectors: []\n"));
    EXPECT_TRUE(sectors.empty());
}

TEST_F(Texts, OverridesSpellListsWithOrWithoutBrackets) {
    schema.override_with("sectors=[3, 4]");
    EXPECT_EQ(sectors, (std::vector<double>{3.0, 4.0}));
    schema.override_with("sectors=5,6");
    EXPECT_EQ(sectors, (std::vector<double>{5.0, 6.0}));
    schema.override_with("name=tcp://host:10=a");
    EXPECT_EQ(name, "tcp://host:10=a");
}

TEST_F(Texts, ComeBackFromYamlWhateverTheyHold) {
    for (const char* text : {"", "it's: #1 \"x\"", " spaced ", "[a, b]", "~", "true"}) {
        name = text;
        sectors = {0.1, -179.99};
        yaw = -1.2345678901234567;
        const std::string yaml = schema.to_yaml();
        name = "other";
        sectors.clear();
        yaw = 0.0;
        schema.load(folder.write("c.yaml", yaml));
        EXPECT_EQ(name, text);
        EXPECT_EQ(sectors, (std::vector<double>{0.1, -179.99}));
        EXPECT_DOUBLE_EQ(yaw, -1.2345678901234567);
    }
}

TEST_F(Texts, WholeDegreesAreWrittenAsSuch) {
    for (int degree = -180; degree <= 180; ++degree) {
        yaw = radians(degree);
        EXPECT_THAT(schema.to_yaml(), HasSubstr("yaw_deg: " + std::to_string(degree) + "  #"));
    }
}

TEST_F(Texts, WrongOnesAreRefused) {
    EXPECT_THAT(load_error("sectors: 5\n"), HasSubstr("needs a list like [1, 2]"));
    EXPECT_THAT(load_error("sectors: [1, two]\n"), HasSubstr("not 'two'"));
    EXPECT_THAT(load_error("sectors: [1, [2]]\n"), HasSubstr("not '?'"));
    EXPECT_THAT(load_error("sectors: [[1, 2]]\n"), HasSubstr("not '?'"));
    EXPECT_THAT(load_error("sectors: [[1, 2], [3]]\n"), HasSubstr("not '?'"));
    EXPECT_THAT(error_of([&] { schema.override_with("sectors=1,"); }), HasSubstr("not ''"));
    EXPECT_THAT(load_error("sectors: [1, 200]\n"), HasSubstr("from -180 to 180"));
    EXPECT_THAT(load_error("name: [a]\n"), HasSubstr("needs a single value"));
    EXPECT_THAT(load_error("name: \"a\\nb\"\n"), HasSubstr("one line"));
    EXPECT_THAT(load_error("yaw_deg: 181\n"), HasSubstr("from -180 to 180, not '181'"));
}

}  // namespace
}  // namespace hybrid_slam
