// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <functional>
#include <future>
#include <thread>

#include "hybrid_slam/core/error.hpp"
#include "hybrid_slam/recording/recording.hpp"
#include "recording_support.hpp"
#include "support/error_of.hpp"
#include "support/temp_folder.hpp"

namespace hybrid_slam::test {
namespace {

using ::testing::HasSubstr;

/// Runs the call in a process of its own in which no file may grow beyond so many bytes; whatever
/// it prints comes back. A full disk that needs no disk.
std::string with_files_up_to(std::size_t most, const std::function<std::string()>& call) {
    int ends[2] = {};
    EXPECT_EQ(::pipe(ends), 0);
    const pid_t child = ::fork();
    if (child == 0) {
        std::signal(SIGXFSZ, SIG_IGN);
        const rlimit limit{most, most};
        ::setrlimit(RLIMIT_FSIZE, &limit);
        std::string text;
        try {
            text = call();
        } catch (const std::exception& error) {
            text = std::string("threw ") + error.what();
        }
        const ssize_t written = ::write(ends[1], text.data(), text.size());
        ::_exit(written == static_cast<ssize_t>(text.size()) ? 0 : 1);
    }
    ::close(ends[1]);
    std::string text(4096, ' ');
    const ssize_t count = ::read(ends[0], text.data(), text.size());
    text.resize(count > 0 ? static_cast<std::size_t>(count) : 0);
    ::close(ends[0]);
    int status = 0;
    ::waitpid(child, &status, 0);
    EXPECT_EQ(status, 0);
    return text;
}

template <typename Condition>
void wait_until(Condition condition) {
    for (int i = 0; i < 20'000 && !condition(); ++i) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    EXPECT_TRUE(condition());
}

/// Holds up who comes, until it is opened.
class Gate {
  public:
    void pass() {
        reached_ = true;
        opened_.wait();
    }
    void wait_until_reached() {
        wait_until([this] { return reached_.load(); });
    }
    void open() { opening_.set_value(); }

  private:
    std::atomic<bool> reached_{false};
    std::promise<void> opening_;
    std::shared_future<void> opened_ = opening_.get_future().share();
};

/// Of a disk that syncs often and treats the images in its own way.
RecordingOptions syncing_images(const std::function<void()>& before_sync) {
    RecordingOptions options;
    options.sync_every = 0.01;
    options.before_sync = [before_sync](const std::filesystem::path& file) {
        if (file.filename() == RecordingFiles::kCamera) {
            before_sync();
        }
    };
    return options;
}

TEST(RecordingDisk, WholeRecordsOnlyOnAFullDisk) {
    const TempFolder folder;
    const std::string said = with_files_up_to(10'000, [&] {
        RecordFileWriter writer(folder / "a.rec");
        const Bytes large = noise_bytes(1, 4000);
        std::string errors;
        for (int i = 0; i < 5; ++i) {
            try {
                writer.append(i, large.data(), i < 4 ? large.size() : 10);
            } catch (const Error& error) {
                errors += std::string(error.what()) + "\n";
            }
        }
        return errors;
    });
    EXPECT_THAT(said, HasSubstr("a.rec: File too large\n"));
    RecordFileReader reader(folder / "a.rec");
    const std::vector<Record> records = read_records(reader);
    ASSERT_EQ(records.size(), 3U);  // two, and the small one that found room again
    EXPECT_EQ(records[1].arrival, 1.0);
    EXPECT_EQ(records[2].arrival, 4.0);
    EXPECT_EQ(reader.damaged_bytes() + reader.torn_bytes(), 0U);
}

TEST(RecordingDisk, ImagesThatDoNotFitAreDroppedAndScansGoOn) {
    const TempFolder folder;
    const std::string said = with_files_up_to(200'000, [&] {
        RecordingOptions options;
        options.queue_bytes = 1U << 30U;
        RecordingWriter writer(folder / "a", {}, options);
        for (std::uint64_t i = 0; i < 30; ++i) {
            writer.push(image_event(i));
            writer.push(lidar_event(i));
        }
        writer.close();
        const RecordingCounts counts = writer.counts();
        return std::to_string(counts.images + counts.dropped_images) + " images, " +
               std::to_string(counts.dropped_by_slowness) + " by slowness, " +
               std::to_string(counts.lidar_chunks) + " chunks; " + writer.image_trouble();
    });
    EXPECT_THAT(said, HasSubstr("30 images, 0 by slowness, 30 chunks; "));
    EXPECT_THAT(said, HasSubstr("camera.rec: File too large"));
    RecordingReader reader(folder / "a");
    const std::size_t events = read_all(reader).size();
    EXPECT_TRUE(reader.manifest().closed);
    EXPECT_EQ(events, 30 + reader.manifest().counts->images);
    EXPECT_GT(reader.manifest().counts->images, 3U);
    EXPECT_GT(reader.manifest().counts->dropped_images, 20U);
}

TEST(RecordingDisk, LidarThatCannotBeWrittenIsAnError) {
    const TempFolder folder;
    const std::string said = with_files_up_to(20'000, [&] {
        RecordingWriter writer(folder / "a", {}, {});
        std::string text;
        for (std::uint64_t i = 0; text.empty(); ++i) {
            try {
                writer.push(lidar_event(i));
            } catch (const Error& error) {
                text = error.what();
            }
        }
        return text + "\n" + error_of([&] { writer.push(lidar_event(0)); }) + "\n" +
               error_of([&] { writer.close(); });
    });
    const std::string error = (folder / "a/lidar.rec").string() + ": File too large";
    EXPECT_EQ(said, error + "\n" + error + "\n" + error);
    RecordingReader reader(folder / "a");
    const std::vector<SensorEvent> events = read_all(reader);
    EXPECT_GT(events.size(), 20U);
    for (std::size_t i = 0; i < events.size(); ++i) {
        EXPECT_TRUE(same(events[i], lidar_event(i)));
    }
    EXPECT_EQ(reader.damaged_bytes() + reader.torn_bytes(), 0U);
    EXPECT_FALSE(reader.manifest().closed);
}

TEST(RecordingDisk, ImagesOfASimulationAreWorthAnError) {
    const TempFolder folder;
    const std::string said = with_files_up_to(100'000, [&] {
        RecordingOptions options;
        options.origin = "simulated";
        RecordingWriter writer(folder / "a", {}, options);
        for (std::uint64_t i = 0; i < 1000; ++i) {
            writer.push(image_event(i));
        }
        return std::string("nothing");
    });
    EXPECT_THAT(said, HasSubstr("threw "));
    EXPECT_THAT(said, HasSubstr("a/camera.rec: File too large"));
}

TEST(RecordingDisk, FailedBeginningLeavesNothingBehind) {
    const TempFolder folder;
    RobotConfig robot;
    robot.name = std::string(2000, 'x');
    const std::string said = with_files_up_to(1000, [&] {
        RecordingWriter writer(folder / "b/a", robot, {});
        return std::string("nothing");
    });
    EXPECT_EQ(said, "threw " + (folder / "b/a/robot.yaml").string() + ": File too large");
    EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(RecordingDisk, NearlyFullDiskIsKeptForTheLidar) {
    const TempFolder folder;
    std::atomic<double> free{1e6};
    RecordingOptions options;
    options.keep_free = 1e5;
    options.free_space = [&](const std::filesystem::path&) { return free.load(); };
    RecordingWriter writer(folder / "a", {}, options);
    writer.push(image_event(0));
    wait_until([&] { return writer.counts().images == 1; });
    EXPECT_EQ(writer.image_trouble(), "");
    free = 1.1e5;
    writer.push(image_event(1));
    writer.push(lidar_event(1));
    wait_until([&] { return writer.counts().dropped_images == 1; });
    EXPECT_THAT(writer.image_trouble(), HasSubstr("nearly full"));
    free = 1e6;  // somebody made room
    writer.push(image_event(2));
    wait_until([&] { return writer.image_trouble().empty(); });
    writer.close();
    EXPECT_EQ(writer.counts().images, 2U);
    EXPECT_EQ(writer.counts().lidar_chunks, 1U);
    EXPECT_EQ(writer.counts().dropped_by_slowness, 0U);
}

TEST(RecordingDisk, SlowDiskDropsImagesBeforeScans) {
    const TempFolder folder;
    Gate gate;
    RecordingOptions options;
    options.queue_bytes = 100'000;
    options.free_space = [&](const std::filesystem::path&) {
        gate.pass();
        return 1e15;
    };
    RecordingWriter writer(folder / "a", {}, options);
    writer.push(image_event(0));
    gate.wait_until_reached();
    for (std::uint64_t i = 1; i < 20; ++i) {
        writer.push(image_event(i));
        writer.push(lidar_event(i));
    }
    const std::uint64_t dropped = writer.counts().dropped_images;
    EXPECT_EQ(dropped, 17U);  // three images of 30 to 37 kB fit
    EXPECT_EQ(writer.counts().dropped_by_slowness, dropped);
    EXPECT_THAT(writer.image_trouble(), HasSubstr("too slow"));
    gate.open();
    writer.close();
    EXPECT_EQ(writer.counts().images, 3U);
    EXPECT_EQ(writer.counts().lidar_chunks, 19U);
    EXPECT_EQ(writer.counts().dropped_images, dropped);
    EXPECT_EQ(writer.image_trouble(), "");
}

// What a power cut would take while the images' sync hangs: images, but no scans.
TEST(RecordingDisk, ScansAreSyncedWhileTheDiskIsBusyWithImages) {
    const TempFolder folder;
    Gate gate;
    RecordingWriter writer(folder / "a", {}, syncing_images([&] { gate.pass(); }));
    writer.push(image_event(0));
    gate.wait_until_reached();
    for (std::uint64_t i = 0; i < 5; ++i) {
        writer.push(lidar_event(i));
        wait_until([&] { return writer.synced_counts().lidar_chunks == i + 1; });
    }
    EXPECT_EQ(writer.synced_counts().images, 0U);
    gate.open();
    writer.close();
    EXPECT_EQ(writer.synced_counts().images, 1U);
}

TEST(RecordingDisk, ImagesTakeRoomUntilTheyAreOnTheDisk) {
    const TempFolder folder;
    Gate gate;
    RecordingOptions options = syncing_images([&] { gate.pass(); });
    options.queue_bytes = 100'000;
    RecordingWriter writer(folder / "a", {}, options);
    writer.push(image_event(0));
    gate.wait_until_reached();
    EXPECT_EQ(writer.counts().images, 1U);  // the system has taken it
    for (std::uint64_t i = 1; i < 20; ++i) {
        writer.push(image_event(i));
    }
    EXPECT_EQ(writer.counts().dropped_by_slowness, 17U);
    gate.open();
    wait_until([&] { return writer.synced_counts().images == 3; });
    writer.push(image_event(20));
    writer.close();
    EXPECT_EQ(writer.counts().images, 4U);
    EXPECT_EQ(writer.image_trouble(), "");
}

TEST(RecordingDisk, ImagesWhoseSyncFailedAreNeverCalledSynced) {
    const TempFolder folder;
    std::atomic<int> syncs{0};
    RecordingWriter writer(folder / "a", {}, syncing_images([&] {
                               if (++syncs == 2) {  // and never again
                                   throw Error("camera.rec: Input/output error");
                               }
                           }));
    writer.push(image_event(0));
    wait_until([&] { return writer.synced_counts().images == 1; });
    writer.push(image_event(1));
    wait_until([&] { return !writer.image_trouble().empty(); });
    for (std::uint64_t i = 2; i < 5; ++i) {
        writer.push(image_event(i));
        writer.push(lidar_event(i));
    }
    writer.close();
    EXPECT_EQ(syncs, 2);
    EXPECT_EQ(writer.counts().images, 2U);
    EXPECT_EQ(writer.synced_counts().images, 1U);
    EXPECT_EQ(writer.counts().dropped_images, 3U);
    EXPECT_EQ(writer.counts().dropped_by_slowness, 0U);
    EXPECT_EQ(writer.synced_counts().lidar_chunks, 3U);
    EXPECT_THAT(writer.image_trouble(), HasSubstr("Input/output error; its end may be lost"));
}

TEST(RecordingDisk, LidarWhoseSyncFailedIsAnError) {
    const TempFolder folder;
    RecordingOptions options;
    options.before_sync = [](const std::filesystem::path& file) {
        throw Error(file.filename().string() + ": Input/output error");
    };
    RecordingWriter writer(folder / "a", {}, options);
    writer.push(lidar_event(0));
    EXPECT_THAT(error_of([&] { writer.close(); }), HasSubstr("lidar.rec: Input/output error"));
    EXPECT_EQ(writer.counts().lidar_chunks, 1U);
    EXPECT_EQ(writer.synced_counts().lidar_chunks, 0U);
    EXPECT_THAT(error_of([&] { writer.push(image_event(0)); }), HasSubstr("lidar.rec"));
}

TEST(RecordingDisk, SimulationWaitsForASlowDisk) {
    const TempFolder folder;
    RecordingOptions options;
    options.origin = "simulated";
    options.queue_bytes = 1;
    RecordingWriter writer(folder / "a", {}, options);
    for (std::uint64_t i = 0; i < 200; ++i) {
        writer.push(image_event(i));
    }
    writer.close();
    EXPECT_EQ(writer.counts().images, 200U);
    EXPECT_EQ(writer.counts().dropped_images, 0U);
}

TEST(RecordingDisk, SyncsWhileNothingElseHappens) {
    const TempFolder folder;
    RecordingOptions options;
    options.sync_every = 0.01;
    RecordingWriter writer(folder / "a", {}, options);
    writer.push(lidar_event(0));
    writer.push(image_event(0));
    wait_until([&] {
        return writer.synced_counts().lidar_chunks == 1 && writer.synced_counts().images == 1;
    });
}

TEST(RecordingDisk, SimulationSyncsAtTheEndOnly) {
    const TempFolder folder;
    RecordingOptions options;
    options.origin = "simulated";
    RecordingWriter writer(folder / "a", {}, options);
    writer.push(lidar_event(0));
    wait_until([&] { return writer.counts().lidar_chunks == 1; });
    EXPECT_EQ(writer.synced_counts().lidar_chunks, 0U);
    writer.close();
    EXPECT_EQ(writer.synced_counts().lidar_chunks, 1U);
}

TEST(RecordingDisk, ClosesOnceAndTakesNothingAfterwards) {
    const TempFolder folder;
    RecordingWriter writer(folder / "a", {}, {});
    writer.push(lidar_event(0));
    writer.close();
    writer.close();
    EXPECT_THAT(error_of([&] { writer.push(lidar_event(1)); }), HasSubstr("is closed"));
}

TEST(RecordingDisk, DestructorCloses) {
    const TempFolder folder;
    { RecordingWriter(folder / "a", {}, {}).push(lidar_event(0)); }
    RecordingReader reader(folder / "a");
    EXPECT_TRUE(reader.manifest().closed);
    EXPECT_EQ(read_all(reader).size(), 1U);
}

TEST(RecordingDisk, ManyThreadsMayPush) {
    const TempFolder folder;
    RecordingWriter writer(folder / "a", {}, {});
    std::thread camera([&] {
        for (std::uint64_t i = 0; i < 50; ++i) {
            writer.push(image_event(i));
        }
    });
    for (std::uint64_t i = 0; i < 500; ++i) {
        writer.push(lidar_event(i));
    }
    camera.join();
    writer.close();
    RecordingReader reader(folder / "a");
    EXPECT_EQ(read_all(reader).size(), 550U);
}

}  // namespace
}  // namespace hybrid_slam::test
