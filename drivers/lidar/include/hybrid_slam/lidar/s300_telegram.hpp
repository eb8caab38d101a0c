// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace hybrid_slam {

/// One hit of the reflector block.
struct S300Reflector {
    double angle = 0.0;      ///< radians from the first beam
    double distance = 0.0;   ///< metres
    std::uint8_t flags = 0;  ///< BeamFlag bits
};

/// What the size field counts: it differs between firmware versions and configurations.
enum class S300SizeRule : std::uint8_t {
    kFromByte4,  ///< total = 4 + 2 * size (protocol 0x0102)
    kFromByte8,  ///< total = 8 + 2 * size (0x0103 without I/O and measuring field)
    kFromByte12  ///< total = 14 + 2 * size, the checksum not counted (0x0103)
};

/// One telegram of the continuous output, taken apart but not interpreted.
struct S300Telegram {
    std::uint64_t begin = 0;          ///< offset of its first byte in the stream
    std::uint64_t end = 0;            ///< offset behind its last byte
    std::uint16_t protocol = 0x0103;  ///< 0x0102, 0x0103 (S3000 before: 0x0100)
    S300SizeRule size_rule = S300SizeRule::kFromByte12;
    std::uint8_t address = 0x07;  ///< 7 stand-alone or host, 8 guest
    std::uint16_t status = 0;     ///< 0 normal, anything else lock-out
    std::uint32_t scan_number = 0;
    std::uint16_t telegram_number = 0;
    std::vector<std::uint16_t> io;     ///< words of the I/O block; empty without one
    std::uint8_t field = 0;            ///< measuring field 1 to 5; 0 without distances
    std::vector<std::uint16_t> words;  ///< of the measuring field: distance in cm and status bits
    std::size_t more_fields = 0;       ///< behind the first one; left out, and not encoded
    std::vector<S300Reflector> reflectors;
};

/// What a decoder met; all of it was survived. bytes = those of telegrams + garbage + pending.
struct S300StreamCounts {
    std::uint64_t bytes = 0;
    std::uint64_t telegrams = 0;  ///< intact ones
    /// Checksums compared of which a fit is believed at once; a random one fits once in 65536.
    std::uint64_t candidates = 0;
    std::uint64_t garbage_bytes = 0;  ///< in no intact telegram
    std::uint64_t bad_checksums = 0;  ///< headers whose telegram fits by none of the size rules
    std::uint64_t bad_contents = 0;   ///< checksum right, but blocks that cannot be taken apart
    std::uint64_t overlapping = 0;    ///< intact telegrams that begin inside of another one
};

/// Finds the intact telegrams in a stream of bytes, however it is cut into pieces. A telegram is
/// taken when its checksum fits (CRC-16/CCITT over all but its first four bytes) by any of the
/// three size rules. Every header is followed up on its own and by every rule, so that a false one
/// neither hides a telegram inside of it nor delays one behind it.
///
/// A device keeps to one rule. So by another one than its protocol has shown, where a damaged
/// telegram would have two more chances to fit, a telegram is held back until a second one fits by
/// that rule within kWitnessBytes; then both are given, and the rule counts as shown. The same goes
/// for an undocumented protocol, unless it is the first in the stream.
class S300Decoder {
  public:
    S300Decoder();
    ~S300Decoder();
    S300Decoder(S300Decoder&&) noexcept;
    S300Decoder& operator=(S300Decoder&&) noexcept;

    /// Appends bytes and looks for telegrams that they complete.
    void push(const std::uint8_t* bytes, std::size_t count);

    /// The next telegram found, in the order of their ends (but for one that was held back); false
    /// when there is none. Reuses the memory of `telegram`.
    bool next(S300Telegram& telegram);

    const S300StreamCounts& counts() const;

    /// Of a telegram; a longer size is no telegram.
    static constexpr std::size_t kMostBytes = 4096;
    static constexpr std::size_t kWitnessBytes = 65536;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

/// A telegram as bytes: io, words and reflectors in this order, as far as there are any. Throws
/// Error for what no telegram can say (more than kMostBytes, no block at all, field 6, a reflector
/// at more than 81.91 m).
std::vector<std::uint8_t> encode(const S300Telegram& telegram);

/// CRC-16/CCITT-FALSE: polynomial 0x1021, start 0xFFFF, not reflected.
std::uint16_t s300_checksum(const std::uint8_t* bytes, std::size_t count);

/// Distance words. See facts in docs/formats.md.
inline constexpr std::uint16_t kS300DistanceMask = 0x1FFF;  ///< centimetres
inline constexpr std::uint16_t kS300NoReturn = 2996;
inline constexpr std::uint16_t kS300Standby = 0x4004;  ///< in all words: the scanner stands by

}  // namespace hybrid_slam
