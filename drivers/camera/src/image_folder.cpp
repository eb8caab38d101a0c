// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <vector>

#include "captures.hpp"
#include "hybrid_slam/core/error.hpp"

namespace hybrid_slam {
namespace {

bool is_image(const std::filesystem::path& file) {
    std::string ending = file.extension().string();
    std::transform(ending.begin(), ending.end(), ending.begin(),
                   [](unsigned char letter) { return std::tolower(letter); });
    return ending == ".jpg" || ending == ".jpeg" || ending == ".png" || ending == ".pgm" ||
           ending == ".ppm" || ending == ".pnm";
}

std::vector<std::filesystem::path> images_in(const std::string& folder) {
    std::vector<std::filesystem::path> files;
    std::error_code error;
    for (std::filesystem::directory_iterator entry(folder, error), end; !error && entry != end;
         entry.increment(error)) {
        if (is_image(entry->path()) && entry->is_regular_file(error)) {
            files.push_back(entry->path());
        }
    }
    if (error) {
        throw Error(folder + ": " + error.message());
    }
    if (files.empty()) {
        throw Error(folder + ": holds no image (jpg, png, pgm or ppm)");
    }
    std::sort(files.begin(), files.end());
    return files;
}

class ImageFolder : public Capture {
  public:
    explicit ImageFolder(const CameraConfig& config)
        : files_(images_in(config.device)), pace_(config.rate) {}

    bool read(EncodedImage& image, double timeout) override {
        if (ended() || !pace_.wait(timeout)) {
            return false;
        }
        const std::filesystem::path& file = files_[next_++];
        std::ifstream stream(file, std::ios::binary);
        image.assign(std::istreambuf_iterator<char>(stream), {});
        if (!stream) {
            throw Error(file.string() + ": cannot be read");
        }
        return true;
    }

    bool ended() const override { return next_ == files_.size(); }

  private:
    std::vector<std::filesystem::path> files_;
    std::size_t next_ = 0;
    Pace pace_;
};

}  // namespace

std::unique_ptr<Capture> open_image_folder(const CameraConfig& config) {
    return std::make_unique<ImageFolder>(config);
}

}  // namespace hybrid_slam
