// Logs of other instruments: lines read into numbers, clocks brought together, and what is kept of both.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cmath>
#include <fstream>

#include "capture/log/log_input.h"
#include "capture/log/session_logs.h"
#include "capture/log/stamp_columns.h"
#include "engine/base/clock.h"
#include "engine/base/numbers.h"
#include "palpate/error.h"
#include "tests/support/eventually.h"
#include "tests/support/session_fixture.h"

namespace palpate {
namespace {

LogTable log_of(const std::vector<std::string>& lines, const std::vector<int64_t>& arrived_ns = {}) {
  LogReader reader("robot", "robot.csv");
  for (size_t i = 0; i < lines.size(); ++i) reader.add(lines[i], arrived_ns.empty() ? 0 : arrived_ns[i]);
  return reader.take();
}

std::string refused_lines(const std::vector<std::string>& lines) {
  const Refusal refused = refusal([&] { log_of(lines); });
  expect_one_line(refused, static_cast<int>(Failure::Input));
  return refused.line;
}

TEST(LogTables, TakeNumbersWithUnitsAndSayWhatTheyLeave) {
  const LogTable log =
      log_of({"\xef\xbb\xbf# robot 7", "time [ms];mode;fz_N;joint 1 (rad)", "10;a;1,5;0,25", "20;b;nan;0,5",
              "", "time [ms];mode;fz_N;joint 1 (rad)", "30;c;;0,75", "oops", "40;d;-2;x"});
  ASSERT_EQ(log.columns.size(), 2u);
  EXPECT_EQ(log.columns[0].name, "fz_N");
  EXPECT_EQ(log.columns[0].unit, "N");
  EXPECT_EQ(log.columns[1].unit, "rad");
  ASSERT_EQ(log.rows(), 4u);
  EXPECT_EQ(log.columns[0].values[0], 1.5);
  EXPECT_TRUE(std::isnan(log.columns[0].values[1]));
  EXPECT_EQ(log.columns[0].values[3], -2);
  EXPECT_EQ(log.columns[1].values[2], 0.75);
  EXPECT_EQ(log.stamps, LogStamps::Own);
  EXPECT_NEAR(log.stamp_s[3], 0.04, 1e-12);
  std::string notes;
  for (const std::string& note : log.notes) notes += note + "; ";
  EXPECT_TRUE(contains(notes, "1 line left out; line 8: 1 cells, 4 columns")) << notes;
  EXPECT_TRUE(contains(notes, "'mode'")) << notes;
  EXPECT_TRUE(contains(notes, "1 cell without a number")) << notes;
}

TEST(LogTables, TakeNestedJsonWithColumnsThatComeLate) {
  const LogTable log =
      log_of({R"({"stamp":{"sec":1700000000,"nanosec":250000000},"q_rad":[0.5,1],"on":true})",
              R"({"stamp":{"sec":1700000001,"nanosec":0},"q_rad":[1.5,2],"on":false,"tool":{"fz_N":3}})",
              R"({"stamp":{"sec":1700000002,"nanosec":0},"q_rad":[null,3],"on":null})"});
  EXPECT_EQ(log.stamps, LogStamps::Realtime);
  EXPECT_NEAR(log.stamp_s[1] - log.stamp_s[0], 0.75, 1e-6);
  ASSERT_EQ(log.columns.size(), 4u);
  EXPECT_EQ(log.columns[0].name, "q_rad.0");
  EXPECT_EQ(log.columns[0].unit, "rad");
  EXPECT_EQ(log.columns[3].name, "tool.fz_N");
  EXPECT_TRUE(std::isnan(log.columns[3].values[0]));
  EXPECT_EQ(log.columns[3].values[1], 3);
  EXPECT_TRUE(std::isnan(log.columns[0].values[2]));
  EXPECT_EQ(log.columns[2].values[0], 1);
}

TEST(LogTables, KnowTheClocksOfTheirTimes) {
  const auto stamps = [](const std::string& name, const std::string& first, const std::string& second) {
    return log_of({name + ",x", first + ",1", second + ",2"});
  };
  EXPECT_EQ(stamps("t_us", "1000", "2000").stamps, LogStamps::Own);
  EXPECT_EQ(stamps("monotonic_ns", "1000", "2000").stamps, LogStamps::Monotonic);
  for (const char* first :
       {"1700000000.5", "1700000000500", "1700000000500000", "1700000000500000000", "2023-11-14T22:13:20.5Z",
        "2023-11-14 22:13:20.5", "2023-11-14T23:13:20.5+01:00"}) {
    const LogTable log = stamps("timestamp", first, first);
    EXPECT_EQ(log.stamps, LogStamps::Realtime) << first;
    EXPECT_NEAR(log.stamp_s[0], 1700000000.5, 1e-6) << first;
  }
  // A robot's own count, whose unit its lines' arrivals tell.
  const LogTable log = log_of({"t,x", "5000,1", "6000,1", "7000,1", "8000,1"},
                              {1, 1'000'000'000, 2'001'000'000, 3'000'000'000, 4'002'000'000});
  EXPECT_NEAR(log.stamp_s[3] - log.stamp_s[0], 3, 1e-9);
  EXPECT_TRUE(std::isnan(date_s("2023-13-14T22:13:20")));
  EXPECT_TRUE(std::isnan(date_s("2023-11-14T22:13:20 CET")));
}

TEST(LogTables, RefuseInOneLine) {
  EXPECT_TRUE(contains(refused_lines({}), "no line"));
  EXPECT_TRUE(contains(refused_lines({"t_s,x"}), "the names alone"));
  EXPECT_TRUE(contains(refused_lines({"t,x", "1,2", "2,3"}), "a unit in the name of the column 't'"));
  EXPECT_TRUE(contains(refused_lines({"t_s,mode", "1,a", "2,b"}), "a column of numbers"));
  EXPECT_TRUE(contains(refused_lines({"t_s,x", "1,2,3", "1", "2,3"}), "2 of 3 that do not"));
  EXPECT_TRUE(contains(refused_lines({"t_s,x", "5,2", "1,3"}), "times that rise"));
  EXPECT_TRUE(contains(refused_lines({"7,x", "1,2"}), "names of the columns"));
  EXPECT_TRUE(contains(refused_lines({std::string(100000, '{')}), "longer than 64 KiB"));
}

TEST(LogTables, PutBackWhatOvertookAndBeginAnewWhereAClockWasSet) {
  const LogTable log = log_of({"t_s,x", "1,1", "3,3", "2.5,2", "100,4", "101,5"},
                              {1, 1'000'000'000, 3'000'000'000, 3'100'000'000, 4'000'000'000, 5'000'000'000});
  EXPECT_EQ(log.columns[0].values, (std::vector<double>{1, 2, 3, 4, 5}));
  EXPECT_EQ(log.stretches, (std::vector<size_t>{0, 3}));
}

/// Arrivals of stamps on a clock that is off and runs too fast, by a way of random delay.
struct Way {
  std::vector<double> stamp_s, arrived_s;
};
Way simulated_way(uint32_t seed, double span_s, double drift, double typical_s) {
  std::mt19937 random(seed);
  std::exponential_distribution<double> delay(1 / typical_s);
  Way way;
  for (double t = 0; t < span_s; t += 0.01) {
    way.stamp_s.push_back(500 + (1 + drift) * t);
    way.arrived_s.push_back(t + delay(random));
  }
  return way;
}

TEST(LogClocks, TheSoonestLinesTellOffsetAndDriftWithinTheirError) {
  for (const double drift : {0.0, 1e-4, -2e-4}) {
    int within = 0;
    double worst_s = 0;
    constexpr int kTrials = 60;
    for (uint32_t seed = 0; seed < kTrials; ++seed) {
      const Way way = simulated_way(seed, 60, drift, 0.002);
      const FastestArrivals line = fastest_arrivals(way.stamp_s, way.arrived_s);
      double error_s = 0;
      for (const double t : {0.0, 30.0, 59.0})
        error_s = std::max(error_s,
                           std::abs(line.offset_s + line.rate * (500 + (1 + drift) * t - line.origin_s) - t));
      within += error_s < 2 * line.sd_s;
      worst_s = std::max(worst_s, error_s);
    }
    EXPECT_GE(within, kTrials * 95 / 100) << drift;
    EXPECT_LT(worst_s, 0.002) << drift;
  }
}

double press(double t) {
  const double s = std::sin(0.7 * t) + 0.6 * std::sin(1.9 * t + 1);
  return s > 0 ? s : 0;
}

constexpr double kHost_s = 7000;            // CLOCK_MONOTONIC at the recording's start
constexpr double kAhead_s = 1'700'000'000;  // of the date

/// Frames at 60 Hz of a recording of 20 s that presses.
FrameClock simulated_frames() {
  FrameClock frames;
  FrameClock::Signal force{"force_N", {}};
  for (int i = 0; i < 1200; ++i) {
    const double t = i / 60.0;
    frames.time_s.push_back(t);
    frames.host_s.push_back(kHost_s + t);
    force.values.push_back(press(t));
  }
  frames.wall = frames.wall_end = WallClock{static_cast<int64_t>(kAhead_s * 1e9), 100};
  frames.signals = {force};
  return frames;
}

/// A log at 100 Hz whose column t is the true time, and fz_N the force `late_s` later.
LogTable simulated_log(LogStamps stamps, double clock_ahead_s, bool arrivals, double late_s = 0,
                       double sign = 1) {
  LogTable log{.name = "robot"};
  log.columns = {{"true_s", "s", {}}, {"fz_N", "N", {}}};
  log.stamps = stamps;
  log.stretches = {0};
  std::mt19937 random(5);
  std::exponential_distribution<double> delay(1 / 0.001);
  for (double t = -0.5; t < 20.5; t += 0.01) {
    log.columns[0].values.push_back(t);
    log.columns[1].values.push_back(sign * press(t - late_s));
    log.arrived_s.push_back(arrivals ? kHost_s + t + delay(random) : kNaN);
    if (stamps != LogStamps::None) log.stamp_s.push_back(clock_ahead_s + t);
  }
  return log;
}

struct ClockCase {
  const char* what;
  LogTable log;
  LogAlignment by;
  double within_s;
};

TEST(LogClocks, AlignToTwoMillisecondsWhereBothHaveStamps) {
  const double date_s = kAhead_s + kHost_s;
  const ClockCase cases[] = {
      {"monotonic", simulated_log(LogStamps::Monotonic, kHost_s, true), LogAlignment::Monotonic, 0.0005},
      {"date, live", simulated_log(LogStamps::Realtime, date_s, true), LogAlignment::Date, 0.0005},
      {"date, a file", simulated_log(LogStamps::Realtime, date_s, false), LogAlignment::Date, 0.0005},
      {"another machine's date", simulated_log(LogStamps::Realtime, date_s + 1.3, true),
       LogAlignment::Fastest, 0.002},
      {"a robot's uptime", simulated_log(LogStamps::Own, 86400, true), LogAlignment::Fastest, 0.002},
      {"a gauge's own time", simulated_log(LogStamps::Own, 0.25, false), LogAlignment::Shape, 0.01},
      {"a gauge that pushes down", simulated_log(LogStamps::Own, 3.25, false, 0, -1), LogAlignment::Shape,
       0.01}};
  for (const ClockCase& one : cases) {
    const AlignedLog log = align_log(one.log, simulated_frames());
    EXPECT_EQ(log.clock.by, one.by) << one.what;
    ASSERT_TRUE(log.clock.sd_s) << one.what;
    double worst_s = 0;
    for (size_t i = 0; i < log.time_s.size(); ++i)
      worst_s = std::max(worst_s, std::abs(log.time_s[i] - log.table.columns[0].values[i]));
    EXPECT_LT(worst_s, one.within_s) << one.what << ": " << describe(log);
    EXPECT_LT(worst_s, 3 * *log.clock.sd_s + 1e-4) << one.what << ": " << describe(log);
    const std::optional<double> at = log.at(log.table.columns[0], 10.123);
    ASSERT_TRUE(at);
    EXPECT_NEAR(*at, 10.123, one.within_s) << one.what;
  }
}

TEST(LogClocks, SayWhatStampsDoNot) {
  // An instrument that filters for 60 ms: its stamps are right, its force is late.
  const AlignedLog late =
      align_log(simulated_log(LogStamps::Monotonic, kHost_s, true, 0.06), simulated_frames());
  EXPECT_TRUE(contains(describe(late), "0.06 s later than its stamps say")) << describe(late);
  const AlignedLog right = align_log(simulated_log(LogStamps::Monotonic, kHost_s, true), simulated_frames());
  EXPECT_TRUE(right.clock.warnings.empty()) << describe(right);
  // The date was set by a third of a second while recording.
  FrameClock set = simulated_frames();
  set.wall_end->ahead_ns += 333'000'000;
  for (const bool arrivals : {true, false}) {
    const AlignedLog moved = align_log(simulated_log(LogStamps::Realtime, kAhead_s + kHost_s, arrivals), set);
    EXPECT_TRUE(contains(describe(moved), "the date was set by 0.333 s")) << describe(moved);
    // All lines arrived as if it had not been, or nobody knows.
    EXPECT_EQ(*moved.clock.sd_s < 0.001, arrivals);
    EXPECT_EQ(*moved.clock.sd_s > 0.1, !arrivals);
  }
  LogTable stepped = simulated_log(LogStamps::Realtime, kAhead_s + kHost_s, true);
  for (size_t i = stepped.rows() / 2; i < stepped.rows(); ++i) stepped.stamp_s[i] -= 0.333;
  set.wall_end->ahead_ns -= 666'000'000;
  EXPECT_GT(*align_log(stepped, set).clock.sd_s, 0.1);
  const AlignedLog arrived = align_log(simulated_log(LogStamps::None, 0, true), simulated_frames());
  EXPECT_EQ(arrived.clock.by, LogAlignment::Arrival);
  EXPECT_FALSE(arrived.clock.sd_s);
}

TEST(LogClocks, RefuseWhatCannotBeBroughtTogether) {
  const auto refused = [](const LogTable& log, std::optional<double> told = std::nullopt) {
    return refusal([&] { align_log(log, simulated_frames(), told); }).line;
  };
  LogTable other = simulated_log(LogStamps::Own, 0, false);
  std::mt19937 random(1);
  std::normal_distribution<double> noise;
  for (LogColumn& column : other.columns)
    for (double& value : column.values) value = noise(random);
  EXPECT_TRUE(contains(refused(other), "a column that rises and falls with the touch"));
  const LogTable yesterday = simulated_log(LogStamps::Realtime, kAhead_s + kHost_s - 86400, false, 0, 0);
  EXPECT_TRUE(contains(refused(yesterday), "dates of another time"));
  EXPECT_TRUE(contains(refused(simulated_log(LogStamps::None, 0, false)), "without a column of times"));
  EXPECT_TRUE(
      contains(refused(simulated_log(LogStamps::Own, 0, false), 500), "rows of the time of the recording"));
  EXPECT_EQ(refused(simulated_log(LogStamps::Own, 3, false), -3), "");
}

TEST(LogClocks, GapsAndHalfTurnsAreNotCrossed) {
  LogTable table{.name = "robot"};
  table.columns = {{"yaw_deg", "deg", {170, 178, -174, -166, -158, -150}}};
  table.stamps = LogStamps::Monotonic;
  table.stretches = {0};
  for (const double t : {1.0, 1.1, 1.2, 1.3, 5.0, 5.1}) {
    table.stamp_s.push_back(kHost_s + t);
    table.arrived_s.push_back(kNaN);
  }
  const AlignedLog log = align_log(table, simulated_frames());
  const LogColumn& yaw = log.table.columns[0];
  EXPECT_NEAR(*log.at(yaw, 1.05), 174, 1e-6);
  EXPECT_EQ(*log.at(yaw, 1.14), 178);
  EXPECT_EQ(*log.at(yaw, 1.16), -174);
  EXPECT_FALSE(log.at(yaw, 3));
  EXPECT_FALSE(log.at(yaw, 0.5));
  EXPECT_FALSE(log.at(yaw, 6));
}

class LogInputs : public Sessions {
 protected:
  static void send(uint16_t port, const std::string& text) {
    const int fd = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(port);
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    ASSERT_EQ(::sendto(fd, text.data(), text.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to),
              static_cast<ssize_t>(text.size()));
    ::close(fd);
  }
};

TEST_F(LogInputs, DatagramsAreWrittenAsTheyComeWithTheirTimes) {
  LogInput log("arm=udp:0");
  EXPECT_EQ(log.name(), "arm");
  send(log.port(), "t_s,x");
  send(log.port(), "0,-1");  // before a session: not kept
  log.write_to(folder_ / "a" / "log");
  const int64_t before = monotonic_ns();
  for (int i = 0; i < 50; ++i) send(log.port(), std::to_string(i) + "," + std::to_string(2 * i) + "\n");
  // Before anybody closes the file: what a kill leaves.
  const fs::path lines = folder_ / "a" / "log" / "arm.lines";
  EXPECT_TRUE(eventually([&] { return log.status().lines >= 50; }));
  const LogTable killed = read_log(lines, "arm");
  EXPECT_GE(killed.rows(), 50u);
  EXPECT_EQ(killed.columns[0].values.back(), 98);
  EXPECT_GT(killed.arrived_s.back(), 1e-9 * static_cast<double>(before));
  const LogStatus status = log.finish();
  EXPECT_TRUE(status.error.empty()) << status.error;
  // A second session begins with the names too.
  log.write_to(folder_ / "b" / "log");
  send(log.port(), "7,8");
  log.finish();
  const LogTable second = read_log(folder_ / "b" / "log" / "arm.lines", "arm");
  EXPECT_EQ(second.columns[0].name, "x");
  EXPECT_EQ(second.rows(), 1u);
}

// The file before still waits for the disk when the next session begins.
TEST_F(LogInputs, ASessionEndsAndTheNextBeginsBeforeTheDiskHasTheFirst) {
  const std::unique_ptr<LogInput> log = LogInput::of_program("robot");
  log->write_to(folder_ / "a");
  log->add("x");
  log->add("1");
  LogEnding first = log->end();
  log->add("2");  // of no session
  log->write_to(folder_ / "b");
  log->add("3");
  LogEnding second = log->end();
  EXPECT_EQ(log->end().close().lines, second.close().lines);
  const LogStatus status = first.close();
  EXPECT_EQ(status.lines, 2u);
  EXPECT_TRUE(status.error.empty()) << status.error;
  EXPECT_EQ(read_log(folder_ / "a" / "robot.lines", "robot").columns[0].values, std::vector<double>{1});
  EXPECT_EQ(read_log(folder_ / "b" / "robot.lines", "robot").columns[0].values, std::vector<double>{3});
}

TEST_F(LogInputs, AGrowingFileIsFollowedToItsEnd) {
  const fs::path file = folder_ / "robot.csv";
  spill(file, "t_s,x\n1,2\n");
  LogInput log(file.string());
  EXPECT_EQ(log.name(), "robot");
  EXPECT_TRUE(eventually([&] {
    log.write_to(folder_ / "log");
    return log.status().lines == 2;
  }));
  {
    std::ofstream more(file, std::ios::app);
    more << "2,3\n3,";
    more.flush();
    EXPECT_TRUE(eventually([&] { return log.status().lines == 3; }));
    more << "4\n" << std::string(200000, '9') << "\n5,6\n";
  }
  const LogStatus status = log.finish();
  EXPECT_EQ(status.lines, 5u);
  EXPECT_EQ(status.dropped, 1u);
  const LogTable table = read_log(folder_ / "log" / "robot.lines", "robot");
  EXPECT_EQ(table.columns[0].values, (std::vector<double>{2, 3, 4, 6}));
  EXPECT_TRUE(std::isnan(table.arrived_s[0]));  // was there before
  EXPECT_TRUE(std::isfinite(table.arrived_s[1]));
}

TEST_F(LogInputs, RefuseWhatCannotBeOpened) {
  const auto refused = [](const std::vector<std::string>& what) {
    return refusal([&] { open_logs(what); }).line;
  };
  EXPECT_TRUE(contains(refused({"/nowhere/robot.csv"}), "no such file"));
  EXPECT_TRUE(contains(refused({folder_.string()}), "a folder"));
  EXPECT_TRUE(contains(refused({"udp:99999"}), "a port from 0 to 65535"));
  EXPECT_TRUE(contains(refused({"udp:robot"}), "a port from 0 to 65535"));
  EXPECT_TRUE(contains(refused({""}), "FILE, - or udp:PORT"));
  EXPECT_TRUE(contains(refused({"udp:0", "udp:0"}), "two logs 'udp'"));
  LogInput first("udp:0");
  EXPECT_TRUE(contains(refused({"udp:" + std::to_string(first.port())}), "a free UDP port"));
}

TEST_F(LogInputs, ASessionKeepsItsLogsAtTheTimesOfItsFrames) {
  const FrameFormat format{12, 9, 1, 12};
  const fs::path session = folder_ / "session";
  const int64_t start_ns = monotonic_ns();
  const WallClock wall = wall_clock();
  {
    SessionWriter writer(session, plain_info(format), {.no_drop = true});
    for (uint64_t i = 0; i < 100; ++i) {
      Frame frame = noise_frame(format, i);
      frame.exposed_ns = start_ns + frame.time_ns;
      ASSERT_TRUE(writer.record(frame));
    }
    EXPECT_TRUE(writer.close().error.empty());
  }
  fs::create_directory(session / "log");
  std::string lines = "0\ttime,true_s\n";
  for (int i = 0; i < 180; ++i) {
    const double t = 0.01 * i;
    lines += "0\t" + std::to_string((start_ns + wall.ahead_ns) / 1000 + static_cast<int64_t>(1e6 * t)) + "," +
             std::to_string(t) + "\n";
  }
  spill(session / "log" / "robot.lines", lines + "0\t12345678");  // cut by a kill
  spill(session / "log" / "bad.lines", "0\tnothing\n");
  const std::vector<std::string> said = finish_session_logs(session);
  ASSERT_EQ(said.size(), 2u);
  EXPECT_TRUE(contains(said[0], "bad.lines")) << said[0];
  EXPECT_TRUE(contains(said[1], "robot: 180 rows of 1 columns at 100 Hz, aligned by the date")) << said[1];
  std::vector<std::string> problems;
  const std::vector<AlignedLog> logs = session_logs(session, problems);
  ASSERT_EQ(logs.size(), 1u);
  for (size_t i = 0; i < logs[0].time_s.size(); ++i)
    ASSERT_NEAR(logs[0].time_s[i], logs[0].table.columns[0].values[i], 0.002);
  const LogTable csv = read_log(session / "log" / "robot.csv", "robot");
  EXPECT_EQ(csv.rows(), 180u);
  EXPECT_NEAR(csv.stamp_s[100], 1, 0.002);
}

}  // namespace
}  // namespace palpate
