// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>

namespace hybrid_slam {

/// Bad input or misuse, told in one line that names the file, line or key. The only exception that
/// the library throws on its own account.
class Error : public std::runtime_error {
  public:
    using std::runtime_error::runtime_error;
};

}  // namespace hybrid_slam
