// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "child.hpp"
#include "hybrid_slam/link/link_server.hpp"
#include "running.hpp"

namespace hybrid_slam::test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

/// With the map of the room, for those who need one.
class Navigating : public ::testing::Test {
  protected:
    void make_map() const {
        simulate_room(folder_);
        run_well(folder_, "map room.clf --out hall --quiet");
    }

    Outcome fails(const std::string& arguments, int code) const {
        Outcome outcome = run(folder_, arguments);
        EXPECT_EQ(outcome.code, code) << arguments << "\n" << outcome.err;
        EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << arguments << "\n"
                                                                               << outcome.err;
        return outcome;
    }

    TempFolder folder_;
};

TEST_F(Navigating, DriveSaysWhyItCannotBegin) {
    make_map();
    EXPECT_THAT(fails("drive --map nowhere --can candump:log -q", 1).err, HasSubstr("nowhere"));
    EXPECT_THAT(fails("drive --can candump:log", 2).err, HasSubstr("--map"));
    EXPECT_THAT(fails("drive --map hall --listen nonsense", 2).err, HasSubstr("--listen"));
    EXPECT_THAT(
        fails("drive --map hall --can candump:log --set pilot.posevalid=1 --listen :0 -q", 1).err,
        HasSubstr("pilot.posevalid"));
    EXPECT_THAT(fails("drive --map hall --can candump:nowhere/log --listen :0 -q", 1).err,
                HasSubstr("nowhere/log"));
    EXPECT_THAT(fails("drive --map hall --can slcan:nowhere --listen :0 -q", 1).err,
                HasSubstr("nowhere"));
    folder_.write("r.yaml", "can: {nodes: 3}\n");
    EXPECT_THAT(fails("drive --map hall --vehicle r.yaml --listen :0 -q", 1).err,
                AllOf(HasSubstr("r.yaml:1"), HasSubstr("can.nodes")));
    folder_.write("other/file.txt", "mine");
    EXPECT_THAT(fails("drive --map hall --can candump:log --listen :0 --out other -q", 1).err,
                HasSubstr("left alone"));
    EXPECT_EQ(bytes_of(folder_ / "other/file.txt"), "mine");
}

/// Whether or not the kernel knows CAN, there is no bus of that name here.
TEST_F(Navigating, ABusThatIsNotThereNamesTheAlternatives) {
    make_map();
    EXPECT_THAT(fails("drive --map hall --can can77 --listen :0 -q", 1).err, HasSubstr("can77"));
}

TEST_F(Navigating, TwoDrivesDoNotShareAPort) {
    make_map();
    LinkServerConfig config;
    config.listen = ":0";
    const LinkServer other(config);
    const std::string port = std::to_string(other.endpoint().port);
    EXPECT_THAT(fails("drive --map hall --can candump:log --listen :" + port + " -q", 1).err,
                HasSubstr(port));
}

TEST_F(Navigating, WarnsWhenEverybodyMayDrive) {
    make_map();
    const Child drive(folder_, "drive --map hall --can candump:log --listen 0.0.0.0:0");
    drive.wait_until_it_catches_signals();
    for (int i = 0;
         i < 500 && bytes_of(folder_ / "stderr.txt").find("listening") == std::string::npos; ++i) {
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    drive.send(SIGTERM);
    EXPECT_EQ(WEXITSTATUS(drive.wait()), 0);
    EXPECT_THAT(bytes_of(folder_ / "stderr.txt"), HasSubstr("no token"));
}

TEST_F(Navigating, GotoChecksWhatItIsTold) {
    for (const char* place : {"1", "1,2,3,4", "a,b", "1,", "nan,1", "1,2,"}) {
        EXPECT_THAT(fails(std::string("goto :5000 ") + place, 2).err, HasSubstr("must be X,Y"))
            << place;
    }
    EXPECT_THAT(fails("goto truck 1,2", 2).err, HasSubstr("truck"));
    EXPECT_THAT(fails("goto :5000 --here 1,2", 2).err, HasSubstr("--here"));
    EXPECT_THAT(fails("goto :5000 --append", 2).err, HasSubstr("--append"));
}

TEST_F(Navigating, GotoSaysThatNobodyAnswers) {
    EXPECT_THAT(fails("goto 127.0.0.1:1 1,2 --timeout 0.5", 1).err, HasSubstr("127.0.0.1:1"));
}

TEST_F(Navigating, GotoSaysThatItWasTurnedAway) {
    LinkServerConfig config;
    config.listen = ":0";
    config.token = "secret";
    const LinkServer server(config);
    const std::string address = ":" + std::to_string(server.endpoint().port);
    EXPECT_THAT(fails("goto " + address + " 1,2 --token wrong", 1).err, HasSubstr("wrong token"));
}

TEST_F(Navigating, LocalizePublishesOnlyWhatIsLive) {
    make_map();
    EXPECT_THAT(fails("localize hall room.clf --out run --publish tcp://127.0.0.1:5000", 2).err,
                HasSubstr("--live"));
    EXPECT_THAT(fails("localize hall --live --publish nonsense", 2).err, HasSubstr("--publish"));
    EXPECT_THAT(fails("localize hall --live", 2).err, HasSubstr("--out"));
}

}  // namespace
}  // namespace hybrid_slam::test
