// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "hybrid_slam/core/error.hpp"

namespace hybrid_slam::test {

/// What the Error says that the call throws; fails the test when it throws none.
template <typename Call>
std::string error_of(Call&& call) {
    try {
        call();
    } catch (const Error& error) {
        return error.what();
    }
    ADD_FAILURE() << "no hybrid_slam::Error was thrown";
    return {};
}

}  // namespace hybrid_slam::test
