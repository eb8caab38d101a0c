// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "hybrid_slam/lidar/s300_telegram.hpp"

namespace hybrid_slam {

/// Finds scans in the stream as the thesis describes it (section 3.5.1): four zero bytes,
/// BB BB 11 11 and 541 distance words. Has the shape of S300Decoder; of the telegrams only begin,
/// end, field and words are filled, and scan numbers are counted here. A scan that another one's
/// header cuts short is garbage.
class ThesisWordsDecoder {
  public:
    void push(const std::uint8_t* bytes, std::size_t count);
    bool next(S300Telegram& telegram);
    const S300StreamCounts& counts() const { return counts_; }

  private:
    std::size_t find_header(std::size_t from, std::size_t to) const;
    void skip_to(std::size_t place);

    std::vector<std::uint8_t> buffer_;
    std::size_t read_ = 0;     ///< bytes of the buffer that are done with
    std::uint64_t begin_ = 0;  ///< offset of the buffer in the stream
    S300StreamCounts counts_;
};

}  // namespace hybrid_slam
