// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace hybrid_slam::test {

/// What is wrong with a page whose tags are all closed, as in XML; empty when nothing is.
inline std::string markup_fault(const std::string& html) {
    std::vector<std::string> open;
    std::size_t at = 0;
    while ((at = html.find('<', at)) != std::string::npos) {
        const std::size_t end = html.find('>', at);
        if (end == std::string::npos) {
            return "a tag without an end: " + html.substr(at, 40);
        }
        const std::string tag = html.substr(at + 1, end - at - 1);
        if (tag.find('<') != std::string::npos) {
            return "a bare '<': " + html.substr(at, 40);
        }
        at = end + 1;
        if (tag[0] == '!' || tag.back() == '/') {
            continue;
        }
        if (tag[0] != '/') {
            open.push_back(tag.substr(0, tag.find(' ')));
            continue;
        }
        if (open.empty() || open.back() != tag.substr(1)) {
            return "<" + tag + "> closes " + (open.empty() ? "nothing" : open.back());
        }
        open.pop_back();
    }
    return open.empty() ? "" : "<" + open.back() + "> is not closed";
}

}  // namespace hybrid_slam::test
