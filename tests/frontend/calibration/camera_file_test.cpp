// SPDX-License-Identifier: Apache-2.0
#include "hybrid_slam/calibration/camera_file.hpp"

#include <gmock/gmock.h>

#include "hybrid_slam/sensors/robot.hpp"
#include "support/error_of.hpp"
#include "support/temp_folder.hpp"

namespace hybrid_slam::test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// What Error says of a file with these bytes, without the folder that it lies in.
std::string refusal(const std::string& bytes) {
    const TempFolder folder;
    const std::filesystem::path file = folder.write("camera.yaml", bytes);
    const std::string what = error_of([&] { read_camera_file(file); });
    const std::string place = folder.path().string() + "/";
    EXPECT_EQ(what.rfind(place, 0), 0U) << what;
    return what.substr(std::min(place.size(), what.size()));
}

constexpr auto kOpenCv = R"(%YAML:1.0
---
calibration_time: "Mon 06 Jul 2026"
nframes: 13
image_width: 640
image_height: 480
board_width: 9
flags: 2
fisheye_model: 0
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 5.3591573396163199e+02, 0., 3.4228315473308373e+02, 0.,
       5.3591573396163199e+02, 2.3557082909788173e+02, 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 5
   cols: 1
   dt: d
   data: [ -2.6637260909660682e-01, -3.8588898922304653e-02,
       1.7831947042852964e-03, -2.8122100441115472e-04,
       2.3839153080878486e-01 ]
avg_reprojection_error: 3.9259098975581364e-01
)";

constexpr auto kRos = R"(image_width: 1280
image_height: 720
camera_name: narrow_stereo
camera_matrix:
  rows: 3
  cols: 3
  data: [900.5, 0, 640.25, 0, 901.5, 360.75, 0, 0, 1]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [-0.1, 0.02, 0.003, -0.004, 0.5]
rectification_matrix:
  rows: 3
  cols: 3
  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]
projection_matrix:
  rows: 3
  cols: 4
  data: [900, 0, 640, 0, 0, 900, 360, 0, 0, 0, 1, 0]
)";

std::string with(std::string text, const std::string& old, const std::string& fresh) {
    const std::size_t at = text.find(old);
    EXPECT_NE(at, std::string::npos) << old;
    return text.replace(at, old.size(), fresh);
}

TEST(CameraFile, ReadsBackWhatItWrites) {
    CameraModel model;
    model.width = 1280;
    model.fx = 1.0 / 3.0 + 700.0;
    model.k3 = -1e-17;
    CameraMounting mounting;
    mounting.z = 0.1 + 0.2;
    mounting.pitch = 0.123456789;
    const TempFolder folder;
    const CameraFile file =
        read_camera_file(folder.write("camera.yaml", camera_yaml(model, mounting)));
    EXPECT_EQ(file.format, CameraFormat::kRobot);
    EXPECT_TRUE(file.has_model && file.has_mounting);
    EXPECT_THAT(file.other_keys, IsEmpty());
    EXPECT_EQ(camera_yaml(file.model, file.mounting), camera_yaml(model, mounting));
    EXPECT_EQ(file.model.fx, model.fx);
    EXPECT_EQ(file.model.k3, model.k3);
    EXPECT_EQ(file.mounting.z, mounting.z);
    EXPECT_EQ(file.mounting.pitch, mounting.pitch);
}

TEST(CameraFile, WhatItWritesIsPartOfARobotFile) {
    CameraModel model;
    model.fx = 512.25;
    CameraMounting mounting;
    mounting.x = 0.75;
    const TempFolder folder;
    const RobotConfig robot = read_robot(folder.write("camera.yaml", camera_yaml(model, mounting)));
    EXPECT_EQ(robot.camera.model.fx, 512.25);
    EXPECT_EQ(robot.camera.mounting.x, 0.75);
    EXPECT_EQ(robot.lidar.port, LidarConfig().port);
}

TEST(CameraFile, ReadsAWholeRobotFile) {
    RobotConfig robot;
    robot.camera.model.cx = 300.5;
    robot.camera.mounting.roll = radians(1.5);
    const TempFolder folder;
    const CameraFile file = read_camera_file(folder.write("robot.yaml", to_yaml(robot)));
    EXPECT_EQ(file.format, CameraFormat::kRobot);
    EXPECT_EQ(file.model.cx, 300.5);
    EXPECT_EQ(file.mounting.roll, radians(1.5));
    EXPECT_THAT(file.other_keys,
                ElementsAre("name", "lidar", "camera.enabled", "camera.device", "camera.rate",
                            "camera.latency", "camera.stall_after", "vehicle", "can"));
}

TEST(CameraFile, ReadsTheRobotsOfTheProject) {
    const std::filesystem::path folder = HYBRID_SLAM_SOURCE_DIR "/config/robots";
    for (const char* name : {"forklift.yaml", "thesis.yaml"}) {
        const CameraFile file = read_camera_file(folder / name);
        const RobotConfig robot = read_robot(folder / name);
        EXPECT_EQ(file.model.fx, 731.318846);
        EXPECT_EQ(camera_yaml(file.model, file.mounting),
                  camera_yaml(robot.camera.model, robot.camera.mounting));
    }
}

TEST(CameraFile, SaysWhatAPartialFileLeavesOut) {
    const TempFolder folder;
    const CameraFile mounted =
        read_camera_file(folder.write("a.yaml", "camera:\n  mounting: {z: 0.8}\n  model:\n"));
    EXPECT_FALSE(mounted.has_model);
    EXPECT_TRUE(mounted.has_mounting);
    EXPECT_EQ(mounted.mounting.z, 0.8);
    EXPECT_EQ(mounted.mounting.x, CameraMounting().x);
    const CameraFile lidar = read_camera_file(folder.write("b.yaml", "lidar: {x: 1.0}\n"));
    EXPECT_FALSE(lidar.has_model || lidar.has_mounting);
    EXPECT_THAT(lidar.other_keys, ElementsAre("lidar"));
}

TEST(CameraFile, ReadsOpenCvs) {
    const TempFolder folder;
    const CameraFile file = read_camera_file(folder.write("left.yml", kOpenCv));
    EXPECT_EQ(file.format, CameraFormat::kOpenCv);
    EXPECT_TRUE(file.has_model);
    EXPECT_FALSE(file.has_mounting);
    EXPECT_EQ(file.model.width, 640);
    EXPECT_EQ(file.model.height, 480);
    EXPECT_EQ(file.model.fx, 535.91573396163199);
    EXPECT_EQ(file.model.fy, 535.91573396163199);
    EXPECT_EQ(file.model.cx, 342.28315473308373);
    EXPECT_EQ(file.model.cy, 235.57082909788173);
    EXPECT_EQ(file.model.k1, -0.26637260909660682);
    EXPECT_EQ(file.model.k2, -0.038588898922304653);
    EXPECT_EQ(file.model.p1, 0.0017831947042852964);
    EXPECT_EQ(file.model.p2, -0.00028122100441115472);
    EXPECT_EQ(file.model.k3, 0.23839153080878486);
}

TEST(CameraFile, ReadsOpenCvsOtherSpellings) {
    std::string text = with(kOpenCv, "camera_matrix", "Camera_Matrix");
    text = with(text, "distortion_coefficients", "Distortion_Coefficients");
    text = with(text, "2.3839153080878486e-01 ]", "0.25, 0, 0, 0 ]");
    text = with(text, "image_width", "image_Width");
    const TempFolder folder;
    const CameraFile file = read_camera_file(folder.write("left.yml", text));
    EXPECT_EQ(file.format, CameraFormat::kOpenCv);
    EXPECT_EQ(file.model.k3, 0.25);
    const CameraFile four = read_camera_file(
        folder.write("four.yml", with(kOpenCv, ",\n       2.3839153080878486e-01", "")));
    EXPECT_EQ(four.model.p2, -0.00028122100441115472);
    EXPECT_EQ(four.model.k3, 0.0);
}

TEST(CameraFile, ReadsRos) {
    const TempFolder folder;
    const CameraFile file = read_camera_file(folder.write("ost.yaml", kRos));
    EXPECT_EQ(file.format, CameraFormat::kRos);
    EXPECT_EQ(file.model.width, 1280);
    EXPECT_EQ(file.model.height, 720);
    EXPECT_EQ(file.model.fx, 900.5);
    EXPECT_EQ(file.model.fy, 901.5);
    EXPECT_EQ(file.model.cx, 640.25);
    EXPECT_EQ(file.model.cy, 360.75);
    EXPECT_EQ(file.model.k1, -0.1);
    EXPECT_EQ(file.model.k2, 0.02);
    EXPECT_EQ(file.model.p1, 0.003);
    EXPECT_EQ(file.model.p2, -0.004);
    EXPECT_EQ(file.model.k3, 0.5);
}

TEST(CameraFile, RefusesOtherDistortions) {
    EXPECT_EQ(refusal(with(kRos, "plumb_bob", "equidistant")),
              "camera.yaml:8: key 'distortion_model': must be plumb_bob (Brown's distortion), not "
              "'equidistant'");
    std::string rational = with(kRos, "plumb_bob", "rational_polynomial");
    rational = with(rational, "0.5]", "0.5, 0.1, 0, 0]");
    EXPECT_EQ(refusal(rational),
              "camera.yaml:9: key 'distortion_coefficients': has more coefficients than k1, k2, "
              "p1, p2, k3 (the rational model)");
    EXPECT_EQ(refusal(with(kOpenCv, "fisheye_model: 0", "fisheye_model: 1")),
              "camera.yaml:9: key 'fisheye_model': is a fisheye, which needs another distortion "
              "than Brown's");
    EXPECT_EQ(refusal(with(kRos, "[-0.1, 0.02, 0.003,", "[")),
              "camera.yaml:9: key 'distortion_coefficients': must hold 4 or 5 numbers (k1, k2, p1, "
              "p2, k3), not 2");
}

TEST(CameraFile, RefusesWhatIsMissingOrBroken) {
    EXPECT_EQ(refusal(with(kRos, "image_width: 1280\n", "")),
              "camera.yaml: key 'image_width': is missing");
    EXPECT_EQ(refusal(with(kRos, "1280", "many")),
              "camera.yaml:1: key 'image_width': must be a number, not 'many'");
    EXPECT_EQ(refusal(with(kRos, "1280", "12.5")),
              "camera.yaml:1: key 'image_width': must be a whole number of pixels, not '12.5'");
    EXPECT_EQ(refusal(with(kRos, "1280", "9999")),
              "camera.yaml: key 'width': must be a whole number from 16 to 8192, not '9999'");
    EXPECT_EQ(refusal(with(kRos, "[900.5, 0,", "[900.5, 3,")),
              "camera.yaml:4: key 'camera_matrix': must look like [fx, 0, cx, 0, fy, cy, 0, 0, 1]");
    EXPECT_EQ(refusal(with(kRos, "[900.5, 0,", "[900.5,")),
              "camera.yaml:4: key 'camera_matrix': must hold 9 numbers, not 8");
    EXPECT_EQ(refusal(with(kRos, "900.5", "wide")),
              "camera.yaml:4: key 'camera_matrix': must be a number, not 'wide'");
    EXPECT_EQ(refusal(with(kRos, "[900.5", "[-900.5")),
              "camera.yaml: key 'fx': must be a number from 1 to 100000, not '-900.5'");
    EXPECT_EQ(refusal("image_width: 640\nimage_height: 480\ncamera_matrix: 5\n"),
              "camera.yaml:3: key 'camera_matrix': needs a matrix with a list 'data'");
    EXPECT_EQ(refusal("<?xml version=\"1.0\"?>\n<opencv_storage/>\n"),
              "camera.yaml:1: is XML; let OpenCV write YAML");
    EXPECT_EQ(refusal(""), "camera.yaml: is empty");
    EXPECT_EQ(refusal("- 1\n"), "camera.yaml:1: must hold lines like 'key: value'");
    EXPECT_EQ(refusal("a: 1\n---\nb: 2\n"), "camera.yaml: holds more than one YAML document");
    EXPECT_THAT(refusal("camera: [1\n"), HasSubstr("camera.yaml:2: "));
    EXPECT_THAT(error_of([] { read_camera_file("nowhere.yaml"); }), HasSubstr("nowhere.yaml"));
}

TEST(CameraFile, RefusesKeysThatARobotFileDoesNotHave) {
    EXPECT_EQ(refusal("camera:\n  model:\n    fxx: 500\n"),
              "camera.yaml:3: key 'camera.model.fxx': unknown key; did you mean "
              "'camera.model.fx'?");
    EXPECT_EQ(refusal("camera:\n  modle: {fx: 500}\n"),
              "camera.yaml:2: key 'camera.modle': unknown key");
    EXPECT_EQ(refusal("camra:\n  model: {fx: 500}\n"), "camera.yaml:1: key 'camra': unknown key");
    EXPECT_EQ(refusal("camera:\n  model:\n    fx: -1\n"),
              "camera.yaml:3: key 'camera.model.fx': must be a number from 1 to 100000, not '-1'");
    EXPECT_EQ(refusal("camera:\n  model:\n    fx: [1]\n"),
              "camera.yaml:3: key 'camera.model.fx': needs a single value");
    EXPECT_EQ(refusal("camera:\n  model:\n    fx: 500\n    fx: 501\n"),
              "camera.yaml:4: key 'camera.model.fx': repeated");
    EXPECT_EQ(refusal("camera:\n  model: 5\n"),
              "camera.yaml:2: key 'camera.model': is a section and takes no value");
    EXPECT_EQ(refusal("camera: 5\n"),
              "camera.yaml:1: key 'camera': is a section and takes no value");
    EXPECT_EQ(refusal("camera: {}\ncamera: {}\n"), "camera.yaml:2: key 'camera': repeated");
    EXPECT_EQ(refusal("[a]: 5\n"), "camera.yaml:1: a key must be a plain word");
}

}  // namespace
}  // namespace hybrid_slam::test
