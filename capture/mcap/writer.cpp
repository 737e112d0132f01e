#include "capture/mcap/writer.h"

#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <concepts>
#include <cstring>
#include <limits>
#include <optional>
#include <vector>

#include "capture/files/output_file.h"
#include "palpate/error.h"
#include "palpate/version.h"

namespace palpate {
namespace {

using Bytes = std::vector<uint8_t>;

constexpr uint8_t kMagic[] = {0x89, 'M', 'C', 'A', 'P', '0', '\r', '\n'};
constexpr size_t kChunkBytes = 1 << 20;
constexpr int64_t kChunk_ns = 400'000'000;
constexpr int kLevel = 1;  // what keeps up with a camera

enum class Opcode : uint8_t {
  Header = 1,
  Footer,
  Schema,
  Channel,
  Message,
  Chunk,
  MessageIndex,
  ChunkIndex,
  Attachment,
  AttachmentIndex,
  Statistics,
  Metadata,
  MetadataIndex,
  SummaryOffset,
  DataEnd,
};

/// Appends records to bytes, little endian.
class Records {
 public:
  explicit Records(Bytes& to) : to_(to) {}
  void begin(Opcode opcode) {
    to_.push_back(static_cast<uint8_t>(opcode));
    length_at_ = to_.size();
    put(uint64_t{0});
  }
  void end() {
    const uint64_t length = to_.size() - length_at_ - sizeof length;
    std::memcpy(to_.data() + length_at_, &length, sizeof length);
  }
  template <typename T>
  requires std::is_arithmetic_v<T>
  void put(T value) { raw(&value, sizeof value); }
  void raw(const void* bytes, size_t count) {
    const auto* from = static_cast<const uint8_t*>(bytes);
    to_.insert(to_.end(), from, from + count);
  }
  void text(std::string_view value) {
    put(static_cast<uint32_t>(value.size()));
    raw(value.data(), value.size());
  }
  void map(const std::map<std::string, std::string>& values) {
    uint32_t bytes = 0;
    for (const auto& [key, value] : values) bytes += static_cast<uint32_t>(8 + key.size() + value.size());
    put(bytes);
    for (const auto& [key, value] : values) {
      text(key);
      text(value);
    }
  }

 private:
  Bytes& to_;
  size_t length_at_ = 0;
};

uint32_t checksum(uint32_t before, std::span<const uint8_t> bytes) {
  return static_cast<uint32_t>(::crc32_z(before, bytes.data(), bytes.size()));
}

}  // namespace

struct McapWriter::Impl {
  struct ChunkEntry {
    int64_t first_ns, last_ns;
    uint64_t at, length, index_length, compressed, uncompressed;
    std::map<uint16_t, uint64_t> index_at;
  };
  struct AttachmentEntry {
    uint64_t at, length, bytes;
    std::string name, media_type;
  };
  struct MetadataEntry {
    uint64_t at, length;
    std::string name;
  };

  LineFile file;
  uint32_t crc = 0;  ///< of the file so far
  Bytes out;         ///< records on their way to the file
  Bytes chunk, packed;
  std::unique_ptr<ZSTD_CCtx, size_t (*)(ZSTD_CCtx*)> zstd{ZSTD_createCCtx(), ZSTD_freeCCtx};
  std::map<uint16_t, std::vector<std::pair<int64_t, uint64_t>>> index;  ///< of the present chunk
  std::optional<int64_t> chunk_since_ns;
  int64_t chunk_first_ns = 0, chunk_last_ns = 0;
  Bytes schemas, channels;  ///< as records, for the summary
  std::map<std::pair<std::string, std::string>, uint16_t> schema_ids;
  uint16_t channel_count = 0;
  std::vector<ChunkEntry> chunks;
  std::vector<AttachmentEntry> attachments;
  std::vector<MetadataEntry> metadata;
  McapCounts counts;

  explicit Impl(const std::filesystem::path& path) : file(path) {}

  uint64_t here() const { return counts.bytes + out.size(); }
  void flush() {
    file.append_bytes(out);
    crc = checksum(crc, out);
    counts.bytes += out.size();
    out.clear();
  }
  void end_chunk();
  void write_summary();
  void write_indices(Records& record);
  void write_statistics(Records& record);
};

void McapWriter::Impl::end_chunk() {
  chunk_since_ns.reset();
  if (chunk.empty()) return;
  packed.resize(ZSTD_compressBound(chunk.size()));
  const size_t size =
      ZSTD_compressCCtx(zstd.get(), packed.data(), packed.size(), chunk.data(), chunk.size(), kLevel);
  if (ZSTD_isError(size))
    throw Error(Failure::Output, "to compress a chunk", ZSTD_getErrorName(size), "more free memory");
  ChunkEntry entry{chunk_first_ns, chunk_last_ns, here(), 0, 0, size, chunk.size(), {}};
  Records record(out);
  record.begin(Opcode::Chunk);
  record.put(chunk_first_ns);
  record.put(chunk_last_ns);
  record.put(uint64_t{chunk.size()});
  record.put(checksum(0, chunk));
  record.text("zstd");
  record.put(uint64_t{size});
  record.raw(packed.data(), size);
  record.end();
  entry.length = here() - entry.at;
  for (auto& [channel, entries] : index) {
    entry.index_at[channel] = here();
    record.begin(Opcode::MessageIndex);
    record.put(channel);
    record.put(static_cast<uint32_t>(16 * entries.size()));
    for (const auto& [stamp_ns, at] : entries) {
      record.put(stamp_ns);
      record.put(at);
    }
    record.end();
  }
  entry.index_length = here() - entry.at - entry.length;
  flush();
  chunks.push_back(std::move(entry));
  chunk.clear();
  index.clear();
}

void McapWriter::Impl::write_statistics(Records& record) {
  record.begin(Opcode::Statistics);
  record.put(counts.all);
  record.put(static_cast<uint16_t>(schema_ids.size()));
  record.put(uint32_t{channel_count});
  record.put(static_cast<uint32_t>(attachments.size()));
  record.put(static_cast<uint32_t>(metadata.size()));
  record.put(static_cast<uint32_t>(chunks.size()));
  record.put(counts.first_ns);
  record.put(counts.last_ns);
  record.put(static_cast<uint32_t>(10 * counts.messages.size()));
  for (const auto& [channel, messages] : counts.messages) {
    record.put(channel);
    record.put(messages);
  }
  record.end();
}

void McapWriter::Impl::write_indices(Records& record) {
  for (const ChunkEntry& entry : chunks) {
    record.begin(Opcode::ChunkIndex);
    record.put(entry.first_ns);
    record.put(entry.last_ns);
    record.put(entry.at);
    record.put(entry.length);
    record.put(static_cast<uint32_t>(10 * entry.index_at.size()));
    for (const auto& [channel, at] : entry.index_at) {
      record.put(channel);
      record.put(at);
    }
    record.put(entry.index_length);
    record.text("zstd");
    record.put(entry.compressed);
    record.put(entry.uncompressed);
    record.end();
  }
}

void McapWriter::Impl::write_summary() {
  Records record(out);
  const uint64_t summary_at = here();
  Bytes offsets;
  Records offset(offsets);
  const auto group = [&](Opcode opcode, const auto& write) {
    const uint64_t from = here();
    write();
    if (here() == from) return;
    offset.begin(Opcode::SummaryOffset);
    offset.put(static_cast<uint8_t>(opcode));
    offset.put(from);
    offset.put(here() - from);
    offset.end();
  };
  group(Opcode::Schema, [&] { record.raw(schemas.data(), schemas.size()); });
  group(Opcode::Channel, [&] { record.raw(channels.data(), channels.size()); });
  group(Opcode::Statistics, [&] { write_statistics(record); });
  group(Opcode::ChunkIndex, [&] { write_indices(record); });
  group(Opcode::AttachmentIndex, [&] {
    for (const AttachmentEntry& entry : attachments) {
      record.begin(Opcode::AttachmentIndex);
      for (const uint64_t value : {entry.at, entry.length, uint64_t{0}, uint64_t{0}, entry.bytes})
        record.put(value);
      record.text(entry.name);
      record.text(entry.media_type);
      record.end();
    }
  });
  group(Opcode::MetadataIndex, [&] {
    for (const MetadataEntry& entry : metadata) {
      record.begin(Opcode::MetadataIndex);
      record.put(entry.at);
      record.put(entry.length);
      record.text(entry.name);
      record.end();
    }
  });
  const uint64_t offsets_at = here();
  record.raw(offsets.data(), offsets.size());
  // The check sum is that of the summary and of the footer before it.
  record.begin(Opcode::Footer);
  record.put(summary_at);
  record.put(offsets_at);
  const size_t crc_at = out.size();
  record.put(uint32_t{0});
  record.end();
  const size_t summary_in_out = summary_at - counts.bytes;
  const uint32_t sum = checksum(0, std::span(out).subspan(summary_in_out, crc_at - summary_in_out));
  std::memcpy(out.data() + crc_at, &sum, sizeof sum);
  record.raw(kMagic, sizeof kMagic);
}

McapWriter::McapWriter(const std::filesystem::path& file, std::string_view profile)
    : impl_(std::make_unique<Impl>(file)) {
  Records record(impl_->out);
  record.raw(kMagic, sizeof kMagic);
  record.begin(Opcode::Header);
  record.text(profile);
  record.text("palpate " PALPATE_VERSION_TEXT);
  record.end();
}

McapWriter::~McapWriter() = default;

uint16_t McapWriter::add_channel(const Topic& topic) {
  Impl& my = *impl_;
  const auto [schema, is_new] = my.schema_ids.try_emplace({topic.schema_name, topic.schema},
                                                          static_cast<uint16_t>(my.schema_ids.size() + 1));
  if (is_new) {
    Bytes bytes;
    Records record(bytes);
    record.begin(Opcode::Schema);
    record.put(schema->second);
    record.text(topic.schema_name);
    record.text(topic.schema_encoding);
    record.text(topic.schema);
    record.end();
    my.schemas.insert(my.schemas.end(), bytes.begin(), bytes.end());
    my.out.insert(my.out.end(), bytes.begin(), bytes.end());
  }
  const uint16_t id = ++my.channel_count;
  Bytes bytes;
  Records record(bytes);
  record.begin(Opcode::Channel);
  record.put(id);
  record.put(schema->second);
  record.text(topic.name);
  record.text(topic.encoding);
  record.map({});
  record.end();
  my.channels.insert(my.channels.end(), bytes.begin(), bytes.end());
  my.out.insert(my.out.end(), bytes.begin(), bytes.end());
  return id;
}

void McapWriter::attach(std::string_view name, std::string_view media_type, std::string_view bytes) {
  Impl& my = *impl_;
  my.end_chunk();
  const uint64_t at = my.here();
  const size_t from = my.out.size() + 9;  // behind opcode and length
  Records record(my.out);
  record.begin(Opcode::Attachment);
  record.put(uint64_t{0});  // times: not stated
  record.put(uint64_t{0});
  record.text(name);
  record.text(media_type);
  record.put(uint64_t{bytes.size()});
  record.raw(bytes.data(), bytes.size());
  record.put(checksum(0, std::span(my.out).subspan(from)));
  record.end();
  my.attachments.push_back({at, my.here() - at, bytes.size(), std::string(name), std::string(media_type)});
  my.flush();
}

void McapWriter::add_metadata(std::string_view name, const std::map<std::string, std::string>& values) {
  Impl& my = *impl_;
  my.end_chunk();
  const uint64_t at = my.here();
  Records record(my.out);
  record.begin(Opcode::Metadata);
  record.text(name);
  record.map(values);
  record.end();
  my.metadata.push_back({at, my.here() - at, std::string(name)});
  my.flush();
}

void McapWriter::write(uint16_t channel, uint32_t sequence, int64_t stamp_ns,
                       std::span<const uint8_t> message) {
  Impl& my = *impl_;
  const bool first = my.chunk.empty();
  my.chunk_first_ns = first ? stamp_ns : std::min(my.chunk_first_ns, stamp_ns);
  my.chunk_last_ns = first ? stamp_ns : std::max(my.chunk_last_ns, stamp_ns);
  my.index[channel].emplace_back(stamp_ns, my.chunk.size());
  Records record(my.chunk);
  record.begin(Opcode::Message);
  record.put(channel);
  record.put(sequence);
  record.put(stamp_ns);
  record.put(stamp_ns);
  record.raw(message.data(), message.size());
  record.end();
  McapCounts& counts = my.counts;
  counts.first_ns = counts.all == 0 ? stamp_ns : std::min(counts.first_ns, stamp_ns);
  counts.last_ns = counts.all == 0 ? stamp_ns : std::max(counts.last_ns, stamp_ns);
  ++counts.all;
  ++counts.messages[channel];
}

void McapWriter::end_chunk_if_due(int64_t now_ns) {
  Impl& my = *impl_;
  if (!my.chunk_since_ns) my.chunk_since_ns = now_ns;
  if (my.chunk.size() >= kChunkBytes || now_ns - *my.chunk_since_ns >= kChunk_ns) my.end_chunk();
}

void McapWriter::sync() {
  impl_->file.sync();
}

void McapWriter::close() {
  Impl& my = *impl_;
  my.end_chunk();
  my.flush();
  Records record(my.out);
  record.begin(Opcode::DataEnd);
  record.put(my.crc);
  record.end();
  my.flush();
  my.write_summary();
  my.flush();
  my.file.close();
}

McapCounts McapWriter::counts() const {
  return impl_->counts;
}

}  // namespace palpate
