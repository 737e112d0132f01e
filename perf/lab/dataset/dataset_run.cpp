#include "perf/lab/dataset/dataset_run.h"

#include <chrono>
#include <cstring>
#include <deque>
#include <thread>
#include <vector>

#include "palpate/error.h"
#include "perf/lab/dataset/case_team.h"
#include "perf/lab/dataset/file.h"
#include "perf/lab/dataset/journal.h"

namespace palpate::lump {
namespace {

using Clock = std::chrono::steady_clock;
using Kind = Processes::Kind;

// How long a process sleeps before it looks for messages again; alone it has none to look for.
constexpr double kLook_s = 0.002, kAlone_s = 0.1;

template <typename Number>
std::string bytes_of(Number number) {
  std::string bytes(sizeof number, '\0');
  std::memcpy(bytes.data(), &number, sizeof number);
  return bytes;
}

template <typename Number>
Number number_of(const std::string& bytes) {
  Number number{};
  std::memcpy(&number, bytes.data(), std::min(bytes.size(), sizeof number));
  return number;
}

uint32_t threads_of(const DatasetJob& job, const Processes& processes) {
  if (job.threads != 0) return job.threads;
  return processes.joined() ? 1 : std::max(1u, std::thread::hardware_concurrency());
}

/// Presses what it is told until it is told to stop.
void follow(const DatasetJob& job, const Processes& processes) {
  const uint32_t threads = threads_of(job, processes);
  bool reported = false;
  const auto fail = [&](int code, const std::string& words) {
    if (!reported) processes.send(0, Kind::Failed, bytes_of(code) + words);
    reported = true;
  };
  {
    CaseTeam team(threads, job.sweep, job.presser, job.stop);
    processes.send(0, Kind::Ready, bytes_of(threads));
    for (bool over = false; !over;) {
      while (const auto message = processes.receive()) {
        if (message->kind == Kind::Work) team.give(number_of<uint32_t>(message->bytes));
        if (message->kind == Kind::Stop) over = true;
      }
      if (job.stop && job.stop()) fail(0, "");
      try {
        if (const auto done = team.take(kLook_s))
          processes.send(0, Kind::Result, bytes_of(done->wall_s) + done->packed);
      } catch (const Error& error) {
        fail(error.exit_code(), error.what());
      } catch (const std::exception& error) {
        fail(1, error.what());
      }
    }
  }
  processes.send(0, Kind::Bye);
}

/// Sees to it that the others end, however the first process does.
class Others {
 public:
  explicit Others(const Processes& processes) : processes_(processes) {}
  ~Others() {
    for (uint32_t rank = 1; rank < processes_.size(); ++rank) processes_.send(rank, Kind::Stop);
    for (uint32_t left = processes_.size() - 1; left > 0;) {
      const auto message = processes_.receive();
      if (!message) std::this_thread::sleep_for(std::chrono::duration<double>(kLook_s));
      if (message && message->kind == Kind::Bye) --left;
    }
  }
  Others(const Others&) = delete;
  Others& operator=(const Others&) = delete;

 private:
  const Processes& processes_;
};

class Lead {
 public:
  Lead(const DatasetJob& job, const Processes& processes)
      : job_(job), processes_(processes), journal_(lump_journal_of(job.file), job.sweep, job.program) {
    report_.processes = processes.size();
    report_.threads = threads_of(job, processes);
    report_.damaged = journal_.damaged();
    report_.progress.cases = job.count;
  }

  DatasetReport run(bool file_is_whole, const std::vector<Sample>& before) {
    for (const Sample& sample : before)
      if (sample.state != State::NotDone) journal_.append(pack(job_.sweep, sample));
    for (uint32_t i = 0; i < job_.count; ++i) {
      const uint32_t number = job_.first + i;
      if (journal_.has(number))
        count(journal_.read(number));
      else
        missing_.push_back(number);
    }
    const bool nothing_new = file_is_whole && missing_.empty();
    if (!job_.assemble_only) press();
    report_.complete = report_.progress.done == job_.count;
    if ((report_.complete && !nothing_new) || (job_.assemble_only && report_.progress.done > 0)) {
      write_lump_file(job_.file, job_.sweep, job_.program, job_.first, job_.count, [this](uint32_t number) {
        if (journal_.has(number)) return journal_.read(number);
        Sample sample;
        sample.what = lump_case(job_.sweep, number);
        return sample;
      });
      report_.written = true;
    }
    // Cases that the file does not hold stay in the journal.
    const bool all_in_file =
        journal_.size() == 0 || (report_.complete && journal_.cases().begin()->first >= job_.first &&
                                 journal_.cases().rbegin()->first - job_.first < job_.count);
    if (all_in_file) journal_.remove();
    return report_;
  }

 private:
  void count(const Sample& sample) {
    ++report_.progress.done;
    if (sample.state == State::NotConverged) ++report_.progress.not_converged;
  }

  void keep(const std::string& packed, double wall_s) {
    journal_.append(packed);
    count(unpack(job_.sweep, packed));
    ++report_.progress.done_now;
    report_.busy_s += wall_s;
  }

  void press() {
    const auto start = Clock::now();
    CaseTeam team(report_.threads, job_.sweep, job_.presser, job_.stop);
    std::deque<uint32_t> ready;  // processes, once for each thread that waits for a case
    const double look_s = processes_.size() == 1 ? kAlone_s : kLook_s;
    while (report_.progress.done < job_.count && !stopped()) {
      for (uint32_t idle = team.idle(); idle > 0 && !missing_.empty(); --idle) {
        team.give(missing_.front());
        missing_.pop_front();
      }
      while (!ready.empty() && !missing_.empty()) {
        processes_.send(ready.front(), Kind::Work, bytes_of(missing_.front()));
        ready.pop_front();
        missing_.pop_front();
      }
      if (const auto done = team.take(look_s)) keep(done->packed, done->wall_s);
      while (const auto message = processes_.receive()) hear(*message, ready);
      report_.progress.wall_s = std::chrono::duration<double>(Clock::now() - start).count();
      if (job_.progress) job_.progress(report_.progress);
    }
    // Cases that came in since, and those the threads have ready, are kept as well.
    while (const auto done = team.take(0)) keep(done->packed, done->wall_s);
  }

  void hear(const Processes::Message& message, std::deque<uint32_t>& ready) {
    if (message.kind == Kind::Ready)
      ready.insert(ready.end(), number_of<uint32_t>(message.bytes), message.from);
    if (message.kind == Kind::Result) {
      keep(message.bytes.substr(sizeof(double)), number_of<double>(message.bytes));
      ready.push_back(message.from);
    }
    if (message.kind == Kind::Failed) {
      const int code = number_of<int>(message.bytes);
      if (code != 0)
        throw Error(static_cast<Failure>(code), "cases from process " + std::to_string(message.from),
                    message.bytes.substr(sizeof code), "the command again; what is done is kept");
      interrupted_elsewhere_ = true;
    }
  }

  bool stopped() const { return interrupted_elsewhere_ || (job_.stop && job_.stop()); }

  const DatasetJob& job_;
  const Processes& processes_;
  Journal journal_;
  std::deque<uint32_t> missing_;
  DatasetReport report_;
  bool interrupted_elsewhere_ = false;
};

/// Samples of the file that is there, which must be this job's.
std::vector<Sample> samples_there(const DatasetJob& job) {
  std::error_code error;
  if (!std::filesystem::exists(job.file, error)) return {};
  Data data = read_lump_file(job.file);
  const std::string name = "'" + job.file.string() + "'";
  if (data.program != job.program)
    throw Error(Failure::Input, "no data set yet or one of " + job.program + " in " + name,
                "one of " + data.program, "another name");
  if (!(to_json(data.sweep) == to_json(job.sweep)))
    throw Error(Failure::Input, "no data set yet or one of this sweep in " + name,
                "one of another sweep, with seed " + std::to_string(data.sweep.seed),
                "the options that it was made with (`palpate-lab info` tells), or another name");
  const uint64_t end = uint64_t{data.first} + data.samples.size();
  if (data.first < job.first || end > uint64_t{job.first} + job.count)
    throw Error(Failure::Usage, "a range of cases that keeps those in " + name,
                "the file's cases " + std::to_string(data.first) + " to " + std::to_string(end - 1) +
                    " partly outside it",
                "--first and --count that include them, or another name");
  return std::move(data.samples);
}

}  // namespace

std::filesystem::path lump_journal_of(const std::filesystem::path& file) {
  return file.string() + ".part";
}

DatasetReport make_lump_dataset(const DatasetJob& job, const Processes& processes) {
  if (processes.rank() != 0) {
    follow(job, processes);
    DatasetReport report;
    report.leads = false;
    return report;
  }
  const Others others(processes);
  check(job.sweep);
  if (job.count == 0 || uint64_t{job.first} + job.count > (uint64_t{1} << 32))
    throw Error(Failure::Usage, "cases from 1 on, their numbers below 2^32",
                std::to_string(job.count) + " from " + std::to_string(job.first), "--count 100");
  const std::vector<Sample> before = samples_there(job);
  const bool whole = before.size() == job.count;
  return Lead(job, processes).run(whole, before);
}

}  // namespace palpate::lump
