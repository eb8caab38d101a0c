// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <algorithm>

#include "running.hpp"

namespace hybrid_slam::test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::MatchesRegex;
using ::testing::StartsWith;

constexpr const char* kCommands[] = {"map",      "compare",  "crop",       "evaluate", "export",
                                     "localize", "optimize", "relocalize", "simulate"};

/// "hybrid-slam: ..." in a single line.
void expect_one_error_line(const Outcome& result, const std::string& part) {
    EXPECT_THAT(result.err, AllOf(StartsWith("hybrid-slam: "), HasSubstr(part)));
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_THAT(result.out, IsEmpty());
}

TEST(Usage, HelpNamesAllCommandsExamplesAndExitCodes) {
    const TempFolder folder;
    const Outcome result = run_well(folder, "--help");
    for (const char* command : kCommands) {
        EXPECT_THAT(result.out, HasSubstr(std::string("\n  ") + command));
    }
    EXPECT_THAT(result.out, AllOf(HasSubstr("Examples:"), HasSubstr("Exit codes: 0 done, 1 ")));
    EXPECT_THAT(result.err, IsEmpty());
}

TEST(Usage, EachCommandHelpsWithExamples) {
    const TempFolder folder;
    for (const std::string command : kCommands) {
        const Outcome result = run_well(folder, command + " --help");
        EXPECT_THAT(result.out, AllOf(HasSubstr("Examples:\n  hybrid-slam " + command),
                                      HasSubstr("--json"), HasSubstr("--quiet")));
    }
}

TEST(Usage, PrintsItsVersion) {
    const TempFolder folder;
    EXPECT_THAT(run_well(folder, "--version").out,
                MatchesRegex("hybrid-slam [0-9]+\\.[0-9]+\\.[0-9]+\n"));
}

TEST(Usage, WrongUsageIsTwoAndOneLine) {
    const TempFolder folder;
    for (const std::string arguments :
         {"", "fly", "map", "map log.clf", "map log.clf --out o --speed 3", "evaluate t.tum",
          "evaluate t.tum --truth a --relations b", "compare log.clf --truth a --relations b",
          "optimize a.g2o --out b.g2o --kernel tukey", "simulate w.yaml --out l.clf --seed x"}) {
        SCOPED_TRACE(arguments);
        const Outcome result = run(folder, arguments);
        EXPECT_EQ(result.code, 2);
        expect_one_error_line(result, "--help");
    }
}

TEST(Usage, MissingFilesAreOneAndNamed) {
    const TempFolder folder;
    folder.write("t.tum", "0 0 0 0 0 0 0 1\n");
    for (const std::string arguments :
         {"map nowhere.x --out o", "compare nowhere.x --truth t.tum",
          "evaluate nowhere.x --truth t.tum", "evaluate t.tum --relations nowhere.x",
          "optimize nowhere.x --out o.g2o", "simulate nowhere.x --out o.clf",
          "map log.clf --out o --config nowhere.x"}) {
        SCOPED_TRACE(arguments);
        const Outcome result = run(folder, arguments);
        EXPECT_EQ(result.code, 1);
        expect_one_error_line(result, "nowhere.x");
    }
}

TEST(Usage, WrongKeysNameKeyAndLine) {
    const TempFolder folder;
    simulate_room(folder);
    folder.write("wrong.yaml", "icp:\n  max_iterations: many\n");
    Outcome result = run(folder, "map room.clf --out o --config wrong.yaml");
    EXPECT_EQ(result.code, 1);
    expect_one_error_line(result, "wrong.yaml:2: key 'icp.max_iterations'");
    result = run(folder, "map room.clf --out o --set icp.iterations=5");
    EXPECT_EQ(result.code, 1);
    expect_one_error_line(result, "did you mean 'icp.max_iterations'");
    result = run(folder, "simulate room.yaml --out o.clf --set wings=2");
    EXPECT_EQ(result.code, 1);
    expect_one_error_line(result, "key 'wings'");
    EXPECT_FALSE(std::filesystem::exists(folder / "o"));
    EXPECT_FALSE(std::filesystem::exists(folder / "o.clf"));
}

TEST(Usage, FullDiskOfResultsIsAnError) {
    if (!std::filesystem::exists("/dev/full")) {
        GTEST_SKIP() << "no /dev/full here";
    }
    const TempFolder folder;
    folder.write("t.tum", "0 0 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n");
    const std::string command = "cd '" + folder.path().string() +
                                "' && '" HYBRID_SLAM_PROGRAM
                                "' evaluate t.tum --truth t.tum > /dev/full 2> stderr.txt";
    const int status = std::system(command.c_str());
    EXPECT_EQ(WEXITSTATUS(status), 1);
    EXPECT_EQ(bytes_of(folder / "stderr.txt"), "hybrid-slam: standard output: cannot be written\n");
}

}  // namespace
}  // namespace hybrid_slam::test
