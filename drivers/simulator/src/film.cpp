// SPDX-License-Identifier: Apache-2.0
#include "film.hpp"

#include <algorithm>
#include <array>
#include <cstring>

#include "hash.hpp"
#include "noise.hpp"

namespace hybrid_slam {
namespace {

/// Read noise and the shot noise's square root in one straight line: 1 at gray level 128.
constexpr float kReadShare = 0.6F;
constexpr float kShotPerLevel = (1.0F - kReadShare) / 128.0F;

/// Without branches, so that compilers make vectors of it.
std::int32_t byte_of(float level) {
    const auto whole = static_cast<std::int32_t>(level + 0.5F);
    return std::min(std::max(whole, 0), 255);
}

}  // namespace

Film::Film(int width, double noise_sigma, std::uint64_t seed)
    : noise_sigma_(noise_sigma), seed_(hash(seed)) {
    noise_.resize(kDraws + static_cast<std::size_t>(width + kBlock));
    Noise random(seed_);
    for (float& value : noise_) {
        value = static_cast<float>(noise_sigma_ * random.gauss());
    }
}

void Film::expose(std::uint64_t frame, int height) {
    starts_.resize(static_cast<std::size_t>(height) * kChannels);
    for (std::size_t i = 0; i < starts_.size(); ++i) {
        starts_[i] = static_cast<std::uint32_t>(hash(seed_, frame, i) % kDraws);
    }
}

void Film::develop(const BlockLight& light, int column, int row, Image& image) const {
    const int columns = std::min(kBlock, image.width - column);
    const int rows = std::min(kBlock, image.height - row);
    for (int line = 0; line < rows; ++line) {
        const auto start = static_cast<std::size_t>(row + line) * kChannels;
        const float* blue_noise = &noise_[starts_[start] + static_cast<std::size_t>(column)];
        const float* green_noise = &noise_[starts_[start + 1] + static_cast<std::size_t>(column)];
        const float* red_noise = &noise_[starts_[start + 2] + static_cast<std::size_t>(column)];
        const Texel* sums = light.sums.data() + line * kBlock;
        const float* gains = light.gains.data() + line * kBlock;
        std::array<std::int32_t, kBlock> words{};
        for (std::size_t i = 0; i < kBlock; ++i) {
            const auto sum = static_cast<std::int32_t>(sums[i]);
            const float gain = gains[i];
            constexpr auto kMask = static_cast<std::int32_t>(kFieldMask);
            const float blue = gain * static_cast<float>(sum & kMask);
            const float green = gain * static_cast<float>((sum >> 10) & kMask);
            const float red = gain * static_cast<float>((sum >> 20) & kMask);
            const float sigma = kReadShare + kShotPerLevel * green;
            words[i] = byte_of(blue + sigma * blue_noise[i]) |
                       byte_of(green + sigma * green_noise[i]) << 8 |
                       byte_of(red + sigma * red_noise[i]) << 16;
        }
        // Each word's fourth byte is overwritten by the next one.
        std::array<std::uint8_t, kChannels * kBlock + 1> bytes{};
        for (std::size_t i = 0; i < kBlock; ++i) {
            std::memcpy(&bytes[kChannels * i], &words[i], sizeof(std::int32_t));
        }
        std::uint8_t* target = &image.pixels[(static_cast<std::size_t>(row + line) *
                                                  static_cast<std::size_t>(image.width) +
                                              static_cast<std::size_t>(column)) *
                                             kChannels];
        if (columns == kBlock) {
            std::memcpy(target, bytes.data(), kChannels * kBlock);  // of fixed size: no call
        } else {
            std::memcpy(target, bytes.data(), kChannels * static_cast<std::size_t>(columns));
        }
    }
}

}  // namespace hybrid_slam
