// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "drives.hpp"
#include "running.hpp"

namespace hybrid_slam::test {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

/// Straight on for two metres, before a camera that sees nothing.
void record_useless_drive(const TempFolder& folder) {
    RobotConfig robot;
    robot.camera.model.width = 320;
    robot.camera.model.height = 240;
    Image image;
    image.width = robot.camera.model.width;
    image.height = robot.camera.model.height;
    image.pixels.assign(320U * 240U, 100);
    const EncodedImage fog = encode_jpeg(image, 80);
    RecordingOptions options;
    options.origin = "simulated";
    RecordingWriter writer(folder / "drive", robot, options);
    for (const LidarBytes& telegram : telegrams_of({})) {
        writer.push(telegram);
        writer.push(CameraFrame{telegram.arrival + 0.01, fog});
    }
    writer.close();
}

TEST(CalibrateExtrinsics, RefusesADriveThatDoesNotTell) {
    const TempFolder folder;
    record_useless_drive(folder);
    const Outcome outcome = run(folder, "calibrate extrinsics drive/ --out robot.yaml");
    EXPECT_EQ(outcome.code, 4);
    EXPECT_THAT(outcome.err, AllOf(HasSubstr("this drive does not tell where the sensors sit"),
                                   HasSubstr("m driven, 4.0 m are needed"),
                                   HasSubstr("only 0 deg turned, 180 deg are needed")));
    EXPECT_THAT(outcome.err, Not(HasSubstr("the camera sees ways")));
    EXPECT_THAT(outcome.out, HasSubstr("drive      2.0 m, turned 0 deg to the left"));
    EXPECT_FALSE(std::filesystem::exists(folder / "robot.yaml"));
}

TEST(CalibrateExtrinsics, JsonSaysWhatIsMissing) {
    const TempFolder folder;
    record_useless_drive(folder);
    const Outcome outcome = run(folder, "calibrate extrinsics drive --out robot.yaml --json -q");
    EXPECT_EQ(outcome.code, 4);
    const Json json = outcome.json();
    EXPECT_EQ(json["fit"], false);
    EXPECT_EQ(json["out"], "");
    EXPECT_EQ(json["scans"], 50);
    EXPECT_EQ(json["images"], 50);
    EXPECT_NEAR(json["distance_m"], 1.96, 0.05);
    EXPECT_THAT(json["missing"].get<std::vector<std::string>>(),
                Contains(HasSubstr("the turn rate hardly changes")));
    EXPECT_EQ(json["parameters"]["lidar.x"]["before"], 1.3);
    EXPECT_EQ(json["parameters"]["camera.latency"]["unit"], "s");
}

TEST(CalibrateExtrinsics, NeedsACamera) {
    const TempFolder folder;
    record_drive(folder / "drive", {});
    const Outcome off = run(folder, "calibrate extrinsics drive --out robot.yaml");
    EXPECT_EQ(off.code, 1);
    EXPECT_THAT(off.err, HasSubstr("camera.enabled is false"));
    folder.write("camera.yaml", "camera: {model: {width: 64, height: 48}}\n");
    const Outcome none =
        run(folder, "calibrate extrinsics drive --robot camera.yaml --out robot.yaml");
    EXPECT_EQ(none.code, 4);
    EXPECT_THAT(none.err, HasSubstr("no images"));
}

TEST(CalibrateExtrinsics, ReplacesARobotFileAlone) {
    const TempFolder folder;
    record_useless_drive(folder);
    folder.write("notes.yaml", "icp: {max_iterations: 20}\n");
    const Outcome outcome = run(folder, "calibrate extrinsics drive --out notes.yaml");
    EXPECT_EQ(outcome.code, 1);
    EXPECT_THAT(outcome.err, AllOf(HasSubstr("notes.yaml: is there and no robot's file"),
                                   HasSubstr("unknown key")));
    EXPECT_EQ(bytes_of(folder / "notes.yaml"), "icp: {max_iterations: 20}\n");
    EXPECT_EQ(run(folder, "calibrate extrinsics drive --out drive").code, 1);
    folder.write("truck.yaml", "name: truck 4\n");  // a refused drive leaves it as it is
    EXPECT_EQ(run(folder, "calibrate extrinsics drive --out truck.yaml").code, 4);
    EXPECT_EQ(bytes_of(folder / "truck.yaml"), "name: truck 4\n");
}

TEST(CalibrateExtrinsics, WrongUse) {
    const TempFolder folder;
    EXPECT_EQ(run(folder, "calibrate extrinsics drive").code, 2);
    const Outcome none = run(folder, "calibrate extrinsics drive --out robot.yaml");
    EXPECT_EQ(none.code, 1);
    EXPECT_THAT(none.err, HasSubstr("drive: is no recording"));
    record_useless_drive(folder);
    const Outcome key = run(folder, "calibrate extrinsics drive --out a.yaml --set vo.feature=1");
    EXPECT_EQ(key.code, 1);
    EXPECT_THAT(key.err, HasSubstr("vo.feature"));
    EXPECT_THAT(run_well(folder, "calibrate extrinsics --help").out, HasSubstr("figures of eight"));
}

}  // namespace
}  // namespace hybrid_slam::test
