// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstdlib>

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/recording/record_file.hpp"
#include "input_file.hpp"

namespace {

constexpr std::uint64_t kRecordHeader = 24;
constexpr std::uint64_t kFileHeader = 16;

void require(bool condition) {
    if (!condition) {
        std::abort();
    }
}

/// Every byte belongs to the file's header, to a record, to the damage or to the torn end.
void read_to_the_end(hybrid_slam::RecordFileReader& reader) noexcept {
    std::uint64_t intact = 0;
    while (const auto record = reader.next()) {
        require(std::isfinite(record->arrival));
        intact += kRecordHeader + record->bytes.size();
        require(reader.position() <= reader.size());
    }
    const std::uint64_t told = intact + reader.damaged_bytes() + reader.torn_bytes();
    require(told == reader.size() || told + kFileHeader == reader.size());
    require(reader.progress() == 1.0 && !reader.next());
}

/// What is found from the middle on is no more than what is found from the start.
void read_from(hybrid_slam::RecordFileReader& reader, std::uint64_t offset) noexcept {
    reader.seek(offset);
    while (reader.next()) {
        require(reader.position() > offset && reader.position() <= reader.size());
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const hybrid_slam::fuzz::InputFile input(data, size);
    try {
        hybrid_slam::RecordFileReader reader(input.path());
        read_to_the_end(reader);
        read_from(reader, size / 2);
        read_from(reader, size + 7);
    } catch (const hybrid_slam::Error&) {
        // Refused at construction, which is allowed.
    }
    return 0;
}
