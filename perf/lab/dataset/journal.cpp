#include "perf/lab/dataset/journal.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <cerrno>
#include <chrono>
#include <cstring>

#include "engine/base/json.h"
#include "engine/base/readable.h"
#include "palpate/error.h"

namespace palpate::lump {
namespace {

// The head: kMagic, length and check sum of the text after them, the text: JSON with program and sweep.
constexpr char kMagic[] = "palpate lumps 1\n";
constexpr size_t kMagicBytes = sizeof kMagic - 1;
constexpr uint32_t kMostHeadBytes = 1 << 20;
// Waiting for the disk after each case would be the limit of many processes.
constexpr std::chrono::milliseconds kSyncEvery{200};
constexpr const char* kRemedy = "another name for the data set, or to remove this file";

struct Frame {
  uint32_t bytes, checksum;
};

uint32_t checksum(const std::string& bytes) {
  return static_cast<uint32_t>(
      crc32(0, reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uInt>(bytes.size())));
}

std::string framed(const std::string& bytes) {
  const Frame frame{static_cast<uint32_t>(bytes.size()), checksum(bytes)};
  std::string whole(sizeof frame, '\0');
  std::memcpy(whole.data(), &frame, sizeof frame);
  return whole + bytes;
}

/// Up to `count` bytes from `at`.
std::string read_at(int file, uint64_t at, size_t count) {
  std::string bytes(count, '\0');
  size_t done = 0;
  while (done < count) {
    const ssize_t got = ::pread(file, bytes.data() + done, count - done, static_cast<off_t>(at + done));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) break;
    done += static_cast<size_t>(got);
  }
  bytes.resize(done);
  return bytes;
}

/// The text of a record of that many bytes; none where it is cut off or damaged.
std::optional<std::string> record_at(int file, uint64_t at, size_t bytes) {
  const std::string whole = read_at(file, at, sizeof(Frame) + bytes);
  if (whole.size() != sizeof(Frame) + bytes) return std::nullopt;
  Frame frame{};
  std::memcpy(&frame, whole.data(), sizeof frame);
  std::string text = whole.substr(sizeof frame);
  if (frame.bytes != bytes || frame.checksum != checksum(text)) return std::nullopt;
  return text;
}

std::string head_of(const Sweep& sweep, const std::string& program) {
  return json::Value{{"program", program}, {"sweep", to_json(sweep).dump()}}.dump();
}

[[noreturn]] void cannot_write(const std::filesystem::path& path, int code) {
  throw Error(Failure::Output, "to write '" + path.string() + "'", system_words(code),
              code == ENOSPC || code == EDQUOT ? "freeing disk space; what is done is kept"
                                               : "another place for the data set");
}

/// The head's text and where it ends; none for an empty file.
std::optional<std::pair<std::string, uint64_t>> read_head(int file, const std::filesystem::path& path) {
  const std::string start = read_at(file, 0, kMagicBytes + sizeof(Frame));
  if (start.empty()) return std::nullopt;
  const auto refuse = [&](const char* found) -> Error {
    return {Failure::Input, "cases of a data set in '" + path.string() + "'", found, kRemedy};
  };
  if (start.compare(0, kMagicBytes, kMagic, std::min(start.size(), kMagicBytes)) != 0)
    throw refuse("something else");
  // A journal shorter than its head was killed before its first case.
  if (start.size() < kMagicBytes + sizeof(Frame)) return std::nullopt;
  Frame frame{};
  std::memcpy(&frame, start.data() + kMagicBytes, sizeof frame);
  if (frame.bytes > kMostHeadBytes) throw refuse("a damaged header");
  std::optional<std::string> text = record_at(file, kMagicBytes, frame.bytes);
  if (!text) {
    struct stat about {};
    if (::fstat(file, &about) == 0 &&
        static_cast<uint64_t>(about.st_size) < kMagicBytes + sizeof frame + frame.bytes)
      return std::nullopt;
    throw refuse("a damaged header");
  }
  return std::pair{*text, kMagicBytes + sizeof frame + frame.bytes};
}

}  // namespace

Journal::Journal(const std::filesystem::path& path, const Sweep& sweep, const std::string& program)
    : path_(path), sweep_(sweep) {
  file_ = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (file_ < 0) cannot_write(path, errno);
  try {
    if (::flock(file_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)
      throw Error(Failure::Input, "'" + path.string() + "' for this run alone",
                  "another run that works on it", "waiting for it, or another name for the data set");
    const std::string wanted = head_of(sweep, program);
    if (const auto head = read_head(file_, path)) {
      if (head->first != wanted) {
        const Glance other = glance(path);
        throw Error(Failure::Input, "cases of this sweep in '" + path.string() + "'",
                    other.program == program
                        ? "those of another sweep, with seed " + std::to_string(other.sweep.seed) + " and " +
                              std::to_string(other.cases) + " cases done"
                        : "those of " + other.program,
                    "the options that it was begun with, or another name for the data set");
      }
      end_ = head->second;
    } else {
      const std::string start = kMagic + framed(wanted);
      if (::ftruncate(file_, 0) != 0) cannot_write(path, errno);
      if (::pwrite(file_, start.data(), start.size(), 0) != static_cast<ssize_t>(start.size()))
        cannot_write(path, errno != 0 ? errno : ENOSPC);
      end_ = start.size();
    }
    open_and_read();
  } catch (...) {
    ::close(file_);
    throw;
  }
}

Journal::~Journal() {
  if (file_ < 0) return;
  ::fdatasync(file_);
  ::close(file_);
}

// Records have one length, so that a damaged one does not hide those behind it.
void Journal::open_and_read() {
  const size_t bytes = packed_bytes(sweep_), whole = sizeof(Frame) + bytes;
  struct stat about {};
  if (::fstat(file_, &about) != 0) cannot_write(path_, errno);
  const uint64_t size = static_cast<uint64_t>(about.st_size);
  for (; end_ + whole <= size; end_ += whole) {
    const std::optional<std::string> text = record_at(file_, end_, bytes);
    if (!text) {
      ++damaged_;
      continue;
    }
    at_.emplace(unpack(sweep_, *text).what.number, end_);
  }
}

void Journal::append(const std::string& packed) {
  const uint32_t number = unpack(sweep_, packed).what.number;
  if (has(number)) return;
  const std::string record = framed(packed);
  size_t done = 0;
  while (done < record.size()) {
    const ssize_t put =
        ::pwrite(file_, record.data() + done, record.size() - done, static_cast<off_t>(end_ + done));
    if (put < 0 && errno == EINTR) continue;
    if (put < 0) cannot_write(path_, errno);
    done += static_cast<size_t>(put);
  }
  at_.emplace(number, end_);
  end_ += record.size();
  const auto now = std::chrono::steady_clock::now();
  if (now - synced_ < kSyncEvery) return;
  if (::fdatasync(file_) != 0 && errno != EINVAL && errno != EROFS) cannot_write(path_, errno);
  synced_ = now;
}

Sample Journal::read(uint32_t number) const {
  const std::optional<std::string> text = record_at(file_, at_.at(number), packed_bytes(sweep_));
  if (!text)
    throw Error(Failure::Input, "case " + std::to_string(number) + " in '" + path_.string() + "'",
                "other bytes than were written", "the command again; damaged cases are done again");
  return unpack(sweep_, *text);
}

void Journal::remove() {
  ::unlink(path_.c_str());
}

Journal::Glance Journal::glance(const std::filesystem::path& path) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0)
    throw Error(Failure::Input, "cases of a data set in '" + path.string() + "'", system_words(errno),
                kRemedy);
  Glance glance;
  try {
    if (const auto head = read_head(file, path)) {
      const json::Value value = json::parse(head->first);
      glance.program = value.at("program").get<std::string>();
      glance.sweep = sweep_from_json(value.at("sweep").get<std::string>());
      const size_t bytes = packed_bytes(glance.sweep);
      for (uint64_t at = head->second;; at += sizeof(Frame) + bytes) {
        if (read_at(file, at, sizeof(Frame) + bytes).size() != sizeof(Frame) + bytes) break;
        if (record_at(file, at, bytes)) ++glance.cases;
      }
    }
  } catch (const json::Error& error) {
    ::close(file);
    throw Error(Failure::Input, "cases of a data set in '" + path.string() + "'", error.what(), kRemedy);
  } catch (...) {
    ::close(file);
    throw;
  }
  ::close(file);
  return glance;
}

}  // namespace palpate::lump
