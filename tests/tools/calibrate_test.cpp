// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "frontend/calibration/board_rendering.hpp"
#include "hybrid_slam/calibration/camera_file.hpp"
#include "hybrid_slam/camera/image_codec.hpp"
#include "hybrid_slam/sensors/robot.hpp"
#include "running.hpp"
#include "support/shared_data.hpp"

namespace hybrid_slam::test {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

const Chessboard kBoard{7, 5, 0.03};

void write_image(const TempFolder& folder, const std::string& name, const Image& image) {
    const EncodedImage bytes = encode_pnm(image);
    folder.write(name, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});  // NOLINT
}

Image flat_image(int width, int height) {
    Image image;
    image.width = width;
    image.height = height;
    image.pixels.assign(static_cast<std::size_t>(width) * height, 128);
    return image;
}

/// Five boards, and four files that are of no use.
void write_boards(const TempFolder& folder) {
    std::filesystem::create_directory(folder / "boards");
    const BoardRenderer renderer(small_camera(), kBoard);
    const auto views = board_views(kBoard);
    for (std::size_t i = 0; i < 5; ++i) {
        write_image(folder, "boards/" + std::to_string(i) + ".pgm", renderer.render(views[i]));
    }
    write_image(folder, "boards/blurred.pgm", blurred(renderer.render(views[0]), 4));
    write_image(folder, "boards/empty.pgm", flat_image(400, 300));
    write_image(folder, "boards/large.pgm", flat_image(640, 480));
    folder.write("boards/torn.jpg", "no image");
    folder.write("boards/notes.txt", "not looked at");
}

TEST(CalibrateCamera, FindsTheCameraAndRefusesByName) {
    const TempFolder folder;
    write_boards(folder);
    const Outcome outcome = run_well(folder,
                                     "calibrate camera boards --board 7x5 --square 0.03 --out "
                                     "camera.yaml --picture fit.png --json");
    const Json json = outcome.json();
    EXPECT_EQ(json["photos"], 9);
    EXPECT_EQ(json["used"], 5);
    EXPECT_LT(json["rms_px"].get<double>(), 0.15);
    EXPECT_NEAR(json["model"]["fx"].get<double>(), small_camera().fx, 4.0);
    EXPECT_GT(json["deviations"]["fx"].get<double>(), 0.0);
    EXPECT_EQ(json["views"][0]["file"], "boards/0.pgm");
    EXPECT_GT(json["views"][0]["rms_px"].get<double>(), 0.0);
    EXPECT_EQ(json["views"][6]["refused"], "no board of 7 x 5 inner corners");
    EXPECT_EQ(json["views"][7]["refused"], "is 640 x 480, the others are 400 x 300");
    EXPECT_THAT(outcome.err, HasSubstr("boards/blurred.pgm: not used: blurred: edges are "));
    EXPECT_THAT(outcome.err, HasSubstr("boards/torn.jpg: not used: is no image"));
    EXPECT_THAT(bytes_of(folder / "fit.png"), StartsWith("\x89PNG"));
    const RobotConfig robot = read_robot(folder / "camera.yaml");
    EXPECT_EQ(robot.camera.model.fx, json["model"]["fx"].get<double>());
    EXPECT_EQ(robot.camera.model.width, 400);
    EXPECT_EQ(robot.camera.mounting.x, CameraMounting().x);
    EXPECT_THAT(bytes_of(folder / "camera.yaml"),
                StartsWith("# camera.model by 'hybrid-slam calibrate camera': 5 boards, error 0."));
}

TEST(CalibrateCamera, KeepsTheRestOfARobotFile) {
    const TempFolder folder;
    write_boards(folder);
    RobotConfig robot;
    robot.name = "truck 7";
    robot.lidar.baud = 115200;
    robot.camera.mounting.z = 0.8;
    folder.write("robot.yaml", to_yaml(robot));
    const Outcome outcome = run_well(
        folder,
        "calibrate camera boards/0.pgm boards/1.pgm boards/2.pgm boards/3.pgm --board 7x5 --square "
        "0.03 --no-k3 --same-focal-lengths --out robot.yaml");
    EXPECT_THAT(outcome.out, HasSubstr("4 of 4 photos used, 400 x 300 pixels; error 0."));
    const RobotConfig after = read_robot(folder / "robot.yaml");
    EXPECT_EQ(after.camera.model.fx, after.camera.model.fy);
    EXPECT_EQ(after.camera.model.k3, 0.0);
    EXPECT_EQ(after.camera.model.width, 400);
    robot.camera.model = after.camera.model;
    EXPECT_EQ(to_yaml(after), to_yaml(robot));
}

TEST(CalibrateCamera, RefusesBeforeTheWork) {
    const TempFolder folder;
    write_image(folder, "empty.pgm", flat_image(64, 48));
    folder.write("notes.yaml", "groceries: [milk]\n");
    folder.write("cv.yaml",
                 "image_width: 640\nimage_height: 480\ncamera_matrix: {data: [500, 0, 320, 0, 500, "
                 "240, 0, 0, 1]}\ndistortion_coefficients: {data: [0, 0, 0, 0]}\n");
    const std::string command = "calibrate camera empty.pgm --square 0.03 --board 7x5 --out ";
    const Outcome notes = run(folder, command + "notes.yaml");
    EXPECT_EQ(notes.code, 1);
    EXPECT_EQ(
        notes.err,
        "hybrid-slam: notes.yaml:1: key 'groceries': unknown key (so it is not replaced; name "
        "another --out)\n");
    EXPECT_EQ(bytes_of(folder / "notes.yaml"), "groceries: [milk]\n");
    EXPECT_THAT(run(folder, command + "cv.yaml").err,
                HasSubstr("cv.yaml: is a calibration of OpenCV or ROS, which is not replaced"));
    EXPECT_EQ(run(folder, command + "/dev/null").code, 1);
    const Outcome few = run(folder, command + "new.yaml");
    EXPECT_EQ(few.code, 1);
    EXPECT_THAT(few.err, HasSubstr("empty.pgm: not used: no board of 7 x 5 inner corners\n"));
    EXPECT_THAT(few.err, HasSubstr("hybrid-slam: 0 usable boards, at least 3 are needed\n"));
    EXPECT_FALSE(std::filesystem::exists(folder / "new.yaml"));
    EXPECT_EQ(run(folder, "calibrate camera empty.pgm --square 0.03 --board 7 --out x").code, 2);
    EXPECT_EQ(run(folder, "calibrate camera empty.pgm --board 7x5 --out x").code, 2);
    EXPECT_EQ(run(folder, "calibrate camera --board 7x5 --square 0.03 --out x").code, 2);
    EXPECT_EQ(run(folder, "calibrate").code, 2);
}

TEST(CalibrateCamera, TakesTheRealPhotos) {
    HYBRID_SLAM_SHARED_OR_SKIP(boards, "data/chessboard");
    const TempFolder folder;
    const Outcome outcome =
        run_well(folder, "calibrate camera '" + boards.string() +
                             "' --board 9x6 --square 0.025 --out c.yaml --json");
    const Json json = outcome.json();
    EXPECT_EQ(json["photos"], 14);
    EXPECT_GE(json["used"], 13);
    EXPECT_LE(json["rms_px"].get<double>(), 0.393);
    EXPECT_NEAR(json["model"]["fx"].get<double>(), 535.9157, 0.005 * 535.9157);
    EXPECT_NEAR(json["model"]["cy"].get<double>(), 235.5708, 0.005 * 235.5708);
}

/// A camera over a tile of 0.6 m whose middle lies 2.2 m ahead of the robot and 0.1 m to the left.
struct Floor {
    CameraModel model = small_camera();
    CameraMounting mounting;
    Pose2d robot_from_tile{2.7, 0.1, radians(4.0)};

    Floor() {
        mounting.x = 0.9;
        mounting.y = -0.15;
        mounting.z = 1.25;
        mounting.yaw = radians(2.0);
        mounting.pitch = radians(25.0);
        mounting.roll = radians(-1.5);
    }

    std::string corners() const {
        std::string text = "--corners";
        const Eigen::Isometry3d camera_from_robot = mounting.robot_from_camera().inverse();
        for (const Eigen::Vector2d& corner :
             {Eigen::Vector2d(-0.3, 0.3), Eigen::Vector2d(-0.3, -0.3), Eigen::Vector2d(0.3, -0.3),
              Eigen::Vector2d(0.3, 0.3)}) {
            const Eigen::Vector2d floor = robot_from_tile * corner;
            const Pixel pixel =
                *model.project(camera_from_robot * Eigen::Vector3d(floor.x(), floor.y(), 0.0));
            text += " " + std::to_string(pixel.x()) + "," + std::to_string(pixel.y());
        }
        return text;
    }

    void write(const TempFolder& folder) const {
        write_image(folder, "floor.pgm", flat_image(400, 300));
        folder.write("camera.yaml", camera_yaml(model, CameraMounting()));
    }
};

TEST(CalibrateGround, FindsHeightAndTilt) {
    const TempFolder folder;
    const Floor floor;
    floor.write(folder);
    const Json json =
        run_well(folder, "calibrate ground floor.pgm --camera camera.yaml --tile 0.6 " +
                             floor.corners() + " --out camera.yaml --picture floor.png --json")
            .json();
    EXPECT_NEAR(json["height_m"].get<double>(), 1.25, 1e-4);
    EXPECT_NEAR(json["pitch_deg"].get<double>(), 25.0, 1e-3);
    EXPECT_NEAR(json["roll_deg"].get<double>(), -1.5, 1e-3);
    EXPECT_LT(json["rms_px"].get<double>(), 1e-4);
    EXPECT_GT(json["per_pixel"]["height_m"].get<double>(), 0.001);
    EXPECT_THAT(bytes_of(folder / "floor.png"), StartsWith("\x89PNG"));
    const CameraFile after = read_camera_file(folder / "camera.yaml");
    EXPECT_NEAR(after.mounting.z, 1.25, 1e-4);
    EXPECT_NEAR(after.mounting.pitch, radians(25.0), 1e-5);
    EXPECT_EQ(after.mounting.x, CameraMounting().x);
    EXPECT_EQ(after.mounting.yaw, CameraMounting().yaw);
    EXPECT_EQ(after.model.fx, floor.model.fx);
}

TEST(CalibrateGround, FindsAllOfTheMountingWithTheTilesPose) {
    const TempFolder folder;
    const Floor floor;
    floor.write(folder);
    RobotConfig robot;
    robot.name = "truck 7";
    folder.write("robot.yaml", to_yaml(robot));
    const Outcome outcome =
        run_well(folder, "calibrate ground floor.pgm --camera camera.yaml --tile 0.6 " +
                             floor.corners() + " --tile-pose 2.7,0.1,4 --out robot.yaml");
    EXPECT_THAT(outcome.out,
                HasSubstr("height 1.250 m, pitch 25.00 deg down, roll -1.50 deg clockwise"));
    EXPECT_THAT(outcome.out, HasSubstr("x 0.900 m, y -0.150 m, yaw 2.00 deg to the left"));
    const RobotConfig after = read_robot(folder / "robot.yaml");
    EXPECT_EQ(after.name, "truck 7");
    EXPECT_EQ(after.camera.model.fx, floor.model.fx) << "the camera that was calibrated with";
    EXPECT_NEAR(after.camera.mounting.x, 0.9, 1e-4);
    EXPECT_NEAR(after.camera.mounting.y, -0.15, 1e-4);
    EXPECT_NEAR(after.camera.mounting.yaw, radians(2.0), 1e-5);
}

TEST(CalibrateGround, FindsABoardOnTheFloor) {
    const TempFolder folder;
    const Floor floor;
    const Chessboard board{7, 5, 0.12};
    floor.write(folder);
    Eigen::Isometry3d robot_from_board(Eigen::AngleAxisd(-0.5 * kPi, Eigen::Vector3d::UnitZ()) *
                                       Eigen::AngleAxisd(kPi, Eigen::Vector3d::UnitX()));
    robot_from_board.translation() = Eigen::Vector3d(2.9, 0.3, 0.0);
    write_image(folder, "board.pgm",
                BoardRenderer(floor.model, board)
                    .render(floor.mounting.robot_from_camera().inverse() * robot_from_board));
    const Json json = run_well(folder,
                               "calibrate ground board.pgm --camera camera.yaml --board 7x5 "
                               "--square 0.12 --out new.yaml --json")
                          .json();
    EXPECT_NEAR(json["height_m"].get<double>(), 1.25, 0.01);
    EXPECT_NEAR(json["pitch_deg"].get<double>(), 25.0, 0.3);
    EXPECT_EQ(json["corners"].size(), 35U);
    EXPECT_EQ(run(folder,
                  "calibrate ground floor.pgm --camera camera.yaml --board 7x5 --square "
                  "0.12 --out new.yaml")
                  .err,
              "hybrid-slam: floor.pgm: no board of 7 x 5 inner corners\n");
}

TEST(CalibrateGround, ReadsForeignCalibrations) {
    const TempFolder folder;
    const Floor floor;
    floor.write(folder);
    folder.write("ost.yaml", R"(image_width: 400
image_height: 300
camera_name: webcam
camera_matrix: {rows: 3, cols: 3, data: [380, 0, 204, 0, 372, 147, 0, 0, 1]}
distortion_model: plumb_bob
distortion_coefficients: {rows: 1, cols: 5, data: [-0.21, 0.06, 0.001, -0.0015, 0]}
)");
    run_well(folder, "calibrate ground floor.pgm --camera ost.yaml --tile 0.6 " + floor.corners() +
                         " --out new.yaml");
    const CameraFile after = read_camera_file(folder / "new.yaml");
    EXPECT_EQ(after.format, CameraFormat::kRobot);
    EXPECT_EQ(after.model.fx, 380.0);
    EXPECT_NEAR(after.mounting.z, 1.25, 1e-4);
}

TEST(CalibrateGround, TellsWhatIsWrong) {
    const TempFolder folder;
    const Floor floor;
    floor.write(folder);
    write_image(folder, "large.pgm", flat_image(640, 480));
    folder.write("mounting.yaml", "camera: {mounting: {z: 1.0}}\n");
    const auto complaint = [&](const std::string& arguments, int code) {
        const Outcome outcome = run(folder, "calibrate ground " + arguments + " --out new.yaml");
        EXPECT_EQ(outcome.code, code) << arguments;
        EXPECT_FALSE(std::filesystem::exists(folder / "new.yaml"));
        return outcome.err;
    };
    const std::string tile = " --camera camera.yaml --tile 0.6 ";
    EXPECT_EQ(
        complaint("large.pgm" + tile + floor.corners(), 1),
        "hybrid-slam: large.pgm: is 640 x 480 pixels, but camera.yaml is of a camera with 400 "
        "x 300\n");
    EXPECT_EQ(complaint("floor.pgm --camera mounting.yaml --tile 0.6 " + floor.corners(), 1),
              "hybrid-slam: mounting.yaml: key 'camera.model': is missing\n");
    EXPECT_THAT(complaint("floor.pgm" + tile + "--corners 10,290 200,290 390,290 200,200", 1),
                HasSubstr("the four corners do not look like a tile"));
    EXPECT_THAT(complaint("floor.pgm" + tile + "--corners 10,290 130,290 260,290 390,290", 1),
                HasSubstr("the four corners do not look like a tile"));
    EXPECT_THAT(complaint("floor.pgm" + tile + "--corners 10,290 390,200 380,20 200,10", 1),
                HasSubstr("hybrid-slam: floor.pgm: the corners are "));
    EXPECT_THAT(complaint("floor.pgm --camera camera.yaml --tile 60 " + floor.corners(), 1),
                HasSubstr("floor.pgm: the camera would be 125.00 m high, 25.0 deg down"));
    EXPECT_THAT(complaint("camera.yaml" + tile + floor.corners(), 1),
                HasSubstr("camera.yaml: is no image"));
    EXPECT_THAT(complaint("floor.pgm" + tile + "--corners 1,2 3,4 5,6", 2), HasSubstr("--corners"));
    EXPECT_THAT(complaint("floor.pgm" + tile + "--corners 1,2 3,4 5,6 7", 2),
                HasSubstr("--corners: must look like u,v, not '7'"));
    EXPECT_THAT(complaint("floor.pgm" + tile + floor.corners() + " --tile-pose 1,2", 2),
                HasSubstr("--tile-pose: must look like x,y,yaw, not '1,2'"));
    EXPECT_THAT(complaint("floor.pgm --camera camera.yaml", 2),
                HasSubstr("either --tile or --board"));
    EXPECT_THAT(complaint("floor.pgm --camera camera.yaml --board 7x5", 2), HasSubstr("--square"));
}

TEST(CalibrateGround, RefusesACameraThatIsTiltedTooFar) {
    const TempFolder folder;
    Floor floor;
    floor.mounting.roll = radians(50.0);
    floor.write(folder);
    const Outcome outcome =
        run(folder, "calibrate ground floor.pgm --camera camera.yaml --tile 0.6 " +
                        floor.corners() + " --out new.yaml --picture p.png");
    EXPECT_EQ(outcome.code, 1);
    EXPECT_THAT(outcome.err, HasSubstr("25.0 deg down and 50.0 deg clockwise"));
    EXPECT_FALSE(std::filesystem::exists(folder / "new.yaml"));
    EXPECT_FALSE(std::filesystem::exists(folder / "p.png"));
}

TEST(CalibrateGround, ThePictureReplacesNothingElse) {
    const TempFolder folder;
    const Floor floor;
    floor.write(folder);
    const std::string before = bytes_of(folder / "floor.pgm");
    const std::string ground = "calibrate ground floor.pgm --camera camera.yaml --tile 0.6 " +
                               floor.corners() + " --out new.yaml --picture ";
    const Outcome photo = run(folder, ground + "./floor.pgm");
    EXPECT_EQ(photo.code, 2);
    EXPECT_THAT(photo.err, HasSubstr("--picture: floor.pgm is one of the photos"));
    EXPECT_THAT(photo.err, HasSubstr("(see 'hybrid-slam calibrate ground --help')"));
    EXPECT_EQ(bytes_of(folder / "floor.pgm"), before);
    EXPECT_THAT(run(folder, ground + "./new.yaml").err, HasSubstr("is the same file as --out"));
    EXPECT_THAT(run(folder, ground + "camera.yaml").err,
                HasSubstr("camera.yaml is there and no PNG, so it is not replaced"));
    EXPECT_FALSE(std::filesystem::exists(folder / "new.yaml"));
    run_well(folder, ground + "floor.png");
    run_well(folder, ground + "floor.png");
    const Outcome inside = run(folder,
                               "calibrate camera . --board 7x5 --square 0.03 --out c.yaml "
                               "--picture floor.png");
    EXPECT_EQ(inside.code, 2);
    EXPECT_THAT(inside.err, HasSubstr("floor.png is one of the photos"));
}

TEST(CalibrateGround, RefusesATilePoseThatCouldMeanTwoThings) {
    const TempFolder folder;
    Floor floor;
    floor.robot_from_tile.heading = radians(46.0);
    floor.write(folder);
    const std::string command =
        "calibrate ground floor.pgm --camera camera.yaml --tile 0.6 " + floor.corners();
    const Outcome outcome = run(folder, command + " --tile-pose 2.7,0.1,46 --out new.yaml");
    EXPECT_EQ(outcome.code, 1);
    EXPECT_THAT(outcome.err, HasSubstr("the tile lies cornerwise before the camera"));
    run_well(folder, command + " --out new.yaml");
}

TEST(CalibrateGround, SaysHowToDoWithoutADisplay) {
    const TempFolder folder;
    Floor().write(folder);
    ::unsetenv("DISPLAY");
    ::unsetenv("WAYLAND_DISPLAY");
    ::unsetenv("QT_QPA_PLATFORM");
    const Outcome outcome =
        run(folder, "calibrate ground floor.pgm --camera camera.yaml --tile 0.6 --out new.yaml");
    EXPECT_EQ(outcome.code, 1);
    EXPECT_EQ(outcome.err,
              "hybrid-slam: no window to click corners in (there is no display): give them as "
              "--corners u,v u,v u,v u,v\n");
}

}  // namespace
}  // namespace hybrid_slam::test
