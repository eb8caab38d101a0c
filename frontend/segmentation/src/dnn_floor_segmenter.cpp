// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/segmentation/dnn_floor_segmenter.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <mutex>
#include <opencv2/core/utils/logger.hpp>
#include <opencv2/dnn/dnn.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>

#include "hybrid_slam/core/error.hpp"

namespace hybrid_slam {
namespace {

constexpr std::size_t kChannels = 3;

/// One number for all channels, or one for each.
std::array<double, kChannels> by_channel(const char* key, const std::vector<double>& values) {
    if (values.size() != 1 && values.size() != kChannels) {
        throw Error(std::string("segmentation.") + key + ": must hold one number or three");
    }
    return {values.front(), values[values.size() / 2], values.back()};
}

std::vector<int> whole_numbers(const std::vector<double>& values) {
    std::vector<int> numbers;
    for (const double value : values) {
        numbers.push_back(static_cast<int>(value));
        if (numbers.back() != value) {
            throw Error("segmentation.floor_classes: must hold whole numbers");
        }
    }
    if (numbers.empty()) {
        throw Error("segmentation.floor_classes: must name a class");
    }
    return numbers;
}

SegmentationConfig checked(SegmentationConfig config) {
    ConfigSchema schema;
    const ConfigSchema::Section section(schema, "segmentation");
    describe(schema, config);
    for (const ConfigField& field : schema.fields()) {
        field.set(field.get());  // throws for values out of their ranges
    }
    if (config.file.empty()) {
        throw Error("segmentation.file: names no network");
    }
    return config;
}

/// OpenCV's messages hold line ends, and its own file and line first.
std::string one_line(const cv::Exception& error) {
    return error.err.substr(0, error.err.find('\n'));
}

/// Read here, so that what cannot be read and what is no network are told apart.
std::string bytes_of(const std::string& file) {
    std::ifstream in(file, std::ios::binary);
    std::ostringstream bytes;
    bytes << in.rdbuf();  // fails for an empty file, too
    if (!in || !bytes) {
        throw Error(file + (in.is_open() ? ": is empty or cannot be read" : ": cannot be opened"));
    }
    return bytes.str();
}

cv::dnn::Net read_network(const std::string& file) {
    // OpenCV would report to the standard error as well what it throws.
    static std::once_flag silenced;
    std::call_once(silenced,
                   [] { cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT); });
    const std::string bytes = bytes_of(file);
    cv::dnn::Net network;
    try {
        network = cv::dnn::readNetFromONNX(bytes.data(), bytes.size());
    } catch (const cv::Exception& error) {
        throw Error(file + ": not an ONNX network that OpenCV can read: " + one_line(error));
    }
    if (network.empty()) {
        throw Error(file + ": holds no network");
    }
    network.setPreferableBackend(cv::dnn::DNN_BACKEND_OPENCV);
    network.setPreferableTarget(cv::dnn::DNN_TARGET_CPU);
    return network;
}

std::string shape_text(const cv::Mat& blob) {
    std::string text;
    for (int i = 0; i < blob.dims; ++i) {
        text += (i == 0 ? "" : " x ") + std::to_string(blob.size[i]);
    }
    return text;
}

cv::Mat bgr_of(const Image& image) {
    if (!is_consistent(image)) {
        throw Error("segmentation: the image is neither gray nor BGR, or has not its pixels");
    }
    cv::Mat bgr(image.height, image.width, CV_8UC(image.channels));
    std::copy(image.pixels.begin(), image.pixels.end(), bgr.data);
    if (image.channels == 1) {
        cv::cvtColor(bgr, bgr, cv::COLOR_GRAY2BGR);
    }
    return bgr;
}

}  // namespace

struct DnnFloorSegmenter::State {
    explicit State(const SegmentationConfig& config_in)
        : config(checked(config_in)),
          mean(by_channel("mean", config.mean)),
          scale(by_channel("scale", config.scale)),
          floor_classes(whole_numbers(config.floor_classes)),
          network(read_network(config.file)) {
        check_output(run(cv::Mat::zeros(config.input_height, config.input_width, CV_8UC3)));
    }

    cv::Mat run(const cv::Mat& bgr);
    void check_output(const cv::Mat& scores) const;
    cv::Mat margin(cv::Mat& scores) const;
    bool is_floor(int number) const {
        return std::find(floor_classes.begin(), floor_classes.end(), number) != floor_classes.end();
    }

    SegmentationConfig config;
    std::array<double, kChannels> mean;
    std::array<double, kChannels> scale;
    std::vector<int> floor_classes;
    cv::dnn::Net network;
};

cv::Mat DnnFloorSegmenter::State::run(const cv::Mat& bgr) {
    const cv::Size size(config.input_width, config.input_height);
    const cv::Scalar means(mean[0], mean[1], mean[2]);
    cv::Mat blob = cv::dnn::blobFromImage(bgr, 1.0, size, means, config.swap_rb, false);
    for (int channel = 0; channel < static_cast<int>(kChannels); ++channel) {
        cv::Mat plane(size, CV_32F, blob.ptr<float>(0, channel));
        plane *= scale[static_cast<std::size_t>(channel)];
    }
    try {
        network.setInput(blob);
        return network.forward(network.getUnconnectedOutLayersNames().front());
    } catch (const cv::Exception& error) {
        throw Error(config.file + ": does not run on 1 x 3 x " + std::to_string(size.height) +
                    " x " + std::to_string(size.width) + " numbers: " + one_line(error));
    }
}

void DnnFloorSegmenter::State::check_output(const cv::Mat& scores) const {
    if (scores.dims != 4 || scores.size[0] != 1 || scores.total() == 0 ||
        scores.depth() != CV_32F) {
        throw Error(config.file + ": its output is " + shape_text(scores) +
                    ", and not 1 x classes x height x width of floats");
    }
    const int classes = scores.size[1];
    const int largest = *std::max_element(floor_classes.begin(), floor_classes.end());
    if (classes > 1 && largest >= classes) {
        throw Error("segmentation.floor_classes: " + std::to_string(largest) + ", but " +
                    config.file + " has " + std::to_string(classes) + " classes from 0");
    }
}

/// More than zero where there is floor: by how much the best score of a floor class is above the
/// best other one, or the probability above its threshold. Unlike classes it can be interpolated.
cv::Mat DnnFloorSegmenter::State::margin(cv::Mat& scores) const {
    const cv::Size size(scores.size[3], scores.size[2]);
    const auto channel = [&](int number) {
        return cv::Mat(size, CV_32F, scores.ptr<float>(0, number));
    };
    if (scores.size[1] == 1) {
        return channel(0) - config.threshold;
    }
    constexpr float kNone = -1e30F;
    cv::Mat floor(size, CV_32F, cv::Scalar(kNone));
    cv::Mat other(size, CV_32F, cv::Scalar(kNone));
    for (int number = 0; number < scores.size[1]; ++number) {
        cv::Mat& best = is_floor(number) ? floor : other;
        cv::max(best, channel(number), best);
    }
    return floor - other;
}

DnnFloorSegmenter::DnnFloorSegmenter(const SegmentationConfig& config)
    : state_(std::make_unique<State>(config)) {}
DnnFloorSegmenter::~DnnFloorSegmenter() = default;

FloorMask DnnFloorSegmenter::segment(const Image& image) {
    const cv::Mat bgr = bgr_of(image);
    cv::Mat scores = state_->run(bgr);
    state_->check_output(scores);
    cv::Mat margin;
    cv::resize(state_->margin(scores), margin, bgr.size(), 0.0, 0.0, cv::INTER_LINEAR);
    FloorMask mask;
    mask.width = image.width;
    mask.height = image.height;
    mask.is_floor.resize(margin.total());
    std::transform(margin.begin<float>(), margin.end<float>(), mask.is_floor.begin(),
                   [](float value) { return static_cast<std::uint8_t>(value > 0.0F ? 1 : 0); });
    return mask;
}

}  // namespace hybrid_slam
