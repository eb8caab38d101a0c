// SPDX-License-Identifier: Apache-2.0
// What all test programs have precompiled; see hybrid_slam_test.
