// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstring>
#include <limits>
#include <utility>

#include "s300_layout.hpp"

namespace hybrid_slam {
namespace {

constexpr std::uint64_t kNever = std::numeric_limits<std::uint64_t>::max();
constexpr std::size_t kFlagByte = 8;       ///< of a header, the only one that is 0xFF
constexpr std::size_t kPatternBytes = 12;  ///< of a header, that tell it from other bytes

/// A header whose telegram is being awaited. Its three possible ends lie close together, so one
/// checksum runs on from each to the next.
struct Start {
    std::uint64_t begin = 0;  ///< in the stream
    std::uint64_t due = 0;    ///< offset behind the last byte that the rule to judge next asks for
    std::uint16_t version = 0;
    std::uint16_t size = 0;
    std::uint16_t checksum = kChecksumStart;
    std::size_t summed = kUncheckedBytes;  ///< bytes of the telegram up to which `checksum` goes
    std::size_t rule = 0;                  ///< to be judged next
    std::size_t fitted = 0;                ///< bytes, by a rule judged before
};

/// For a heap whose front is due first.
bool due_later(const Start& a, const Start& b) {
    return std::make_pair(a.due, a.begin) > std::make_pair(b.due, b.begin);
}

struct Span {
    std::uint64_t begin = 0;
    std::uint64_t end = 0;
};

/// What a telegram must have in common with others of its device.
struct Dialect {
    std::uint16_t version = 0;
    S300SizeRule rule = S300SizeRule::kFromByte12;
    std::uint64_t telegrams = 0;  ///< that fitted
};

Dialect dialect_of(const S300Telegram& telegram) {
    return {telegram.protocol, telegram.size_rule, 1};
}

bool operator==(const Dialect& a, const Dialect& b) {
    return a.version == b.version && a.rule == b.rule;
}

/// Telegrams found and not yet fetched. Slots are used again, so that no memory is asked for once
/// the stream runs.
class ReadyTelegrams {
  public:
    /// Where the next telegram can be made; `keep` makes it one of the queue.
    S300Telegram& free_slot() {
        if (end_ == slots_.size() && begin_ > end_ / 2) {
            std::rotate(slots_.begin(), slots_.begin() + static_cast<std::ptrdiff_t>(begin_),
                        slots_.end());
            end_ -= begin_;
            begin_ = 0;
        }
        if (end_ == slots_.size()) {
            slots_.emplace_back();
        }
        return slots_[end_];
    }
    void keep() { ++end_; }

    bool fetch(S300Telegram& telegram) {
        if (begin_ == end_) {
            return false;
        }
        std::swap(telegram, slots_[begin_]);
        ++begin_;
        if (begin_ == end_) {
            begin_ = 0;
            end_ = 0;
        }
        return true;
    }

  private:
    std::vector<S300Telegram> slots_;
    std::size_t begin_ = 0;
    std::size_t end_ = 0;
};

}  // namespace

/// All is decided in the order of the stream offsets at which it can be decided, so that pieces
/// make no difference.
struct S300Decoder::State {
    S300StreamCounts counts;
    ReadyTelegrams ready;

    std::vector<std::uint8_t> buffer;
    std::uint64_t buffer_begin = 0;     ///< offset of its first byte
    std::uint64_t scanned = kFlagByte;  ///< offset from which on no flag byte was looked for

    std::vector<Start> starts;          ///< heap
    std::vector<Dialect> dialects;      ///< in which telegrams are believed at once
    std::vector<S300Telegram> doubted;  ///< one of each other dialect at most
    std::vector<Span> taken;            ///< telegrams that matter for the overlap, by their ends
    std::uint64_t settled = 0;  ///< offset up to which bytes are known as telegram or garbage

    const std::uint8_t* at(std::uint64_t offset) const {
        return buffer.data() + (offset - buffer_begin);
    }

    void run();
    bool find_header(std::uint64_t limit);
    bool add_start(std::uint64_t begin);
    static bool await(Start& start);
    void judge(Start start);
    bool fits(Start& start, std::size_t total) const;
    bool is_echo(const Start& start, std::size_t total) const;
    void take(const Start& start, std::size_t total);
    bool believes(const Dialect& dialect) const;
    void remember(const Dialect& dialect);
    void doubt(const S300Telegram& telegram);
    void believe(const S300Telegram& witness, const S300Telegram& telegram);
    void give(const S300Telegram& telegram);
    void mark(const Span& span);
    void forget(std::uint64_t needed);
    void settle();
    std::uint64_t oldest_start() const;
};

void S300Decoder::State::run() {
    for (;;) {
        const std::uint64_t due = starts.empty() ? kNever : starts.front().due;
        if (find_header(std::min(counts.bytes, due))) {
            continue;
        }
        if (due > counts.bytes) {
            return;
        }
        std::pop_heap(starts.begin(), starts.end(), due_later);
        const Start start = starts.back();
        starts.pop_back();
        judge(start);
    }
}

/// Adds the next header that is complete before `limit`.
bool S300Decoder::State::find_header(std::uint64_t limit) {
    constexpr std::size_t kBehindFlag = kPatternBytes - kFlagByte;
    while (scanned + kBehindFlag <= limit) {
        const std::uint8_t* const from = at(scanned);
        const std::size_t count = limit - kBehindFlag + 1 - scanned;
        const void* const flag = std::memchr(from, 0xFF, count);
        if (flag == nullptr) {
            scanned += count;
            return false;
        }
        scanned += static_cast<std::size_t>(static_cast<const std::uint8_t*>(flag) - from) + 1;
        if (add_start(scanned - 1 - kFlagByte)) {
            return true;
        }
    }
    return false;
}

bool S300Decoder::State::add_start(std::uint64_t begin) {
    constexpr std::array<std::uint8_t, 6> kZeros{};
    constexpr std::uint8_t kVersionHigh = 0x01;
    const std::uint8_t* const header = at(begin);
    if (header[11] != kVersionHigh || std::memcmp(header, kZeros.data(), kZeros.size()) != 0) {
        return false;
    }
    Start start;
    start.begin = begin;
    start.version = little_endian16(header + 10);
    start.size = static_cast<std::uint16_t>((header[6] << 8U) | header[7]);
    if (!await(start)) {
        return false;
    }
    starts.push_back(start);
    std::push_heap(starts.begin(), starts.end(), due_later);
    return true;
}

/// Sets when the start is due by its rule or the next possible one; false when there is none.
bool S300Decoder::State::await(Start& start) {
    for (; start.rule < kSizeRules.size(); ++start.rule) {
        const std::size_t total = total_bytes(kSizeRules[start.rule], start.size);
        if (total >= kLeastBytes && total <= kMostBytes) {
            start.due = start.begin + total;
            return true;
        }
    }
    return false;
}

void S300Decoder::State::judge(Start start) {
    const std::size_t total = start.due - start.begin;
    const Dialect dialect{start.version, kSizeRules[start.rule], 1};
    counts.candidates += believes(dialect) ? 1U : 0U;
    if (fits(start, total)) {
        if (!is_echo(start, total)) {
            take(start, total);
        }
        start.fitted = total;
    }
    ++start.rule;
    if (await(start)) {
        starts.push_back(start);
        std::push_heap(starts.begin(), starts.end(), due_later);
    } else if (start.fitted == 0) {
        ++counts.bad_checksums;
    }
}

bool S300Decoder::State::fits(Start& start, std::size_t total) const {
    const std::uint8_t* const telegram = at(start.begin);
    const std::size_t end = total - kChecksumBytes;
    start.checksum = extend_checksum(start.checksum, telegram + start.summed, end - start.summed);
    start.summed = end;
    return start.checksum == little_endian16(telegram + end);
}

/// Behind its own checksum the remainder of a telegram is 0 when the checksum's two bytes are
/// equal, once in 256 times. Zeros do not change that, and a telegram begins with them: so the next
/// one makes this one fit by the longer rules too.
bool S300Decoder::State::is_echo(const Start& start, std::size_t total) const {
    if (start.fitted == 0) {
        return false;
    }
    const std::uint8_t* const end = at(start.begin) + start.fitted;
    return end[-2] == end[-1] &&
           std::all_of(end, at(start.begin) + total, [](std::uint8_t byte) { return byte == 0; });
}

void S300Decoder::State::take(const Start& start, std::size_t total) {
    S300Telegram& telegram = ready.free_slot();
    telegram.begin = start.begin;
    telegram.end = start.due;
    telegram.size_rule = kSizeRules[start.rule];
    const auto begins_there = [&](const auto& other) { return other.begin == start.begin; };
    if (!take_apart(at(start.begin), total, telegram)) {
        ++counts.bad_contents;
    } else if (believes(dialect_of(telegram))) {
        remember(dialect_of(telegram));
        ++counts.telegrams;
        mark({telegram.begin, telegram.end});
        ready.keep();
        // What fits by a believed rule fits by another one once in 65536 times.
        doubted.erase(std::remove_if(doubted.begin(), doubted.end(), begins_there), doubted.end());
    } else if (std::none_of(taken.begin(), taken.end(), begins_there)) {
        doubt(telegram);
    }
}

bool S300Decoder::State::believes(const Dialect& dialect) const {
    constexpr std::uint16_t kLastDocumented = 0x0103;
    bool version_known = false;
    for (const Dialect& known : dialects) {
        if (known == dialect) {
            return true;
        }
        version_known = version_known || known.version == dialect.version;
    }
    return !version_known && (dialect.version <= kLastDocumented || dialects.empty());
}

void S300Decoder::State::remember(const Dialect& dialect) {
    const auto known = std::find(dialects.begin(), dialects.end(), dialect);
    if (known == dialects.end()) {
        dialects.push_back(dialect);
    } else {
        known->telegrams += dialect.telegrams;
    }
}

/// Holds the telegram back, or gives it together with the one of its dialect that was held back.
void S300Decoder::State::doubt(const S300Telegram& telegram) {
    const auto earlier = std::find_if(
        doubted.begin(), doubted.end(),
        [&](const S300Telegram& other) { return dialect_of(other) == dialect_of(telegram); });
    if (earlier == doubted.end()) {
        doubted.push_back(telegram);
        return;
    }
    if (telegram.begin < earlier->end || telegram.begin - earlier->end > kWitnessBytes) {
        ++counts.bad_checksums;
        *earlier = telegram;
        return;
    }
    const S300Telegram first = std::move(*earlier);
    doubted.erase(earlier);
    believe(first, S300Telegram(telegram));
}

void S300Decoder::State::believe(const S300Telegram& witness, const S300Telegram& telegram) {
    // Another dialect of this version that was seen once only may have been a false one.
    dialects.erase(std::remove_if(dialects.begin(), dialects.end(),
                                  [&](const Dialect& other) {
                                      return other.version == telegram.protocol &&
                                             other.telegrams == 1;
                                  }),
                   dialects.end());
    remember(dialect_of(witness));
    remember(dialect_of(telegram));
    give(witness);
    give(telegram);
}

void S300Decoder::State::give(const S300Telegram& telegram) {
    ready.free_slot() = telegram;
    ready.keep();
    ++counts.telegrams;
    mark({telegram.begin, telegram.end});
}

void S300Decoder::State::mark(const Span& span) {
    auto place = taken.end();
    while (place != taken.begin() && std::prev(place)->end > span.end) {
        --place;
    }
    const bool overlaps = (place != taken.begin() && std::prev(place)->end > span.begin) ||
                          std::any_of(place, taken.end(),
                                      [&](const Span& behind) { return behind.begin < span.end; });
    counts.overlapping += overlaps ? 1U : 0U;
    taken.insert(place, span);
}

/// The first offset that a telegram to come may begin at.
std::uint64_t S300Decoder::State::oldest_start() const {
    std::uint64_t oldest = scanned - kFlagByte;
    for (const Start& start : starts) {
        oldest = std::min(oldest, start.begin);
    }
    return oldest;
}

/// Forgets doubted telegrams that no witness can come for, and the bytes before `needed`.
void S300Decoder::State::forget(std::uint64_t needed) {
    const auto kept = std::remove_if(
        doubted.begin(), doubted.end(),
        [&](const S300Telegram& telegram) { return needed > telegram.end + kWitnessBytes; });
    counts.bad_checksums += static_cast<std::uint64_t>(doubted.end() - kept);
    doubted.erase(kept, doubted.end());
    constexpr std::uint64_t kWorthMoving = 4096;
    if (needed - buffer_begin >= kWorthMoving) {
        buffer.erase(buffer.begin(),
                     buffer.begin() + static_cast<std::ptrdiff_t>(needed - buffer_begin));
        buffer_begin = needed;
    }
}

/// Counts the garbage before all that is still open.
void S300Decoder::State::settle() {
    std::uint64_t open = oldest_start();
    forget(open);
    for (const S300Telegram& telegram : doubted) {
        open = std::min(open, telegram.begin);
    }
    std::sort(taken.begin(), taken.end(),
              [](const Span& a, const Span& b) { return a.begin < b.begin; });
    for (const Span& span : taken) {
        if (span.begin < open) {
            counts.garbage_bytes += std::max(settled, span.begin) - settled;
            settled = std::max(settled, span.end);
        }
    }
    counts.garbage_bytes += std::max(settled, open) - settled;
    settled = std::max(settled, open);
    taken.erase(std::remove_if(taken.begin(), taken.end(),
                               [&](const Span& span) { return span.end <= open; }),
                taken.end());
    std::sort(taken.begin(), taken.end(),
              [](const Span& a, const Span& b) { return a.end < b.end; });
}

S300Decoder::S300Decoder() : state_(std::make_unique<State>()) {}
S300Decoder::~S300Decoder() = default;
S300Decoder::S300Decoder(S300Decoder&&) noexcept = default;
S300Decoder& S300Decoder::operator=(S300Decoder&&) noexcept = default;

void S300Decoder::push(const std::uint8_t* bytes, std::size_t count) {
    State& state = *state_;
    state.buffer.insert(state.buffer.end(), bytes, bytes + count);
    state.counts.bytes += count;
    state.run();
    state.settle();
}

bool S300Decoder::next(S300Telegram& telegram) {
    return state_->ready.fetch(telegram);
}

const S300StreamCounts& S300Decoder::counts() const {
    return state_->counts;
}

}  // namespace hybrid_slam
