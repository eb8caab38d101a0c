// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "measure.hpp"
#include "messages.hpp"
#include "session.hpp"
#include "table.hpp"

namespace hybrid_slam::test {
namespace {

using namespace tools;

TEST(Text, NumbersHaveCommasByThrees) {
    EXPECT_EQ(with_commas(0), "0");
    EXPECT_EQ(with_commas(999), "999");
    EXPECT_EQ(with_commas(1000), "1,000");
    EXPECT_EQ(with_commas(123456), "123,456");
    EXPECT_EQ(with_commas(1234567), "1,234,567");
    EXPECT_EQ(counted(1, "scan"), "1 scan");
    EXPECT_EQ(counted(2000, "scan"), "2,000 scans");
}

TEST(Text, StemLeavesOutFolderGzAndExtension) {
    EXPECT_EQ(stem_of("/a/intel.clf.gz"), "intel");
    EXPECT_EQ(stem_of("hall.clf"), "hall");
    EXPECT_EQ(stem_of("hall"), "hall");
    EXPECT_EQ(stem_of("mit-csail.v2.log"), "mit-csail.v2");
}

TEST(Text, TableAlignsNamesLeftAndNumbersRight) {
    Table table({"", "one", "two"});
    table.add_row({"speed", "1", "1000"});
    table.add_row({"colour", "22"});
    EXPECT_EQ(table.text(),
              "        one   two\n"
              "-----------------\n"
              "speed     1  1000\n"
              "colour   22");
}

TEST(Text, StageTimesAddUp) {
    StageTime stage;
    EXPECT_EQ(stage.mean(), 0.0);
    stage.add(1.0);
    stage.add(3.0);
    EXPECT_DOUBLE_EQ(stage.total, 4.0);
    EXPECT_DOUBLE_EQ(stage.mean(), 2.0);
    EXPECT_DOUBLE_EQ(stage.longest, 3.0);
}

TEST(Text, PeakMemoryFollowsWhatIsUsed) {
    reset_peak_memory();
    const double before = peak_memory_mb();
    EXPECT_GT(before, 1.0);
    const std::vector<char> big(std::size_t{64} << 20U, 1);
    EXPECT_GT(peak_memory_mb(), before + 50.0) << big.size();
}

TEST(Text, WarningsNameOnlyWhatHappened) {
    CarmenLogCounts counts;
    counts.scans = 100;
    EXPECT_TRUE(warnings_of(counts).empty());
    counts.backward_stamps = 631;
    counts.torn_last_line = 1;
    EXPECT_EQ(warnings_of(counts).size(), 2U);
    EXPECT_EQ(warnings_of(counts)[1], "scans stamped earlier than the one before: 631");
}

}  // namespace
}  // namespace hybrid_slam::test
