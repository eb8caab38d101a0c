// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "comparison.hpp"
#include "comparison_table.hpp"

namespace hybrid_slam::tools {

/// A picture to be put into a page whole.
struct PagePicture {
    std::string title;
    std::string caption;
    std::string png;  ///< the bytes of the file
};

/// One page of HTML with everything in it: no scripts, nothing to be loaded. What differs between
/// two runs on the same drive is inside of the section "cost".
std::string page_of(const Comparison& comparison, const ComparisonTable& table,
                    const std::vector<PagePicture>& pictures);

/// Text that HTML takes as it is, between tags and in attributes.
std::string escaped(std::string_view text);
/// RFC 4648.
std::string base64(std::string_view bytes);

}  // namespace hybrid_slam::tools
