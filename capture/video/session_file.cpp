#include "capture/video/session_file.h"

extern "C" {
#include <libavutil/intreadwrite.h>
}

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <string_view>

#include "palpate/error.h"

namespace fs = std::filesystem;

namespace palpate {
namespace {

using Bytes = std::span<const uint8_t>;

// Matroska's names of its elements.
constexpr uint32_t kSegment = 0x18538067, kTracks = 0x1654AE6B, kTags = 0x1254C367, kCluster = 0x1F43B675,
                   kCues = 0x1C53BB6B, kSeekId = 0x53AB, kSeekPosition = 0x53AC, kCrc32 = 0xBF, kVoid = 0xEC;
constexpr uint32_t kTrackEntry = 0xAE, kCodecId = 0x86, kCodecPrivate = 0x63A2, kVideo = 0xE0, kWidth = 0xB0,
                   kHeight = 0xBA;
constexpr uint32_t kTag = 0x7373, kSimpleTag = 0x67C8, kTagName = 0x45A3, kTagString = 0x4487;
constexpr uint32_t kTimecode = 0xE7, kBlockGroup = 0xA0, kBlock = 0xA1, kBlockAdditions = 0x75A1,
                   kBlockMore = 0xA6, kBlockAdditional = 0xA5;
constexpr uint32_t kCuePoint = 0xBB, kCueTrackPositions = 0xB7, kCueClusterPosition = 0xF1;

constexpr size_t kMostHeader_bytes = 12;  ///< of an element
constexpr size_t kBlockHeader_bytes = 4;  ///< track, time, flags
constexpr uint8_t kLacing = 0x06;
constexpr size_t kBitmapInfo_bytes = 40;    ///< before the codec's parameters, in Microsoft's way
constexpr uint32_t kHeadMark = 0x48504C50;  // "PLPH", little endian
constexpr size_t kHeadFixed_bytes = 6 * 4;  ///< mark, check sum, bytes after it, width, height, parameters
constexpr size_t kHeadChecked_at = 2 * 4;
constexpr size_t kChunk_bytes = 1 << 20;
constexpr uint64_t kMostStart_bytes = 64 << 20;

struct Element {
  uint32_t id = 0;
  size_t begin = 0;  ///< of its content
  uint64_t count = 0;
};

/// Name and length at the start of `bytes`, however long the content; id 0 where there are none.
Element element_at(Bytes bytes) {
  if (bytes.empty() || bytes[0] < 0x10) return {};
  Element element;
  size_t at = 0;
  for (uint8_t mark = 0x80; !(bytes[0] & mark); mark = static_cast<uint8_t>(mark >> 1)) ++at;
  const size_t id_bytes = at + 1;
  if (bytes.size() <= id_bytes || bytes[id_bytes] == 0) return {};
  for (at = 0; at < id_bytes; ++at) element.id = element.id << 8 | bytes[at];
  size_t count_bytes = 1;
  for (uint8_t mark = 0x80; !(bytes[at] & mark); mark = static_cast<uint8_t>(mark >> 1)) ++count_bytes;
  if (bytes.size() < at + count_bytes) return {};
  const uint64_t most = (uint64_t{1} << (7 * count_bytes)) - 1;
  for (size_t i = 0; i < count_bytes; ++i) element.count = element.count << 8 | bytes[at + i];
  element.count &= most;
  if (element.count == most) return {};  // "not known"
  element.begin = at + count_bytes;
  return element;
}

/// Calls `visit(id, content)` for each element in `content`, as far as they are whole; false where that is
/// not to its end.
template <typename Visit>
bool each_in(Bytes content, Visit&& visit) {
  while (!content.empty()) {
    const Element element = element_at(content);
    if (element.id == 0 || element.count > content.size() - element.begin) return false;
    visit(element.id, content.subspan(element.begin, static_cast<size_t>(element.count)));
    content = content.subspan(element.begin + static_cast<size_t>(element.count));
  }
  return true;
}

uint64_t number_in(Bytes content) {
  uint64_t number = 0;
  for (const uint8_t byte : content) number = number << 8 | byte;
  return number;
}

bool starts_with(Bytes bytes, uint32_t id) {
  return bytes.size() >= 4 && AV_RB32(bytes.data()) == id;
}

/// Content of the first element of that name of four bytes; empty where its check sum is wrong or it does not
/// fit. An element without a sum is believed.
Bytes find_checked(Bytes bytes, uint32_t id) {
  for (; bytes.size() >= kMostHeader_bytes; bytes = bytes.subspan(1)) {
    if (!starts_with(bytes, id)) continue;
    const Element found = element_at(bytes);
    if (found.id == 0 || found.count > bytes.size() - found.begin) continue;
    const Bytes content = bytes.subspan(found.begin, static_cast<size_t>(found.count));
    const Element sum = element_at(content);
    if (sum.id != kCrc32) return content;
    const Bytes rest = content.subspan(std::min(content.size(), sum.begin + 4));
    if (sum.count == 4 && !rest.empty() && AV_RL32(content.data() + sum.begin) == crc_of(rest))
      return content;
  }
  return {};
}

/// The head that spare_head wrote, somewhere in `bytes`.
bool find_spare(Bytes bytes, VideoHead& head) {
  for (; bytes.size() >= kHeadFixed_bytes; bytes = bytes.subspan(1)) {
    if (AV_RL32(bytes.data()) != kHeadMark) continue;
    const uint64_t count = AV_RL32(bytes.data() + 8), parameters = AV_RL32(bytes.data() + 20);
    if (count > bytes.size() - kHeadFixed_bytes || parameters > count ||
        AV_RL32(bytes.data() + 4) !=
            crc_of(bytes.subspan(kHeadChecked_at, kHeadFixed_bytes - kHeadChecked_at + count)))
      continue;
    const Bytes rest = bytes.subspan(kHeadFixed_bytes, count), codec = rest.first(parameters),
                text = rest.subspan(parameters);
    head.width = AV_RL32(bytes.data() + 12);
    head.height = AV_RL32(bytes.data() + 16);
    head.codec_private.assign(codec.begin(), codec.end());
    head.text.assign(text.begin(), text.end());
    return true;
  }
  return false;
}

void read_tracks(Bytes tracks, VideoHead& head) {
  each_in(tracks, [&](uint32_t id, Bytes entry) {
    if (id != kTrackEntry) return;
    size_t skipped = 0;
    each_in(entry, [&](uint32_t part, Bytes content) {
      constexpr std::string_view kMicrosoft = "V_MS/VFW/FOURCC";
      if (part == kCodecId &&
          std::equal(content.begin(), content.end(), kMicrosoft.begin(), kMicrosoft.end()))
        skipped = kBitmapInfo_bytes;
      if (part == kCodecPrivate) head.codec_private.assign(content.begin(), content.end());
      if (part != kVideo) return;
      each_in(content, [&](uint32_t side, Bytes number) {
        if (side == kWidth) head.width = static_cast<uint32_t>(number_in(number));
        if (side == kHeight) head.height = static_cast<uint32_t>(number_in(number));
      });
    });
    std::vector<uint8_t>& codec = head.codec_private;
    codec.erase(codec.begin(), codec.begin() + static_cast<std::ptrdiff_t>(std::min(skipped, codec.size())));
  });
}

void read_tags(Bytes tags, VideoHead& head) {
  each_in(tags, [&](uint32_t id, Bytes tag) {
    if (id != kTag) return;
    each_in(tag, [&](uint32_t part, Bytes simple) {
      if (part != kSimpleTag) return;
      std::string name, text;
      each_in(simple, [&](uint32_t of, Bytes content) {
        if (of == kTagName) name.assign(content.begin(), content.end());
        if (of == kTagString) text.assign(content.begin(), content.end());
      });
      if (name == kSessionTag) head.text = text;
    });
  });
}

}  // namespace

std::vector<uint8_t> spare_head(const VideoHead& head) {
  const size_t after = head.codec_private.size() + head.text.size();
  std::vector<uint8_t> bytes(1 + 8 + kHeadFixed_bytes + after);
  bytes[0] = kVoid;
  AV_WB64(&bytes[1], uint64_t{1} << 56 | (kHeadFixed_bytes + after));
  uint8_t* fixed = &bytes[1 + 8];
  AV_WL32(fixed, kHeadMark);
  AV_WL32(fixed + 8, static_cast<uint32_t>(after));
  AV_WL32(fixed + 12, head.width);
  AV_WL32(fixed + 16, head.height);
  AV_WL32(fixed + 20, static_cast<uint32_t>(head.codec_private.size()));
  std::copy(head.text.begin(), head.text.end(),
            std::copy(head.codec_private.begin(), head.codec_private.end(), fixed + kHeadFixed_bytes));
  AV_WL32(&bytes[1 + 8 + 4], crc_of(Bytes(bytes).subspan(1 + 8 + kHeadChecked_at)));
  return bytes;
}

SessionFile::SessionFile(const fs::path& file) {
  const auto refuse = [&](const std::string& why) {
    if (file_ >= 0) ::close(file_);
    throw Error(Failure::Input, "frames of a session in '" + file.string() + "'", why, "another session");
  };
  file_ = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (file_ < 0) refuse(errno == EACCES ? "no permission to read it" : "no file that can be read");
  struct stat found {};
  if (::fstat(file_, &found) == 0 && S_ISREG(found.st_mode)) bytes_ = static_cast<uint64_t>(found.st_size);
  read_start();
  if (!head_.text.empty() || !find_checked(start_, kTracks).empty()) {
    // Another's video has clusters without records.
    VideoBlock block;
    if (head_.text.empty() && !read(pass_damage(0).next, block))
      refuse("a video that is no recorded session's");
  } else if (pass_damage(0).next == bytes_) {
    refuse("none: it ends before its first frame, or its header is damaged");
  }
}

SessionFile::~SessionFile() {
  ::close(file_);
}

std::vector<uint8_t> SessionFile::bytes_at(uint64_t begin, uint64_t count) const {
  std::vector<uint8_t> bytes(static_cast<size_t>(std::min(count, bytes_ - std::min(bytes_, begin))));
  size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t n =
        ::pread(file_, bytes.data() + done, bytes.size() - done, static_cast<off_t>(begin + done));
    if (n == 0 || (n < 0 && errno != EINTR)) break;
    if (n > 0) done += static_cast<size_t>(n);
  }
  bytes.resize(done);
  return bytes;
}

void SessionFile::read_start() {
  constexpr std::array<uint8_t, 4> kId{kCluster >> 24, kCluster >> 16 & 0xFF, kCluster >> 8 & 0xFF,
                                       kCluster & 0xFF};
  auto cluster = start_.end();
  while (cluster == start_.end() && start_.size() < std::min(bytes_, kMostStart_bytes)) {
    const std::vector<uint8_t> more = bytes_at(start_.size(), kChunk_bytes);
    if (more.empty()) break;
    start_.insert(start_.end(), more.begin(), more.end());
    cluster = std::search(start_.begin(), start_.end(), kId.begin(), kId.end());
  }
  start_.erase(cluster, start_.end());
  if (find_spare(start_, head_)) return;
  read_tracks(find_checked(start_, kTracks), head_);
  read_tags(find_checked(start_, kTags), head_);
}

bool SessionFile::read(uint64_t begin, VideoBlock& block) {
  const Element cluster = element_at(bytes_at(begin, kMostHeader_bytes));
  if (cluster.id != kCluster || cluster.count > most_bytes_ ||
      cluster.count > bytes_ - std::min(bytes_, begin + cluster.begin))
    return false;
  cluster_ = bytes_at(begin + cluster.begin, cluster.count);
  Bytes data, record;
  bool ours = true;  // a wrong length may take in the next frame
  const bool filled = each_in(cluster_, [&](uint32_t id, Bytes group) {
    ours = ours && (id == kCrc32 || id == kTimecode || id == kBlockGroup);
    if (id != kBlockGroup) return;
    each_in(group, [&](uint32_t part, Bytes content) {
      if (part == kBlock && content.size() > kBlockHeader_bytes && !(content[3] & kLacing))
        data = content.subspan(kBlockHeader_bytes);
      if (part != kBlockAdditions) return;
      each_in(content, [&](uint32_t addition, Bytes more) {
        if (addition != kBlockMore) return;
        each_in(more, [&](uint32_t of, Bytes added) {
          if (of == kBlockAdditional) record = added;
        });
      });
    });
  });
  if (!ours || !filled) return false;
  const std::optional<PacketRecord> found = find_record(record, data);
  if (!found) return false;
  block = {begin, begin + cluster.begin + cluster.count, *found, data};
  return true;
}

SessionFile::Gap SessionFile::pass_damage(uint64_t begin) {
  Gap gap{.next = bytes_, .damaged = 0};
  bool open = false;  // a cluster began whose record was not met
  VideoBlock block;
  for (uint64_t base = begin; base < bytes_ && gap.next == bytes_; base += kChunk_bytes) {
    const std::vector<uint8_t> chunk = bytes_at(base, kChunk_bytes + kRecord_bytes);
    for (size_t i = 0; i < std::min(chunk.size(), kChunk_bytes); ++i) {
      const Bytes rest = Bytes(chunk).subspan(i);
      if (starts_with(rest, kCluster)) {
        const uint64_t at = base + i;
        if (read(at, block)) {
          gap.next = at;
          break;
        }
        const Element cluster = element_at(rest);
        if (cluster.id == 0 || cluster.count > bytes_ - std::min(bytes_, at + cluster.begin)) continue;
        gap.damaged += open ? 1 : 0;
        open = true;
      } else if (is_record(rest)) {
        ++gap.damaged;
        open = false;
      }
    }
  }
  gap.damaged += open ? 1 : 0;
  return gap;
}

std::vector<uint64_t> SessionFile::index() const {
  const Bytes start(start_);
  uint64_t segment = 0, cues = 0;
  for (size_t at = 0; at + kMostHeader_bytes < start.size() && cues == 0; ++at) {
    // The segment's length is not known before its end is written.
    if (segment == 0 && starts_with(start.subspan(at), kSegment)) segment = at + 4 + 8;
    uint32_t wanted = 0;
    if (start[at] != kSeekId >> 8) continue;
    each_in(start.subspan(at, std::min<size_t>(start.size() - at, 24)), [&](uint32_t id, Bytes content) {
      if (id == kSeekId) wanted = static_cast<uint32_t>(number_in(content));
      if (id == kSeekPosition && wanted == kCues && cues == 0) cues = segment + number_in(content);
    });
  }
  if (segment == 0 || cues == 0 || cues >= bytes_) return {};
  const std::vector<uint8_t> tail = bytes_at(cues, std::min<uint64_t>(bytes_ - cues, uint64_t{1} << 30));
  if (!starts_with(tail, kCues)) return {};
  std::vector<uint64_t> begins;
  each_in(find_checked(tail, kCues), [&](uint32_t id, Bytes point) {
    if (id != kCuePoint) return;
    each_in(point, [&](uint32_t part, Bytes positions) {
      if (part != kCueTrackPositions) return;
      each_in(positions, [&](uint32_t of, Bytes number) {
        if (of == kCueClusterPosition) begins.push_back(segment + number_in(number));
      });
    });
  });
  return begins;
}

}  // namespace palpate
