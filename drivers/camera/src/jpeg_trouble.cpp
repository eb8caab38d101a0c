// SPDX-License-Identifier: Apache-2.0
#include "jpeg_trouble.hpp"

#include <jerror.h>

namespace hybrid_slam {
namespace {

/// Webcams pad their images; so few bytes between data and end are not worth losing the image for.
constexpr int kMostPadding = 64;

JpegTrouble& trouble_of(j_common_ptr codec) {
    // The manager is the first member, as libjpeg expects of whoever extends it.
    return *reinterpret_cast<JpegTrouble*>(codec->err);
}

void note(j_common_ptr codec, int level) {
    if (level >= 0) {
        return;  // a trace, no warning
    }
    const jpeg_error_mgr& message = *codec->err;
    const bool padding = message.msg_code == JWRN_EXTRANEOUS_DATA &&
                         message.msg_parm.i[0] <= kMostPadding && message.msg_parm.i[1] == JPEG_EOI;
    trouble_of(codec).damaged = trouble_of(codec).damaged || !padding;
}

void say_nothing(j_common_ptr) {}

}  // namespace

void give_up(j_common_ptr codec) {
    std::longjmp(trouble_of(codec).leave, 1);
}

jpeg_error_mgr* install(JpegTrouble& trouble) {
    jpeg_error_mgr* manager = jpeg_std_error(&trouble.manager);
    manager->error_exit = give_up;
    manager->emit_message = note;
    manager->output_message = say_nothing;
    return manager;
}

}  // namespace hybrid_slam
