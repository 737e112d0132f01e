// Data sets of lumps on the disk: whole or refused, and finished cases survive a kill.
#include "perf/lab/dataset/file.h"

#include <unistd.h>

#include <cmath>
#include <cstring>

#include "lump_cases.h"
#include "palpate/error.h"
#include "perf/lab/dataset/dataset_run.h"
#include "perf/lab/dataset/hdf5.h"
#include "perf/lab/dataset/journal.h"
#include "tests/support/program_fixture.h"

namespace palpate {
namespace {

constexpr const char* kProgram = "palpate test";

class LumpFile : public Program {
 protected:
  fs::path file(const char* name = "set.h5") const { return folder_ / name; }

  void write(const fs::path& path, uint32_t count = 12, const lump::Sweep& sweep = small_sweep()) {
    write_lump_file(path, sweep, kProgram, 5, count, [&](uint32_t number) {
      lump::Sample sample;
      sample.what = lump_case(sweep, number);
      return number == 7 ? sample : quick_sample(sweep, number);
    });
  }

  template <typename Work>
  void expect_error(Failure failure, const std::string& words, const Work& work) {
    try {
      work();
      ADD_FAILURE() << "nothing was refused; wanted: " << words;
    } catch (const Error& error) {
      EXPECT_EQ(error.failure(), failure) << error.what();
      EXPECT_TRUE(contains(error.what(), words)) << error.what();
    }
  }

  lump::DatasetJob job(uint32_t count, const char* name = "set.h5", uint32_t threads = 1) {
    lump::DatasetJob job;
    job.sweep = small_sweep();
    job.program = kProgram;
    job.file = file(name);
    job.count = count;
    job.threads = threads;
    job.presser = quick_press;
    return job;
  }
  lump::DatasetReport make(const lump::DatasetJob& job) { return make_lump_dataset(job, lump::Processes()); }
};

void expect_same(const lump::Sample& a, const lump::Sample& b) {
  EXPECT_EQ(a.what.number, b.what.number);
  EXPECT_EQ(a.state, b.state);
  EXPECT_EQ(a.last_press_mm, b.last_press_mm);
  EXPECT_EQ(a.last_force_N, b.last_force_N);
  EXPECT_EQ(a.steps, b.steps);
  EXPECT_EQ(a.newton_rounds, b.newton_rounds);
  EXPECT_EQ(a.iterations, b.iterations);
  ASSERT_EQ(a.force_N.size(), b.force_N.size());
  for (size_t l = 0; l < a.force_N.size(); ++l) {
    EXPECT_EQ(std::isnan(a.force_N[l]), std::isnan(b.force_N[l]));
    if (!std::isnan(a.force_N[l])) {
      EXPECT_EQ(a.force_N[l], b.force_N[l]);
    }
  }
  ASSERT_EQ(a.pressure_Pa.size(), b.pressure_Pa.size());
  for (size_t l = 0; l < a.pressure_Pa.size(); ++l) {
    EXPECT_EQ(a.pressure_Pa[l].values, b.pressure_Pa[l].values);
    EXPECT_EQ(a.pressure_Pa[l].pitch_mm, b.pressure_Pa[l].pitch_mm);
    EXPECT_EQ(a.pressure_Pa[l].width, b.pressure_Pa[l].width);
  }
}

TEST_F(LumpFile, GivesBackWhatWasWritten) {
  const lump::Sweep sweep = small_sweep();
  write(file(), 60);
  const lump::Data data = lump::read_lump_file(file());
  EXPECT_EQ(to_json(data.sweep).dump(), to_json(sweep).dump());
  EXPECT_EQ(data.program, kProgram);
  EXPECT_EQ(data.first, 5u);
  ASSERT_EQ(data.samples.size(), 60u);
  int ended_early = 0;
  for (const lump::Sample& sample : data.samples) {
    if (sample.what.number == 7) {
      EXPECT_EQ(sample.state, lump::State::NotDone);
      EXPECT_TRUE(sample.pressure_Pa.empty());
      continue;
    }
    expect_same(sample, quick_sample(sweep, sample.what.number));
    if (sample.state == lump::State::NotConverged) {
      ++ended_early;
      EXPECT_EQ(sample.pressure_Pa.size(), 2u);
    }
  }
  EXPECT_GT(ended_early, 2);
}

TEST_F(LumpFile, KeepsSkins) {
  lump::Sweep sweep = small_sweep();
  sweep.depth_mm.low = 3;
  sweep.skin_mm = {1, 3};
  sweep.skin_ratio = {0.3, 5};
  write(file(), 12, sweep);
  const lump::Data data = lump::read_lump_file(file());
  for (const lump::Sample& sample : data.samples) {
    ASSERT_TRUE(sample.what.skin);
    const lump::Case again = lump_case(sweep, sample.what.number);
    EXPECT_EQ(sample.what.skin->thickness_mm, again.skin->thickness_mm);
    EXPECT_EQ(sample.what.skin->stiffness_ratio, again.skin->stiffness_ratio);
  }
  const Hdf5 set(H5Fopen(file().c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
  for (const char* name : {"skin_mm", "skin_ratio"}) EXPECT_GT(H5Lexists(set, name, H5P_DEFAULT), 0) << name;
}

TEST_F(LumpFile, SameCasesMakeTheSameBytes) {
  write(file("a.h5"));
  sleep(1);  // whole seconds are what HDF5's time stamps count
  write(file("b.h5"));
  EXPECT_TRUE(slurp(file("a.h5")) == slurp(file("b.h5")));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()),
            2);  // nothing else stays
}

TEST_F(LumpFile, DamageIsRefused) {
  write(file(), 40);
  const std::string whole = slurp(file());
  expect_error(Failure::Input, "nothing", [&] { lump::read_lump_file(file("missing.h5")); });
  for (const size_t length : {size_t{0}, size_t{100}, whole.size() / 2, whole.size() - 1}) {
    spill(file("cut.h5"), whole.substr(0, length));
    expect_error(Failure::Input, "cut.h5", [&] { lump::read_lump_file(file("cut.h5")); });
  }
  spill(file("text.h5"), "number,size\n1,2\n");
  expect_error(Failure::Input, "HDF5 cannot open", [&] { lump::read_lump_file(file("text.h5")); });

  // A byte that is flipped is found, or one without a meaning.
  int refused = 0;
  for (size_t i = 0; i < 150; ++i) {
    std::string other = whole;
    other[(2 * i + 1) * whole.size() / 300] ^= 0x20;
    spill(file("flipped.h5"), other);
    try {
      const lump::Data data = lump::read_lump_file(file("flipped.h5"));
      ASSERT_EQ(data.samples.size(), 40u);
      for (const lump::Sample& sample : data.samples)
        if (sample.what.number != 7) expect_same(sample, quick_sample(small_sweep(), sample.what.number));
    } catch (const Error& error) {
      EXPECT_EQ(error.failure(), Failure::Input);
      ++refused;
    }
    if (HasFailure()) FAIL() << "byte " << (2 * i + 1) * whole.size() / 300 << " of " << whole.size();
  }
  EXPECT_GT(refused, 30);
}

TEST_F(LumpFile, OtherFilesAreRefused) {
  write(file());
  const auto change = [&](const char* name, const char* text) {
    fs::copy_file(file(), file("other.h5"), fs::copy_options::overwrite_existing);
    const lump::Hdf5 other(H5Fopen(file("other.h5").c_str(), H5F_ACC_RDWR, H5P_DEFAULT), H5Fclose);
    H5Adelete(other, name);
    if (text != nullptr) {
      ASSERT_TRUE(put_attribute(other, name, std::string(text)));
    }
  };
  change("schema", "something else");
  expect_error(Failure::Input, "another kind of file", [&] { lump::read_lump_file(file("other.h5")); });
  change("schema_version", "2");
  expect_error(Failure::Input, "version '2'", [&] { lump::read_lump_file(file("other.h5")); });
  change("sweep", nullptr);
  expect_error(Failure::Input, "sweep", [&] { lump::read_lump_file(file("other.h5")); });
  change("sweep", to_json(small_sweep(4)).dump().c_str());
  expect_error(Failure::Input, "unlike what its sweep makes it",
               [&] { lump::read_lump_file(file("other.h5")); });
  {
    fs::copy_file(file(), file("other.h5"), fs::copy_options::overwrite_existing);
    const lump::Hdf5 other(H5Fopen(file("other.h5").c_str(), H5F_ACC_RDWR, H5P_DEFAULT), H5Fclose);
    H5Ldelete(other, "force_N", H5P_DEFAULT);
  }
  expect_error(Failure::Input, "no `force_N`", [&] { lump::read_lump_file(file("other.h5")); });
}

TEST_F(LumpFile, AFullDiskLeavesTheOldFile) {
  write(file(), 12);
  const std::string before = slurp(file());
  const pid_t child = fork();
  if (child == 0) {
    signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{8192, 8192};
    setrlimit(RLIMIT_FSIZE, &limit);
    try {
      write(file(), 40);
    } catch (const Error& error) {
      _exit(error.exit_code());
    }
    _exit(0);
  }
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_EQ(WIFEXITED(status) ? WEXITSTATUS(status) : -1, 7);
  EXPECT_TRUE(slurp(file()) == before);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()), 1);
}

TEST_F(LumpFile, JournalKeepsWholeRecordsWhateverByteItEndsWith) {
  const lump::Sweep sweep = small_sweep();
  const fs::path path = file("j.part");
  {
    lump::Journal journal(path, sweep, kProgram);
    for (const uint32_t number : {3u, 9u, 4u}) journal.append(pack(sweep, quick_sample(sweep, number)));
    journal.append(pack(sweep, quick_sample(sweep, 9)));  // again: passed over
    EXPECT_EQ(journal.size(), 3u);
  }
  const std::string whole = slurp(path);
  const size_t record = packed_bytes(sweep) + 8, head = whole.size() - 3 * record;
  for (size_t length = 0; length <= whole.size(); length += length + 7 < head || length > head ? 31 : 1) {
    spill(path, whole.substr(0, length));
    lump::Journal journal(path, sweep, kProgram);
    EXPECT_EQ(journal.size(), length < head ? 0 : (length - head) / record) << length;
    EXPECT_EQ(journal.damaged(), 0u);
    journal.append(pack(sweep, quick_sample(sweep, 11)));
    expect_same(journal.read(11), quick_sample(sweep, 11));
    if (journal.has(3)) expect_same(journal.read(3), quick_sample(sweep, 3));
  }
  // A damaged record hides no other.
  std::string flipped = whole;
  flipped[head + record + record / 2] ^= 1;
  spill(path, flipped);
  lump::Journal journal(path, sweep, kProgram);
  EXPECT_EQ(journal.damaged(), 1u);
  EXPECT_TRUE(journal.has(3) && journal.has(4) && !journal.has(9));
}

TEST_F(LumpFile, ForeignJournalsAreRefused) {
  const fs::path path = file("j.part");
  {
    lump::Journal(path, small_sweep(3), kProgram)
        .append(pack(small_sweep(3), quick_sample(small_sweep(3), 1)));
  }
  const std::string before = slurp(path);
  expect_error(Failure::Input, "another sweep, with seed 3 and 1 cases",
               [&] { lump::Journal(path, small_sweep(4), kProgram); });
  expect_error(Failure::Input, "those of palpate test",
               [&] { lump::Journal(path, small_sweep(3), "palpate 99"); });
  {
    const lump::Journal held(path, small_sweep(3), kProgram);
    expect_error(Failure::Input, "another run", [&] { lump::Journal(path, small_sweep(3), kProgram); });
    EXPECT_EQ(lump::Journal::glance(path).cases, 1u);
  }
  EXPECT_TRUE(slurp(path) == before);
  spill(path, "notes of mine\n");
  expect_error(Failure::Input, "something else", [&] { lump::Journal(path, small_sweep(3), kProgram); });
  EXPECT_EQ(slurp(path), "notes of mine\n");
  std::string head = before;
  head[40] ^= 1;
  spill(path, head);
  expect_error(Failure::Input, "damaged head", [&] { lump::Journal(path, small_sweep(3), kProgram); });
  expect_error(Failure::Output, "nowhere",
               [&] { lump::Journal("/nowhere/j.part", small_sweep(3), kProgram); });
}

TEST_F(LumpFile, ThreadsMakeTheSameFile) {
  const lump::DatasetReport one = make(job(40, "one.h5", 1));
  EXPECT_TRUE(one.complete && one.written);
  EXPECT_EQ(one.progress.done_now, 40u);
  EXPECT_GT(one.progress.not_converged, 0u);
  make(job(40, "three.h5", 3));
  EXPECT_TRUE(slurp(file("one.h5")) == slurp(file("three.h5")));
  EXPECT_FALSE(fs::exists(lump::lump_journal_of(file("one.h5"))));
}

TEST_F(LumpFile, StoppedRunsGoOnAndMakeTheSameFile) {
  make(job(40, "whole.h5"));
  lump::DatasetJob stopped = job(40, "set.h5", 2);
  std::atomic<int> pressed = 0;
  stopped.presser = [&](auto&&... arguments) {
    ++pressed;
    return quick_press(arguments...);
  };
  stopped.stop = [&] { return pressed >= 15; };
  const lump::DatasetReport first = make(stopped);
  EXPECT_FALSE(first.complete || first.written);
  EXPECT_GE(first.progress.done, 10u);
  EXPECT_FALSE(fs::exists(file()));

  lump::DatasetJob rest = job(40);
  rest.assemble_only = true;
  const lump::DatasetReport assembled = make(rest);
  EXPECT_TRUE(assembled.written && !assembled.complete);
  uint32_t done = 0;
  for (const lump::Sample& sample : lump::read_lump_file(file()).samples)
    done += sample.state != lump::State::NotDone;
  EXPECT_EQ(done, first.progress.done);

  const lump::DatasetReport second = make(job(40));
  EXPECT_EQ(second.progress.done_now, 40 - first.progress.done);
  EXPECT_TRUE(slurp(file()) == slurp(file("whole.h5")));
  EXPECT_FALSE(make(job(40)).written);  // nothing left to do
}

TEST_F(LumpFile, AFileGrowsAndIsNeverCut) {
  make(job(40, "whole.h5"));
  lump::DatasetJob middle = job(10);
  middle.first = 20;
  make(middle);
  EXPECT_EQ(make(job(40)).progress.done_now, 30u);
  EXPECT_TRUE(slurp(file()) == slurp(file("whole.h5")));
  expect_error(Failure::Usage, "cases 0 to 39 partly outside", [&] { make(job(39)); });
  lump::DatasetJob other = job(40);
  other.sweep.seed = 9;
  expect_error(Failure::Input, "another sweep, with seed 3", [&] { make(other); });
  other = job(40);
  other.program = "palpate 99";
  expect_error(Failure::Input, "one of palpate test", [&] { make(other); });
  EXPECT_TRUE(slurp(file()) == slurp(file("whole.h5")));
}

TEST_F(LumpFile, AFailureKeepsWhatIsDone) {
  lump::DatasetJob failing = job(20, "set.h5", 2);
  std::atomic<int> pressed = 0;
  failing.presser = [&](auto&&... arguments) {
    if (++pressed == 8) throw Error(Failure::Usage, "a grid", "none", "another");
    return quick_press(arguments...);
  };
  expect_error(Failure::Usage, "a grid", [&] { make(failing); });
  const lump::DatasetReport rest = make(job(20));
  EXPECT_TRUE(rest.complete);
  EXPECT_LE(rest.progress.done_now, 15u);
}

}  // namespace
}  // namespace palpate
