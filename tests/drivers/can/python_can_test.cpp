// SPDX-License-Identifier: Apache-2.0
// Another implementation at the other end: python-can (Debian's python3-can, python3-serial).
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <thread>

#include "frames.hpp"
#include "hybrid_slam/can/can_bus.hpp"
#include "hybrid_slam/can/slcan_terminal.hpp"
#include "support/temp_folder.hpp"

namespace hybrid_slam {
namespace {

using test::bytes_of;
using test::frame;
using test::TempFolder;

int run_python(const std::string& python, const std::filesystem::path& script,
               const std::string& arguments) {
    return std::system((python + " '" + script.string() + "' " + arguments).c_str());
}

/// The Python that has the modules: another one than Debian's may come first in PATH, and Debian's
/// packages are for its own alone. Empty when there is none.
std::string python_with(const TempFolder& folder, const std::string& modules) {
    const auto script = folder.write("probe.py", "import " + modules + "\n");
    for (const std::string python : {"python3", "/usr/bin/python3"}) {
        if (run_python(python, script, "2> /dev/null") == 0) {
            return python;
        }
    }
    return {};
}

/// A frame a line, as candump spells it without the time.
constexpr char kSpell[] = R"(
def spell(m):
    name = '%08X' % m.arbitration_id if m.is_extended_id else '%03X' % m.arbitration_id
    data = 'R%d' % m.dlc if m.is_remote_frame else m.data.hex().upper()
    return name + '#' + data
)";

const std::vector<std::string>& frames_to_read() {
    static const std::vector<std::string> frames = {
        "203#03F4010A0A18FC00", "203#", "18FEF100#1122334455667788", "00000001#AB", "601#R4"};
    return frames;
}

std::string lines_of_frames() {
    std::string lines;
    for (const std::string& text : frames_to_read()) {
        lines += text + "\n";
    }
    return lines;
}

TEST(PythonCan, ReadsOurCandump) {
    const TempFolder folder;
    const std::string python = python_with(folder, "can");
    if (python.empty()) {
        GTEST_SKIP() << "needs python-can, which is not here";
    }
    CanConfig config;
    config.port = "candump:" + (folder / "sent.log").string();
    const auto bus = open_can_bus(config);
    for (const std::string& text : frames_to_read()) {
        ASSERT_TRUE(bus->send(frame(text)));
    }
    const auto script = folder.write("read.py", std::string("import can, sys\n") + kSpell + R"(
with open(sys.argv[2], 'w') as out:
    for m in can.LogReader(sys.argv[1]):
        out.write(spell(m) + '\n')
)");
    const auto out = folder / "read.txt";
    ASSERT_EQ(run_python(python, script,
                         "'" + (folder / "sent.log").string() + "' '" + out.string() + "'"),
              0);
    EXPECT_EQ(bytes_of(out), lines_of_frames());
}

TEST(PythonCan, TalksSlcanWithUs) {
    const TempFolder folder;
    const std::string python = python_with(folder, "can, serial");
    if (python.empty()) {
        GTEST_SKIP() << "needs python-can and pyserial, which are not here";
    }
    SlcanTerminal terminal;
    // Echoes each frame that it reads; sends one first, to say that it is there.
    const auto script = folder.write("talk.py", std::string("import can, sys\n") + kSpell + R"(
from can.interfaces.slcan import slcanBus
bus = slcanBus(sys.argv[1], bitrate=250000, sleep_after_open=0.1)
bus.send(can.Message(arbitration_id=0x7FF, data=[1, 2], is_extended_id=False))
with open(sys.argv[2], 'w') as out:
    for i in range(int(sys.argv[3])):
        m = bus.recv(timeout=20)
        out.write(spell(m) + '\n')
        bus.send(m)
bus.shutdown()
)");
    const auto out = folder / "heard.txt";
    std::atomic<int> result{-1};
    std::thread other_end([&] {
        result = run_python(python, script,
                            "'" + terminal.path() + "' '" + out.string() + "' " +
                                std::to_string(frames_to_read().size()));
    });
    std::vector<CanFrame> heard;
    bool spoken = false;
    while (result == -1) {
        const std::vector<CanFrame> frames = terminal.receive(0.01);
        heard.insert(heard.end(), frames.begin(), frames.end());
        if (!heard.empty() && !spoken) {
            spoken = true;
            for (const std::string& text : frames_to_read()) {
                terminal.send(frame(text));
            }
        }
    }
    other_end.join();
    for (int i = 0; i < 10; ++i) {  // its last words
        const std::vector<CanFrame> rest = terminal.receive(0.01);
        heard.insert(heard.end(), rest.begin(), rest.end());
    }
    EXPECT_EQ(result, 0);
    std::vector<CanFrame> expected = {frame("7FF#0102")};
    for (const std::string& text : frames_to_read()) {
        expected.push_back(frame(text));
    }
    EXPECT_EQ(heard, expected);
    EXPECT_EQ(bytes_of(out), lines_of_frames());
}

}  // namespace
}  // namespace hybrid_slam
