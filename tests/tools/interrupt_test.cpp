// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <gmock/gmock.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <fstream>

#include "hybrid_slam/backend/map_folder.hpp"
#include "running.hpp"

namespace hybrid_slam::test {
namespace {

using ::testing::HasSubstr;

/// A log of which the program gets as much as the test wants, through a pipe with a name.
class FedLog {
  public:
    explicit FedLog(const TempFolder& folder) : folder_(folder), pipe_(folder / "fed.clf") {
        write_room(folder);
        run_well(folder, "simulate room.yaml --out room.clf --set scan_rate=20 --quiet");
        log_ = bytes_of(folder / "room.clf");
        EXPECT_GT(log_.size(), std::size_t{600000});  // more than readers take at once
        EXPECT_EQ(mkfifo(pipe_.c_str(), 0600), 0);
    }

    void start_program(const std::string& arguments) {
        child_ = fork();
        if (child_ == 0) {
            const std::string command =
                "exec '" HYBRID_SLAM_PROGRAM "' " + arguments + " > stdout.txt 2> stderr.txt";
            if (chdir(folder_.path().c_str()) == 0) {
                execl("/bin/sh", "sh", "-c", command.c_str(), nullptr);
            }
            _exit(127);
        }
        stream_.open(pipe_, std::ios::binary);  // waits until the program reads
    }

    void feed(std::size_t end) {
        stream_.write(log_.data() + fed_, static_cast<std::streamsize>(end - fed_));
        stream_.flush();
        fed_ = end;
    }

    void send(int signal) const { kill(child_, signal); }

    /// The status as waitpid has it.
    int wait() {
        stream_.close();
        int status = 0;
        waitpid(child_, &status, 0);
        return status;
    }

    std::size_t size() const { return log_.size(); }

  private:
    const TempFolder& folder_;
    std::filesystem::path pipe_;
    std::string log_;
    std::ofstream stream_;
    pid_t child_ = -1;
    std::size_t fed_ = 0;
};

class Interrupt : public ::testing::TestWithParam<int> {};

TEST_P(Interrupt, SavesTheMapOfTheScansSoFar) {
    const TempFolder folder;
    FedLog log(folder);
    log.start_program("map fed.clf --out room");
    log.feed(log.size() - 70000);
    log.send(GetParam());
    log.feed(log.size());
    const int status = log.wait();
    ASSERT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), 3) << bytes_of(folder / "stderr.txt");
    EXPECT_THAT(bytes_of(folder / "stderr.txt"), HasSubstr("interrupted"));
    const Json summary = Json::parse(bytes_of(folder / "room/summary.json"));
    EXPECT_EQ(summary["interrupted"], true);
    const std::size_t whole = read_tum(folder / "room.truth.tum").size();
    const StoredMap map = read_map(folder / "room");
    EXPECT_EQ(map.trajectory.size(), summary["scans"].get<std::size_t>());
    EXPECT_GT(map.trajectory.size(), 0U);
    EXPECT_LT(map.trajectory.size(), whole);
}

INSTANTIATE_TEST_SUITE_P(, Interrupt, ::testing::Values(SIGINT, SIGTERM));

TEST(InterruptTwice, AbortsAtOnce) {
    const TempFolder folder;
    FedLog log(folder);
    log.start_program("map fed.clf --out room");
    // Blocked in the middle of the log, it cannot see the first signal.
    log.feed(1000);
    log.send(SIGINT);
    // Signals of one kind that wait are one; another kind is the second for sure.
    log.send(SIGTERM);
    const int status = log.wait();
    ASSERT_TRUE(WIFSIGNALED(status)) << bytes_of(folder / "stderr.txt");
    EXPECT_FALSE(std::filesystem::exists(folder / "room"));
}

TEST(InterruptCompare, SaysSoAndWritesNoPartOfATable) {
    const TempFolder folder;
    FedLog log(folder);
    log.start_program("compare fed.clf --truth room.truth.tum --out there");
    log.feed(log.size() - 70000);
    log.send(SIGINT);
    log.feed(log.size());
    EXPECT_EQ(WEXITSTATUS(log.wait()), 3);
    EXPECT_FALSE(std::filesystem::exists(folder / "there/compare.json"));
}

}  // namespace
}  // namespace hybrid_slam::test
