// palpate-lab dataset on the command line: alone, under mpirun, killed, and read from Python.
#include <algorithm>
#include <thread>

#include "perf/lab/dataset/file.h"
#include "tests/lab/lab_program.h"
#include "tests/support/eventually.h"
#include "tests/support/json.h"

namespace palpate {
namespace {

class LumpCommand : public LabProgram {
 protected:
  std::string at(const std::string& name) const { return (folder_ / name).string(); }

  /// A tiny sweep: some 20 ms a case.
  std::vector<std::string> small(const std::string& name, int count,
                                 const std::vector<std::string>& more = {}) {
    std::vector<std::string> words = {"dataset", at(name), "--quiet"};
    const std::vector<std::pair<std::string, std::string>> usual = {{"--count", std::to_string(count)},
                                                                    {"--cells", "8x8x4"},
                                                                    {"--coarser-cells", "0"},
                                                                    {"--nodes", "9"},
                                                                    {"--loads", "2"},
                                                                    {"--greatest-press", "0.05"}};
    for (const auto& [option, value] : usual)
      if (std::find(more.begin(), more.end(), option) == more.end())
        words.insert(words.end(), {option, value});
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }

  /// The same under mpirun; its exit code.
  int together(int processes, const std::vector<std::string>& words) {
    std::string typed =
        "OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 "
        "OMPI_MCA_btl_vader_single_copy_mechanism=none "
        "mpirun --oversubscribe -n " +
        std::to_string(processes) +
        // Each process into a file of its own: mpirun may put what one prints into the midst of another's.
        " sh -c 'exec \"$0\" \"$@\" > " + at("mpi_out") + "$OMPI_COMM_WORLD_RANK' " PALPATE_LAB_PROGRAM;
    for (const std::string& word : words) typed += " '" + word + "'";
    const int status = std::system((typed + " > " + at("mpi_forwarded") + " 2> " + at("mpi_err")).c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

  bool without(const char* command) const {
    return std::system((std::string(command) + " > /dev/null 2>&1").c_str()) != 0;
  }

  /// Processes of this program with such a word in their command line.
  static std::vector<pid_t> processes_of(const std::string& word) {
    std::vector<pid_t> found;
    for (const auto& entry : fs::directory_iterator("/proc")) {
      const std::string line = slurp(entry.path() / "cmdline");
      if (line.rfind(PALPATE_LAB_PROGRAM, 0) == 0 && contains(line, word))
        found.push_back(std::stoi(entry.path().filename()));
    }
    return found;
  }

  size_t bytes_of(const std::string& name) const {
    std::error_code error;
    const auto size = fs::file_size(folder_ / name, error);
    return error ? 0 : size;
  }
};

TEST_F(LumpCommand, ThreadsAndProcessesMakeTheSameFile) {
  ASSERT_EQ(run(small("one.h5", 14, {"--threads", "1"})).exit_code, 0);
  const std::string one = slurp(at("one.h5"));
  ASSERT_GT(one.size(), 10000u);
  ASSERT_EQ(run(small("two.h5", 14, {"--threads", "2"})).exit_code, 0);
  EXPECT_TRUE(slurp(at("two.h5")) == one);
  if (without("mpirun --version")) GTEST_SKIP() << "NO mpirun HERE: processes are not tested";
  for (const int processes : {1, 2, 3}) {
    const std::string name = "mpi" + std::to_string(processes) + ".h5";
    EXPECT_EQ(together(processes, small(name, 14, {"--json"})), 0) << slurp(at("mpi_err"));
    EXPECT_TRUE(slurp(at(name)) == one) << processes;
    const Json said = parse_json(slurp(at("mpi_out0")));
    for (int other = 1; other < processes; ++other)
      EXPECT_EQ(slurp(at("mpi_out" + std::to_string(other))), "") << "one process speaks for all";
    EXPECT_EQ(said["processes"], processes);
    EXPECT_EQ(said["done_now"], 14);
  }
}

TEST_F(LumpCommand, GoesOnAfterKills) {
  ASSERT_EQ(run(small("whole.h5", 100)).exit_code, 0);
  int killed = 0;
  size_t before = 0;
  for (int i = 0; i < 3; ++i) {
    const pid_t child = start(small("set.h5", 100, {"--threads", "2"}));
    bool over = false;
    EXPECT_TRUE(eventually([&] {
      over = waitpid(child, nullptr, WNOHANG) == child;
      return over || bytes_of("set.h5.part") >= before + 3000;
    }));
    kill(child, SIGKILL);
    killed += finish(child).exit_code == 1000 + SIGKILL;
    EXPECT_GE(bytes_of("set.h5.part"), before);
    before = bytes_of("set.h5.part");
  }
  EXPECT_GT(killed, 0);
  const Json half = parse_json(run({"info", at("set.h5"), "--json"}).out);
  EXPECT_FALSE(half["complete"]);
  EXPECT_GT(half["done"], 0);
  const Json rest = parse_json(run(small("set.h5", 100, {"--json"})).out);
  EXPECT_TRUE(rest["complete"]);
  EXPECT_EQ(rest["done_now"], 100 - half["done"].get<int>());
  EXPECT_TRUE(slurp(at("set.h5")) == slurp(at("whole.h5")));
  EXPECT_FALSE(fs::exists(at("set.h5.part")));
}

TEST_F(LumpCommand, ProcessesGoOnAfterAKillOfOne) {
  if (without("mpirun --version")) GTEST_SKIP() << "NO mpirun HERE: processes are not tested";
  ASSERT_EQ(run(small("whole.h5", 200)).exit_code, 0);
  int code = 0;
  std::thread all([&] { code = together(3, small("set.h5", 200)); });
  EXPECT_TRUE(eventually([&] { return bytes_of("set.h5.part") >= 3000; }));
  const std::vector<pid_t> pressing = processes_of(at("set.h5"));
  if (!pressing.empty()) kill(pressing.back(), SIGKILL);
  all.join();
  EXPECT_EQ(pressing.size(), 3u);
  EXPECT_NE(code, 0);
  EXPECT_EQ(together(2, small("set.h5", 200)), 0) << slurp(at("mpi_err"));
  EXPECT_TRUE(slurp(at("set.h5")) == slurp(at("whole.h5")));
}

TEST_F(LumpCommand, CtrlCSaysHowToGoOn) {
  const pid_t child = start(small("set.h5", 4000));
  EXPECT_TRUE(eventually([&] { return bytes_of("set.h5.part") >= 3000; }));
  kill(child, SIGINT);
  const Ended ended = finish(child);
  EXPECT_EQ(ended.exit_code, 130);
  EXPECT_TRUE(contains(ended.out, "the same command goes on from there")) << ended.out;
  EXPECT_FALSE(fs::exists(at("set.h5")));
  EXPECT_EQ(run(small("set.h5", 4000, {"--assemble"})).exit_code, 0);
  EXPECT_TRUE(contains(run({"info", at("set.h5")}).out, "not done"));
  EXPECT_TRUE(fs::exists(at("set.h5.part")));
}

TEST_F(LumpCommand, TellsWhatAFileHolds) {
  ASSERT_EQ(
      run(small("set.h5", 12, {"--no-lump-share", "0", "--shapes", "lying,sphere", "--seed", "4"})).exit_code,
      0);
  const Json info = parse_json(run({"info", at("set.h5"), "--json"}).out);
  EXPECT_EQ(info["good"], 12);
  EXPECT_EQ(info["shapes"]["sphere"].get<int>() + info["shapes"]["lying"].get<int>(), 12);
  EXPECT_EQ(info["sweep"]["seed"], 4);
  EXPECT_GE(info["ranges"]["diameter_mm"][0], 4);
  EXPECT_GT(info["ranges"]["force_N"][0], 0);
  EXPECT_TRUE(contains(run({"info", at("set.h5")}).out, "12 good, 0 not converged"));
  const lump::Data data = lump::read_lump_file(at("set.h5"));
  for (const lump::Sample& sample : data.samples) {
    // A map sums up to the force where the whole surface is pressed: nodes times the area of each.
    const PressureMap& map = sample.pressure_Pa.back();
    double sum = 0;
    for (uint32_t y = 0; y < map.height; ++y)
      for (uint32_t x = 0; x < map.width; ++x)
        sum += double{map.at(x, y)} * (x == 0 || x == 8 ? 0.5 : 1) * (y == 0 || y == 8 ? 0.5 : 1);
    EXPECT_NEAR(sum * 5e-3 * 5e-3, sample.force_N.back(), 0.12 * sample.force_N.back());
  }
}

TEST_F(LumpCommand, PythonReadsIt) {
  if (without("/usr/bin/python3 -c 'import h5py'"))
    GTEST_SKIP() << "NO python3-h5py HERE: its reading is not tested";
  ASSERT_EQ(run(small("set.h5", 5)).exit_code, 0);
  spill(folder_ / "read.py", R"(import h5py, json, sys
with h5py.File(sys.argv[1], 'r') as f:
    assert f.attrs['schema'] == 'palpate lump dataset' and f.attrs['schema_version'] == '1', dict(f.attrs)
    assert f.attrs['program'].startswith('palpate ') and f.attrs['seed'] == '1'
    sweep = json.loads(f.attrs['sweep'])
    assert sweep['diameter_mm'] == [4, 14] and sweep['cells'] == [8, 8, 4]
    assert f['pressure_Pa'].shape == (5, 2, 9, 9) and str(f['pressure_Pa'].dtype) == 'float32'
    assert f['force_N'].shape == f['press_mm'].shape == (5, 2) and f['size_mm'].shape == (5, 3)
    assert (f['force_N'][:, 1] > f['force_N'][:, 0]).all()
    assert list(f['x_mm'][[0, 4, 8]]) == [-20, 0, 20]
    for name, data in f.items():
        assert data.fletcher32 and data.attrs['description'], name
        unit = data.attrs['units']
        ends = {'_mm': 'mm', '_N': 'N', '_Pa': 'Pa'}
        wanted = [u for end, u in ends.items() if name.endswith(end)] or ['1']
        assert [unit] == wanted, (name, unit)
print('read')
)");
  EXPECT_EQ(
      std::system(("/usr/bin/python3 " + at("read.py") + " " + at("set.h5") + " > " + at("python") + " 2>&1")
                      .c_str()),
      0);
  EXPECT_EQ(slurp(at("python")), "read\n");
}

TEST_F(LumpCommand, RefusesNonsenseInOneLine) {
  const auto refused = [&](const std::vector<std::string>& more, int code,
                           const std::vector<std::string>& words) {
    expect_refusal(small("set.h5", 4, more), code, words);
    EXPECT_FALSE(fs::exists(at("set.h5")) || fs::exists(at("set.h5.part")));
  };
  refused({"--size-mm", "9", "4"}, 2, {"diameter", "rises"});
  refused({"--shapes", "cube"}, 2, {"cube", "sphere"});
  refused({"--cells", "8x8"}, 2, {"8x8"});
  refused({"--coarser-cells", "6x6x4"}, 2, {"proportions"});
  refused({"--thickness-mm", "5"}, 2, {"6.5 mm thick"});
  refused({"--count", "0"}, 2, {"cases"});
  refused({"--first", "4294967295"}, 2, {"2^32"});
  refused({"--greatest-press", "0.9"}, 2, {"press"});
  refused({"--skin-mm", "2"}, 2, {"below the skin"});
  refused({"--skin-mm", "0", "1"}, 2, {"skin above 0"});
  refused({"--skin-mm", "9", "--depth-mm", "9", "10"}, 2, {"half the block"});
  refused({"--loads", "many"}, 2, {"--loads"});
  expect_refusal({"dataset", "/nowhere/set.h5", "--count", "1"}, 7, {"/nowhere"});
  expect_refusal({"info", at("none.h5")}, 3, {"none.h5", "nothing"});
  spill(folder_ / "text.h5", "no data set");
  expect_refusal({"info", at("text.h5")}, 3, {"text.h5", "HDF5"});
  expect_refusal(small("text.h5", 4), 3, {"text.h5"});
  EXPECT_EQ(slurp(at("text.h5")), "no data set");
  expect_refusal({}, 2, {"subcommand"});
  spill(folder_ / "no.lump", "no network");
  expect_refusal({"train", folder_ / "no.lump"}, 2, {"--out"});
  expect_refusal({"train", folder_ / "no.lump", "--out", folder_ / "x.lump"}, 3, {"no.lump"});
  expect_refusal({"evaluate", "lump", folder_ / "no.lump"}, 3, {"no.lump"});
  expect_refusal({"evaluate", "lump", folder_ / "no.lump", "--window-mm", "30", "20"}, 3, {"no.lump"});
}

TEST_F(LumpCommand, RefusalsUnderMpirunAreTold) {
  if (without("mpirun --version")) GTEST_SKIP() << "NO mpirun HERE: processes are not tested";
  EXPECT_EQ(together(3, small("set.h5", 4, {"--size-mm", "9", "4"})), 2);
  const std::string said = slurp(at("mpi_err"));
  const size_t first = said.find("palpate-lab: wanted");
  EXPECT_NE(first, std::string::npos) << said;
  EXPECT_EQ(said.find("palpate-lab: wanted", first + 1), std::string::npos) << said;  // by one of them
}

}  // namespace
}  // namespace palpate
