// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace hybrid_slam {

/// A serial device with raw bytes, for this process alone. Nothing here waits.
class SerialDevice {
  public:
    /// At any baud rate that its driver takes; drops what it had received. Throws Error with
    /// `name`.
    SerialDevice(const std::string& device, int baud, const std::string& name);
    ~SerialDevice();
    SerialDevice(const SerialDevice&) = delete;
    SerialDevice& operator=(const SerialDevice&) = delete;

    const std::string& name() const { return name_; }
    int descriptor() const { return descriptor_; }

    /// What is there; empty when nothing is. Throws Error when the device is gone.
    std::string read();

    /// How many of the bytes the device took. Throws Error when it is gone.
    std::size_t write(const std::string& bytes);

    /// Bytes that were taken but did not leave yet, where the driver knows.
    std::size_t unsent() const;

    void forget_unsent() const;

  private:
    std::string name_;
    int descriptor_ = -1;
    bool exclusive_ = false;
};

}  // namespace hybrid_slam
