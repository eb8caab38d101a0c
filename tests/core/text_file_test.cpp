// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/core/text_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <clocale>
#include <cmath>
#include <random>
#include <vector>

#include "support/error_of.hpp"
#include "support/shared_data.hpp"
#include "support/temp_folder.hpp"

namespace hybrid_slam {
namespace {

using test::bytes_of;
using test::error_of;
using test::TempFolder;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

std::vector<std::string> lines_of(TextFileReader& reader) {
    std::vector<std::string> lines;
    std::string line;
    while (reader.next(line)) {
        lines.push_back(line);
    }
    return lines;
}

std::filesystem::path write_gzip(const TempFolder& folder, const std::string& text) {
    const auto file = folder / "text.gz";
    TextFileWriter writer(file);
    writer.write(text);
    writer.close();
    return file;
}

/// Text that gzip cannot shrink much, so that its bytes spread over many blocks.
std::string random_lines(int count) {
    std::mt19937 random(8);
    std::string text;
    for (int i = 0; i < count; ++i) {
        text += std::to_string(i) + " " + std::to_string(random()) + "\n";
    }
    return text;
}

TEST(TextFileReader, SplitsLinesWithAnyLineEnd) {
    const TempFolder folder;
    TextFileReader reader(folder.write("a.txt", "one\ntwo\r\n\n\r\nfi\rve\nlast"));
    EXPECT_THAT(lines_of(reader), ElementsAre("one", "two", "", "", "fi\rve", "last"));
    EXPECT_EQ(reader.line_number(), 6U);
    EXPECT_TRUE(reader.unterminated());
    EXPECT_FALSE(reader.corrupt());
    EXPECT_EQ(reader.progress(), 1.0);
}

TEST(TextFileReader, TellsTheLineThatItRead) {
    const TempFolder folder;
    const auto file = folder.write("a.txt", "one\ntwo\n");
    TextFileReader reader(file);
    std::string line;
    ASSERT_TRUE(reader.next(line));
    ASSERT_TRUE(reader.next(line));
    EXPECT_EQ(reader.where(), file.string() + ":2");
    EXPECT_FALSE(reader.unterminated());
    EXPECT_FALSE(reader.next(line));
    EXPECT_FALSE(reader.next(line));
    EXPECT_EQ(reader.line_number(), 2U);
}

TEST(TextFileReader, AnEmptyFileHasNoLine) {
    const TempFolder folder;
    TextFileReader reader(folder.write("a.txt", ""));
    EXPECT_THAT(lines_of(reader), IsEmpty());
    EXPECT_FALSE(reader.corrupt());
}

TEST(TextFileReader, KeepsBytesThatAreNoText) {
    const TempFolder folder;
    const std::string odd("a\0b\xff", 4);
    TextFileReader reader(folder.write("a.txt", odd + "\n"));
    EXPECT_THAT(lines_of(reader), ElementsAre(odd));
}

TEST(TextFileReader, LinesMayBeLongerThanTheBuffer) {
    const TempFolder folder;
    const std::string longer(1000000, 'x');
    TextFileReader reader(folder.write("a.txt", longer + "\nend\n"));
    EXPECT_THAT(lines_of(reader), ElementsAre(longer, "end"));
}

TEST(TextFileReader, AGzipBombWithoutLineEndsIsCorrupt) {
    const TempFolder folder;
    const auto file = folder / "bomb.gz";
    TextFileWriter writer(file);
    const std::string zeros(1 << 20, '0');
    for (int i = 0; i < 65; ++i) {
        writer.write(zeros);
    }
    writer.close();
    TextFileReader reader(file);
    EXPECT_THAT(lines_of(reader), IsEmpty());
    EXPECT_TRUE(reader.corrupt());
}

TEST(TextFileReader, ReadsGzipByContentWhateverItsName) {
    const TempFolder folder;
    const std::string text = random_lines(50000);
    const auto file = folder / "renamed.txt";
    std::filesystem::rename(write_gzip(folder, text), file);
    ASSERT_LT(std::filesystem::file_size(file), text.size());
    TextFileReader reader(file);
    std::string joined;
    double progress = 0.0;
    for (std::string line; reader.next(line);) {
        joined += line + "\n";
        ASSERT_GE(reader.progress(), progress);
        progress = reader.progress();
    }
    EXPECT_EQ(joined, text);
    EXPECT_EQ(reader.progress(), 1.0);
}

TEST(TextFileReader, ProgressFollowsThePlainBytes) {
    const TempFolder folder;
    const std::string text = random_lines(100000);
    TextFileReader reader(folder.write("a.txt", text));
    EXPECT_EQ(reader.progress(), 0.0);
    double consumed = 0.0;
    for (std::string line; reader.next(line);) {
        consumed += static_cast<double>(line.size() + 1);
        ASSERT_NEAR(reader.progress(), consumed / static_cast<double>(text.size()), 1e-9);
    }
}

TEST(TextFileReader, ATruncatedGzipGivesItsLinesAndIsCorrupt) {
    const TempFolder folder;
    const std::string text = random_lines(50000);
    const std::string bytes = bytes_of(write_gzip(folder, text));
    TextFileReader reader(folder.write("cut.gz", bytes.substr(0, bytes.size() / 2)));
    const auto lines = lines_of(reader);
    EXPECT_TRUE(reader.corrupt());
    ASSERT_GT(lines.size(), 20000U);
    EXPECT_EQ(text.compare(0, lines[0].size(), lines[0]), 0);
    EXPECT_THAT(lines[20000], StartsWith("20000 "));
}

TEST(TextFileReader, EveryTruncationOfAGzipIsNoticed) {
    const TempFolder folder;
    const std::string bytes = bytes_of(write_gzip(folder, random_lines(20)));
    for (std::size_t length = 10; length < bytes.size(); ++length) {
        TextFileReader reader(folder.write("cut.gz", bytes.substr(0, length)));
        lines_of(reader);
        ASSERT_TRUE(reader.corrupt()) << length;
    }
}

TEST(TextFileReader, AFlippedBitInAGzipIsNoticed) {
    const TempFolder folder;
    std::string bytes = bytes_of(write_gzip(folder, random_lines(50000)));
    bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 0x10);
    TextFileReader reader(folder.write("bad.gz", bytes));
    EXPECT_LT(lines_of(reader).size(), 50000U);
    EXPECT_TRUE(reader.corrupt());
}

TEST(TextFileReader, RefusesWhatItCannotOpen) {
    const TempFolder folder;
    EXPECT_EQ(error_of([&] { TextFileReader reader(folder / "no.txt"); }),
              (folder / "no.txt").string() + ": No such file or directory");
    EXPECT_EQ(error_of([&] { TextFileReader reader(folder.path()); }),
              folder.path().string() + ": Is a directory");
}

TEST(TextFileReader, ReadsARealLogToItsEnd) {
    HYBRID_SLAM_SHARED_OR_SKIP(file, "data/slam2d/intel.clf.gz");
    TextFileReader reader(file);
    std::size_t scans = 0;
    for (std::string line; reader.next(line);) {
        scans += Tokens(line).next() == "FLASER" ? 1 : 0;
    }
    EXPECT_EQ(scans, 13631U);
    EXPECT_FALSE(reader.corrupt());
}

TEST(TextFileWriter, WritesPlainAndGzip) {
    const TempFolder folder;
    const std::string text = random_lines(1000);
    for (const char* name : {"a.txt", "a.txt.gz"}) {
        TextFileWriter writer(folder / name);
        writer.write(text.substr(0, 100));
        writer.write("");
        writer.write(text.substr(100));
        writer.close();
        writer.close();
    }
    EXPECT_EQ(bytes_of(folder / "a.txt"), text);
    EXPECT_THAT(bytes_of(folder / "a.txt.gz"), StartsWith("\x1f\x8b"));
    TextFileReader reader(folder / "a.txt.gz");
    EXPECT_EQ(lines_of(reader).size(), 1000U);
}

TEST(TextFileWriter, WithoutCloseNothingAppearsAndTheOldFileStays) {
    const TempFolder folder;
    folder.write("old.txt", "old");
    {
        TextFileWriter fresh(folder / "new.txt");
        fresh.write("half");
        TextFileWriter over(folder / "old.txt");
        over.write("half");
        TextFileWriter moved(std::move(over));
        EXPECT_EQ(bytes_of(folder / "old.txt"), "old");
    }
    EXPECT_FALSE(std::filesystem::exists(folder / "new.txt"));
    EXPECT_FALSE(std::filesystem::exists(folder / "new.txt.part"));
    EXPECT_FALSE(std::filesystem::exists(folder / "old.txt.part"));
    EXPECT_EQ(bytes_of(folder / "old.txt"), "old");
}

TEST(TextFileWriter, SameTextSameBytes) {
    const TempFolder folder;
    const std::string once = bytes_of(write_gzip(folder, random_lines(100)));
    EXPECT_EQ(bytes_of(write_gzip(folder, random_lines(100))), once);
}

TEST(TextFileWriter, RefusesWhatItCannotWrite) {
    const TempFolder folder;
    EXPECT_THAT(error_of([&] { TextFileWriter writer(folder / "no/a.txt"); }),
                HasSubstr("no/a.txt: No such file or directory"));
    EXPECT_THAT(error_of([&] { TextFileWriter writer(folder.path()); }),
                HasSubstr(": Is a directory"));
    TextFileWriter writer(folder / "a.txt");
    writer.close();
    EXPECT_THAT(error_of([&] { writer.write("late"); }), HasSubstr("after it was closed"));
}

TEST(TextFileWriter, AFullDiskIsAnError) {
    const TempFolder folder;
    if (!std::filesystem::exists("/dev/full")) {
        GTEST_SKIP() << "needs /dev/full";
    }
    std::filesystem::create_symlink("/dev/full", folder / "a.txt.part");
    TextFileWriter writer(folder / "a.txt");
    const std::string message = error_of([&] {
        writer.write("some text");
        writer.close();
    });
    EXPECT_THAT(message, HasSubstr("a.txt: No space left on device"));
    EXPECT_FALSE(std::filesystem::exists(folder / "a.txt"));
}

TEST(ReadWholeFile, GivesTheBytesUpToALimit) {
    const TempFolder folder;
    const std::string bytes("a\0\r\n\xff", 5);
    const auto file = folder.write("a.bin", bytes);
    EXPECT_EQ(read_whole_file(file, 5), bytes);
    EXPECT_THAT(error_of([&] { read_whole_file(file, 4); }), HasSubstr("larger than 4 bytes"));
    EXPECT_THAT(error_of([&] { read_whole_file(folder / "no", 4); }), HasSubstr("No such file"));
    EXPECT_THAT(error_of([&] { read_whole_file(folder.path(), 4); }), HasSubstr("Is a directory"));
}

TEST(Tokens, SplitAtBlanksAndTabs) {
    Tokens tokens("  one\ttwo   3 ");
    EXPECT_EQ(tokens.next(), "one");
    EXPECT_EQ(tokens.next(), "two");
    EXPECT_EQ(tokens.next(), "3");
    EXPECT_EQ(tokens.next(), "");
    EXPECT_EQ(tokens.next(), "");
    EXPECT_EQ(Tokens("").next(), "");
    EXPECT_EQ(Tokens(" \t ").next(), "");
}

TEST(ParseDouble, TakesEveryUsualSpelling) {
    const std::vector<std::pair<const char*, double>> cases{
        {"1", 1.0},          {"-0.5", -0.5},         {"+2.5", 2.5},   {".5", 0.5},
        {"5.", 5.0},         {"1e3", 1000.0},        {"1E-3", 0.001}, {"inf", HUGE_VAL},
        {"-INF", -HUGE_VAL}, {"Infinity", HUGE_VAL}, {"0.1", 0.1},    {"4.9e-324", 4.9e-324}};
    for (const auto& [text, expected] : cases) {
        double value = 7.0;
        EXPECT_TRUE(parse_double(text, value)) << text;
        EXPECT_EQ(value, expected) << text;
    }
    double value = 0.0;
    for (const char* text : {"nan", "NaN", "NAN", "-nan"}) {
        EXPECT_TRUE(parse_double(text, value) && std::isnan(value)) << text;
    }
}

TEST(ParseDouble, RefusesWhatIsNotWhollyANumber) {
    for (const char* text : {"", "+", "-", "+-1", "++1", "1x", " 1", "1 ", "0x10", "1,5", "1e", "e",
                             "1.2.3", "1e999", "--1"}) {
        double value = 7.0;
        EXPECT_FALSE(parse_double(text, value)) << text;
        EXPECT_EQ(value, 7.0) << text;
    }
}

TEST(ParseDouble, DoesNotCareForTheLocale) {
    const std::string before = std::setlocale(LC_NUMERIC, nullptr);
    // Where no such locale is installed, the call changes nothing and the test is the plain one.
    std::setlocale(LC_NUMERIC, "de_DE.UTF-8");
    double value = 0.0;
    EXPECT_TRUE(parse_double("1.5", value));
    EXPECT_FALSE(parse_double("1,5", value));
    std::setlocale(LC_NUMERIC, before.c_str());
    EXPECT_EQ(value, 1.5);
}

TEST(ParseLong, TakesWholeNumbersOnly) {
    long value = 7;
    EXPECT_TRUE(parse_long("-12", value));
    EXPECT_EQ(value, -12);
    EXPECT_TRUE(parse_long("+12", value));
    EXPECT_EQ(value, 12);
    for (const char* text : {"", "1.0", "1e3", "99999999999999999999", "+-1", "0x1", "1 "}) {
        EXPECT_FALSE(parse_long(text, value)) << text;
    }
    EXPECT_EQ(value, 12);
}

}  // namespace
}  // namespace hybrid_slam
