// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <csetjmp>
#include <cstdio>
// After cstdio, which it needs and does not include.
#include <jpeglib.h>

namespace hybrid_slam {

/// How libjpeg tells of errors here: nothing on stderr; errors jump to `leave`, which must be set
/// first, over nothing that has a destructor; warnings mean that the image is damaged.
struct JpegTrouble {
    jpeg_error_mgr manager{};
    std::jmp_buf leave{};
    bool damaged = false;
};

/// What goes into the codec's member `err`.
jpeg_error_mgr* install(JpegTrouble& trouble);

[[noreturn]] void give_up(j_common_ptr codec);

}  // namespace hybrid_slam
