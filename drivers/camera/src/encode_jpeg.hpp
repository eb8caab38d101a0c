// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hybrid_slam/camera/image_codec.hpp"

namespace hybrid_slam {

/// By libjpeg itself: OpenCV's imencode first registers the hundreds of formats of GDAL. The sizes
/// of the image fit together. Throws Error when libjpeg fails.
EncodedImage compress(const Image& image, int quality);

}  // namespace hybrid_slam
