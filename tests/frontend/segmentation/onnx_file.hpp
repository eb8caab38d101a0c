// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

/// Writes the little of ONNX that tests need: a chain of layers, of which each takes what the one
/// before gives. An ONNX file is a protobuf message; the numbers are those of its onnx.proto.
namespace hybrid_slam::test {

/// One protobuf message.
class Message {
  public:
    Message& number(unsigned field, std::int64_t value) {
        key(field, 0);
        varint(static_cast<std::uint64_t>(value));
        return *this;
    }
    Message& text(unsigned field, const std::string& value) {
        key(field, 2);
        varint(value.size());
        bytes_ += value;
        return *this;
    }
    Message& message(unsigned field, const Message& value) { return text(field, value.bytes_); }

    const std::string& bytes() const { return bytes_; }

  private:
    void key(unsigned field, unsigned wire_type) { varint(field << 3U | wire_type); }
    void varint(std::uint64_t value) {
        while (value >= 0x80U) {
            bytes_ += static_cast<char>(value | 0x80U);
            value >>= 7U;
        }
        bytes_ += static_cast<char>(value);
    }

    std::string bytes_;
};

class OnnxFile {
  public:
    OnnxFile(int width, int height) : width_(width), height_(height) {}

    /// A 1 x 1 convolution from 3 channels, of the weights by output channel: red, green, blue (as
    /// the network is given them) and the bias. Only each `stride`-th pixel is computed.
    void add_convolution(const std::vector<std::vector<float>>& weights, int stride = 1) {
        std::vector<float> factors;
        std::vector<float> biases;
        for (const std::vector<float>& row : weights) {
            factors.insert(factors.end(), row.begin(), row.end() - 1);
            biases.push_back(row.back());
        }
        const auto rows = static_cast<int>(weights.size());
        const auto columns = static_cast<int>(weights.front().size()) - 1;
        graph_.message(5, tensor("factors", {rows, columns, 1, 1}, factors));
        graph_.message(5, tensor("biases", {rows}, biases));
        Message node = layer("Conv");
        node.text(1, "factors").text(1, "biases");
        node.message(5, integers("kernel_shape", {1, 1}));
        node.message(5, integers("strides", {stride, stride}));
        graph_.message(1, node);
    }

    /// A layer without parameters: "Sigmoid", "GlobalAveragePool", "Flatten".
    void add(const std::string& kind) { graph_.message(1, layer(kind)); }

    std::string bytes() const {
        Message graph = graph_;
        graph.text(2, "tiny");
        graph.message(11, value(value_name(0), {1, 3, height_, width_}));
        graph.message(12, value(value_name(layers_), {}));
        Message opset;
        opset.text(1, "").number(2, 11);
        return Message().number(1, 7).message(7, graph).message(8, opset).bytes();
    }

    void write(const std::filesystem::path& file) const {
        std::ofstream(file, std::ios::binary) << bytes();
    }

  private:
    static std::string value_name(int layer) { return "value" + std::to_string(layer); }

    static Message tensor(const std::string& name, const std::vector<int>& shape,
                          const std::vector<float>& values) {
        Message made;
        for (const int side : shape) {
            made.number(1, side);
        }
        std::string raw(values.size() * sizeof(float), '\0');
        std::memcpy(raw.data(), values.data(), raw.size());
        return made.number(2, 1).text(8, name).text(9, raw);
    }

    static Message integers(const std::string& name, const std::vector<int>& values) {
        Message made;
        made.text(1, name);
        for (const int value : values) {
            made.number(8, value);
        }
        return made.number(20, 7);
    }

    /// Floats of a shape; an empty one is left open.
    static Message value(const std::string& name, const std::vector<int>& shape) {
        Message type;
        type.number(1, 1);
        Message sides;
        for (const int side : shape) {
            sides.message(1, Message().number(1, side));
        }
        type.message(2, sides);
        return Message().text(1, name).message(2, Message().message(1, type));
    }

    Message layer(const std::string& kind) {
        Message node;
        node.text(1, value_name(layers_));
        ++layers_;
        node.text(2, value_name(layers_)).text(3, kind + std::to_string(layers_)).text(4, kind);
        return node;
    }

    int width_;
    int height_;
    int layers_ = 0;
    Message graph_;
};

}  // namespace hybrid_slam::test
