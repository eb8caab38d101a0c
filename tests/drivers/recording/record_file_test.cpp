// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <numeric>
#include <random>

#include "hybrid_slam/recording/record_file.hpp"
#include "recording_support.hpp"
#include "support/error_of.hpp"
#include "support/temp_folder.hpp"

namespace hybrid_slam::test {
namespace {

using ::testing::HasSubstr;
using Numbers = std::vector<std::size_t>;

constexpr std::size_t kFileHeader = 16;
constexpr std::size_t kRecordHeader = 24;
const std::vector<std::size_t> kSizes{700, 0, 1, 333, 5000, 64};
const Numbers kAll{0, 1, 2, 3, 4, 5};

/// Record i comes at second i and holds noise_bytes(i).
void write_file(const std::filesystem::path& file, const std::vector<std::size_t>& sizes = kSizes) {
    RecordFileWriter writer(file);
    for (std::size_t i = 0; i < sizes.size(); ++i) {
        const Bytes bytes = noise_bytes(i, sizes[i]);
        writer.append(static_cast<double>(i), bytes.data(), bytes.size());
    }
}

/// Where record i begins, and the one before it ends.
std::size_t begin_of(std::size_t i) {
    return std::accumulate(kSizes.begin(), kSizes.begin() + static_cast<std::ptrdiff_t>(i),
                           kFileHeader + i * kRecordHeader);
}

/// What a reader says of a file.
struct Contents {
    Numbers numbers;  ///< of the records, each of which must be as it was written
    std::uint64_t intact = 0;
    std::uint64_t damaged = 0;
    std::uint64_t torn = 0;
};

Contents read(const std::filesystem::path& file) {
    RecordFileReader reader(file);
    Contents contents;
    while (const std::optional<Record> record = reader.next()) {
        const auto number = static_cast<std::size_t>(record->arrival);
        EXPECT_EQ(record->bytes, noise_bytes(number, record->bytes.size()));
        contents.numbers.push_back(number);
        contents.intact += kRecordHeader + record->bytes.size();
    }
    EXPECT_FALSE(reader.next());
    EXPECT_EQ(reader.progress(), 1.0);
    contents.damaged = reader.damaged_bytes();
    contents.torn = reader.torn_bytes();
    return contents;
}

Contents read(const TempFolder& folder, const Bytes& bytes) {
    const std::filesystem::path file = folder / "changed.rec";
    write_bytes(file, bytes);
    return read(file);
}

Bytes example(const TempFolder& folder) {
    const std::filesystem::path file = folder / "example.rec";
    write_file(file);
    return file_bytes(file);
}

void flip(Bytes& bytes, std::size_t at) {
    bytes[at] = static_cast<std::uint8_t>(bytes[at] ^ (1U << (at % 8U)));
}

Numbers without(std::size_t number) {
    Numbers numbers = kAll;
    numbers.erase(numbers.begin() + static_cast<std::ptrdiff_t>(number));
    return numbers;
}

TEST(RecordFile, GivesBackWhatWasWritten) {
    const TempFolder folder;
    write_file(folder / "a.rec");
    const Contents contents = read(folder / "a.rec");
    EXPECT_EQ(contents.numbers, kAll);
    EXPECT_EQ(contents.damaged + contents.torn, 0U);
    EXPECT_EQ(std::filesystem::file_size(folder / "a.rec"), begin_of(kSizes.size()));
}

// The layout of docs/formats.md, byte by byte, so that files stay readable.
TEST(RecordFile, LayoutIsTheOneThatIsDocumented) {
    const TempFolder folder;
    RecordFileWriter writer(folder / "a.rec");
    const Bytes payload{'1', '2', '3', '4', '5', '6', '7', '8', '9'};
    writer.append(1.5, payload.data(), payload.size());
    EXPECT_EQ(writer.bytes_written(), 49U);
    const Bytes bytes = file_bytes(folder / "a.rec");
    ASSERT_EQ(bytes.size(), 49U);
    EXPECT_EQ(Bytes(bytes.begin(), bytes.begin() + 12),
              (Bytes{'H', 'S', 'R', 'E', 'C', 'O', 'R', 'D', 1, 0, 0, 0}));
    EXPECT_EQ(Bytes(bytes.begin() + 16, bytes.begin() + 36),
              (Bytes{0xD7, 'R',  'E',  'C',  9, 0, 0, 0,  // mark, length
                     0,    0x2F, 0x68, 0x59, 0, 0, 0, 0,  // 1.5e9 ns
                     0x26, 0x39, 0xF4, 0xCB}));           // CRC-32 of 123456789
    EXPECT_EQ(Bytes(bytes.begin() + 40, bytes.end()), payload);
}

TEST(RecordFile, ArrivalsOfTodayComeBackToTheBit) {
    const TempFolder folder;
    std::mt19937_64 rng(1);
    std::vector<double> arrivals{0.0, -0.25, 1e-9, 4.0e9, -1.7e9 - 0.3};
    for (int i = 0; i < 1000; ++i) {
        arrivals.push_back(std::uniform_real_distribution<double>(1.0e9, 3.0e9)(rng));
    }
    RecordFileWriter writer(folder / "a.rec");
    for (const double arrival : arrivals) {
        writer.append(arrival, nullptr, 0);
    }
    RecordFileReader reader(folder / "a.rec");
    for (const double arrival : arrivals) {
        EXPECT_EQ(reader.next().value().arrival, arrival);
    }
}

TEST(RecordFile, ShortTimesAreKeptToTheNanosecond) {
    const TempFolder folder;
    RecordFileWriter writer(folder / "a.rec");
    writer.append(0.123456789499, nullptr, 0);
    writer.append(-0.123456789499, nullptr, 0);
    RecordFileReader reader(folder / "a.rec");
    EXPECT_NEAR(reader.next().value().arrival, 0.123456789499, 0.501e-9);
    EXPECT_NEAR(reader.next().value().arrival, -0.123456789499, 0.501e-9);
}

TEST(RecordFile, WriterRefusesWhatCannotBeKept) {
    const TempFolder folder;
    folder.write("there.rec", "precious");
    EXPECT_THAT(error_of([&] { RecordFileWriter(folder / "there.rec"); }),
                HasSubstr("there.rec: File exists"));
    EXPECT_EQ(bytes_of(folder / "there.rec"), "precious");
    EXPECT_THAT(error_of([&] { RecordFileWriter(folder / "no/a.rec"); }),
                HasSubstr("a.rec: No such file or directory"));

    RecordFileWriter writer(folder / "a.rec");
    EXPECT_THAT(error_of([&] { writer.append(1e10, nullptr, 0); }), HasSubstr("no time"));
    EXPECT_THAT(
        error_of([&] { writer.append(std::numeric_limits<double>::quiet_NaN(), nullptr, 0); }),
        HasSubstr("no time"));
    const Bytes large(RecordFileWriter::kMostBytes + 1);
    EXPECT_THAT(error_of([&] { writer.append(0.0, large.data(), large.size()); }),
                HasSubstr("too many"));
    EXPECT_TRUE(read(folder / "a.rec").numbers.empty());
}

TEST(RecordFile, LargestRecordIsReadBack) {
    const TempFolder folder;
    const Bytes large = noise_bytes(5, RecordFileWriter::kMostBytes);
    RecordFileWriter writer(folder / "a.rec");
    writer.append(0.0, large.data(), large.size());
    RecordFileReader reader(folder / "a.rec");
    EXPECT_TRUE(reader.next().value().bytes == large);
}

TEST(RecordFile, ReaderRefusesWhatIsNoRecordFile) {
    const TempFolder folder;
    EXPECT_THAT(error_of([&] { RecordFileReader(folder / "a.rec"); }),
                HasSubstr("a.rec: No such file"));
    EXPECT_THAT(error_of([&] { RecordFileReader(folder.path()); }), HasSubstr("is no plain file"));
    EXPECT_THAT(error_of([&] { RecordFileReader("/dev/zero"); }), HasSubstr("is no plain file"));
    folder.write("text", "this is a text about records");
    EXPECT_THAT(error_of([&] { RecordFileReader(folder / "text"); }),
                HasSubstr("text: is no record file"));
    folder.write("short", "HSRX");
    EXPECT_THAT(error_of([&] { RecordFileReader(folder / "short"); }),
                HasSubstr("short: is no record file"));
}

TEST(RecordFile, NewerVersionIsNamed) {
    const TempFolder folder;
    // Version 2 with its own right CRC-32.
    const std::string header("HSRECORD\x02\0\0\0\x19\xf3\x6f\xd6", 16);
    folder.write("a.rec", header);
    const std::string error = error_of([&] { RecordFileReader(folder / "a.rec"); });
    EXPECT_THAT(error, HasSubstr("a.rec: has version 2, but"));
}

TEST(RecordFile, CutAnywhereGivesAllRecordsBefore) {
    const TempFolder folder;
    const Bytes whole = example(folder);
    for (std::size_t size = 0; size < whole.size(); ++size) {
        const Contents contents =
            read(folder, Bytes(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size)));
        std::size_t expected = 0;
        while (expected < kSizes.size() && begin_of(expected + 1) <= size) {
            ++expected;
        }
        ASSERT_EQ(contents.numbers,
                  Numbers(kAll.begin(), kAll.begin() + static_cast<std::ptrdiff_t>(expected)))
            << size;
        EXPECT_EQ(contents.damaged, 0U);
        EXPECT_EQ(contents.torn, size < kFileHeader ? size : size - begin_of(expected));
    }
}

TEST(RecordFile, ZeroedEndIsTheEnd) {
    const TempFolder folder;
    const Bytes whole = example(folder);
    for (std::size_t from = 0; from < whole.size(); ++from) {
        Bytes zeroed = whole;
        std::fill(zeroed.begin() + static_cast<std::ptrdiff_t>(from), zeroed.end(), 0);
        const Contents contents = read(folder, zeroed);
        for (std::size_t i = 0; i < kSizes.size(); ++i) {
            const bool before = begin_of(i + 1) <= from;
            EXPECT_EQ(i < contents.numbers.size(), before || zeroed == whole) << from;
        }
        EXPECT_EQ(contents.damaged, 0U);
    }
}

// Growth by whole blocks of zeros, as a power cut leaves them, does not take the records before.
TEST(RecordFile, ZerosBehindTheEndAreNoDamage) {
    const TempFolder folder;
    Bytes grown = example(folder);
    grown.resize(grown.size() + (1U << 20U));
    const Contents contents = read(folder, grown);
    EXPECT_EQ(contents.numbers, kAll);
    EXPECT_EQ(contents.damaged, 0U);
    EXPECT_EQ(contents.torn, 1U << 20U);
}

TEST(RecordFile, FlippedByteCostsItsRecordAlone) {
    const TempFolder folder;
    const Bytes whole = example(folder);
    for (std::size_t at = 0; at < whole.size(); ++at) {
        Bytes changed = whole;
        flip(changed, at);
        std::size_t hit = 0;
        while (at >= kFileHeader && begin_of(hit + 1) <= at) {
            ++hit;
        }
        const Contents contents = read(folder, changed);
        ASSERT_EQ(contents.numbers, at < kFileHeader ? kAll : without(hit)) << at;
        const std::size_t lost = at < kFileHeader ? kFileHeader : kRecordHeader + kSizes[hit];
        EXPECT_EQ(contents.damaged + contents.torn, lost) << at;
    }
}

TEST(RecordFile, LostBytesCostTheirRecordsAlone) {
    const TempFolder folder;
    const Bytes whole = example(folder);
    std::mt19937 rng(3);
    for (int trial = 0; trial < 2000; ++trial) {
        const std::size_t from = kFileHeader + rng() % (whole.size() - kFileHeader);
        const std::size_t count = std::min<std::size_t>(1 + rng() % 900, whole.size() - from);
        Bytes changed(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(from));
        const Bytes inserted = noise_bytes(static_cast<std::uint64_t>(trial), rng() % 100);
        changed.insert(changed.end(), inserted.begin(), inserted.end());
        changed.insert(changed.end(), whole.begin() + static_cast<std::ptrdiff_t>(from + count),
                       whole.end());
        Numbers expected;
        for (const std::size_t number : kAll) {
            if (begin_of(number + 1) <= from || begin_of(number) >= from + count) {
                expected.push_back(number);
            }
        }
        const Contents contents = read(folder, changed);
        EXPECT_EQ(contents.numbers, expected);
        EXPECT_EQ(contents.intact + contents.damaged + contents.torn + kFileHeader, changed.size());
    }
}

// A record in the payload of another one is data, unless the other one is damaged.
TEST(RecordFile, RecordsInsideOfAPayloadAreData) {
    const TempFolder folder;
    const Bytes inner = example(folder);
    {
        RecordFileWriter writer(folder / "outer.rec");
        writer.append(7.0, inner.data(), inner.size());
        writer.append(8.0, inner.data(), inner.size());
    }
    RecordFileReader reader(folder / "outer.rec");
    const std::vector<Record> records = read_records(reader);
    ASSERT_EQ(records.size(), 2U);
    EXPECT_EQ(records[0].bytes, inner);
    EXPECT_EQ(records[1].arrival, 8.0);
}

// After damage the reader stands in the middle of bytes that hold marks with all kinds of lengths.
TEST(RecordFile, FalseMarksAreNotFollowed) {
    const TempFolder folder;
    Bytes payload;
    for (std::uint32_t length : {0U, 1U, 24U, 100U, 5000U, 1U << 26U, 0x7FFFFFFFU, 0xFFFFFFFFU}) {
        payload.insert(payload.end(), {0xD7, 'R', 'E', 'C'});
        for (unsigned shift = 0; shift < 32; shift += 8) {
            payload.push_back(static_cast<std::uint8_t>(length >> shift));
        }
        payload.insert(payload.end(), 10, 0xD7);
    }
    {
        RecordFileWriter writer(folder / "a.rec");
        writer.append(1.0, payload.data(), payload.size());
        writer.append(2.0, payload.data(), payload.size());
        writer.append(3.0, payload.data(), payload.size());
    }
    Bytes bytes = file_bytes(folder / "a.rec");
    flip(bytes, kFileHeader);                        // the mark of the first one
    flip(bytes, bytes.size() - payload.size() / 2);  // a byte in the last one
    write_bytes(folder / "a.rec", bytes);
    RecordFileReader reader(folder / "a.rec");
    const std::vector<Record> records = read_records(reader);
    ASSERT_EQ(records.size(), 1U);
    EXPECT_EQ(records[0].arrival, 2.0);
    EXPECT_EQ(records[0].bytes, payload);
    EXPECT_EQ(reader.damaged_bytes(), kRecordHeader + payload.size());
    EXPECT_EQ(reader.torn_bytes(), kRecordHeader + payload.size());
}

// More than fits into the reader's buffer at once, so that records and damage cross its borders.
TEST(RecordFile, LongFilesWithDamageAreReadPieceByPiece) {
    const TempFolder folder;
    std::mt19937 rng(11);
    std::vector<std::size_t> sizes(400);
    for (std::size_t& size : sizes) {
        size = rng() % 20'000;
    }
    write_file(folder / "a.rec", sizes);
    Bytes bytes = file_bytes(folder / "a.rec");
    std::size_t begin = kFileHeader;
    Numbers expected;
    for (std::size_t i = 0; i < sizes.size(); ++i) {
        const std::size_t length = kRecordHeader + sizes[i];
        if (i % 3 == 1) {
            flip(bytes, begin + rng() % length);
        } else {
            expected.push_back(i);
        }
        begin += length;
    }
    EXPECT_EQ(read(folder, bytes).numbers, expected);
}

TEST(RecordFile, SeekGoesOnWithTheNextRecord) {
    const TempFolder folder;
    write_file(folder / "a.rec");
    RecordFileReader reader(folder / "a.rec");
    for (std::size_t offset = begin_of(kSizes.size()); offset-- > 0;) {
        reader.seek(offset);
        std::size_t expected = 0;
        while (expected < kSizes.size() && begin_of(expected) < offset) {
            ++expected;
        }
        const std::optional<Record> record = reader.next();
        ASSERT_EQ(record.has_value(), expected < kSizes.size()) << offset;
        if (record) {
            EXPECT_EQ(record->arrival, static_cast<double>(expected));
            EXPECT_EQ(reader.position(), begin_of(expected + 1));
        }
        EXPECT_EQ(reader.damaged_bytes(), 0U);
    }
}

TEST(RecordFile, FileThatIsStillWrittenIsReadUpToItsEnd) {
    const TempFolder folder;
    RecordFileWriter writer(folder / "a.rec");
    writer.append(0.0, nullptr, 0);
    RecordFileReader reader(folder / "a.rec");
    writer.append(1.0, nullptr, 0);
    EXPECT_EQ(read_records(reader).size(), 1U);
    EXPECT_EQ(read(folder / "a.rec").numbers.size(), 2U);
}

TEST(RecordFile, FileThatIsCutMeanwhileEndsThere) {
    const TempFolder folder;
    write_file(folder / "a.rec", std::vector<std::size_t>(100, 10'000));
    RecordFileReader reader(folder / "a.rec");
    EXPECT_TRUE(reader.next());
    std::filesystem::resize_file(folder / "a.rec", 300'000);
    EXPECT_EQ(read_records(reader).size(), 28U);
}

}  // namespace
}  // namespace hybrid_slam::test
