#include "capture/video/film_input.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "capture/video/packet.h"

namespace fs = std::filesystem;

namespace palpate {

double ratio(AVRational r) {
  return r.num == 0 || r.den == 0 ? 0 : static_cast<double>(r.num) / r.den;
}

bool is_intra_only(AVCodecID id) {
  const AVCodecDescriptor* codec = avcodec_descriptor_get(id);
  return codec && (codec->props & AV_CODEC_PROP_INTRA_ONLY) != 0;
}

bool reorders(AVCodecID id) {
  const AVCodecDescriptor* codec = avcodec_descriptor_get(id);
  return !codec || (codec->props & AV_CODEC_PROP_REORDER) != 0;
}

bool is_shown(const AVPacket& packet, AVCodecID codec) {
  constexpr uint8_t kVp8Shown = 0x10;
  if (packet.flags & AV_PKT_FLAG_DISCARD) return false;
  return codec != AV_CODEC_ID_VP8 || (packet.data[0] & kVp8Shown) != 0;
}

bool FilmInput::open(const fs::path& file) {
  silence_libav();
  AVFormatContext* opened = nullptr;
  if (avformat_open_input(&opened, ("file:" + file.string()).c_str(), nullptr, nullptr) < 0) return false;
  input_.reset(opened);
  if (avformat_find_stream_info(opened, nullptr) < 0) return false;
  for (unsigned i = 0; i < opened->nb_streams && !stream_; ++i)
    if (opened->streams[i]->codecpar->codec_type == AVMEDIA_TYPE_VIDEO) stream_ = opened->streams[i];
  return stream_ != nullptr && stream_->codecpar->width > 0 && stream_->codecpar->height > 0;
}

bool FilmInput::seek(int64_t tick) {
  return av_seek_frame(input_.get(), stream_->index, tick, AVSEEK_FLAG_BACKWARD) >= 0;
}

double FilmInput::duration_s() const {
  const double whole = static_cast<double>(input_->duration) / AV_TIME_BASE;
  return whole < kLeastRate_Hz ? static_cast<double>(stream_->duration) * ratio(stream_->time_base) : whole;
}

int64_t FilmInput::counted_frames() const {
  int64_t left_out = 0;
  const int entries = avformat_index_get_entries_count(stream_);
  for (int i = 0; i < entries; ++i) {
    const AVIndexEntry* entry = avformat_index_get_entry(stream_, i);
    if (entry && ((entry->flags & AVINDEX_DISCARD_FRAME) || entry->size == 0)) ++left_out;
  }
  // In AVI the table has no entry for the place of a frame that was dropped.
  const bool by_places =
      entries > 0 && std::abs(ratio(stream_->time_base) * ratio(stream_->avg_frame_rate) - 1) < 1e-9;
  const bool reaches_end =
      by_places && avformat_index_get_entry(stream_, entries - 1)->timestamp + 2 >= stream_->nb_frames;
  return entries == stream_->nb_frames || reaches_end ? entries - left_out : stream_->nb_frames;
}

bool FilmInput::read_images(AVPacket& packet) {
  do {
    av_packet_unref(&packet);
    int code = AVERROR(EAGAIN);
    while (code == AVERROR(EAGAIN)) code = av_read_frame(input_.get(), &packet);
    if (code < 0) return false;
  } while (packet.stream_index != stream_->index || packet.size == 0);
  return true;
}

Ticks read_ticks(const fs::path& file) {
  Ticks found;
  FilmInput packets;
  if (!packets.open(file)) return found;
  const PacketPtr packet(av_packet_alloc());
  const AVCodecID codec = packets.stream().codecpar->codec_id;
  bool timed = true;
  int64_t last_dts = INT64_MIN;
  std::optional<int64_t> first_key;
  while (packets.read_images(*packet)) {
    if (!first_key && (packet->flags & AV_PKT_FLAG_KEY)) first_key = packet->pts;  // shown or not
    if (!is_shown(*packet, codec)) continue;
    ++found.frames;
    // Where the order of coding jumps back, so do the times, and they are no way to a frame.
    timed = timed && packet->pts != AV_NOPTS_VALUE && packet->dts >= last_dts;
    last_dts = packet->dts;
    if (!timed) continue;
    found.rising.push_back(packet->pts);
    found.end = std::max(found.end, packet->pts + packet->duration);
  }
  std::vector<int64_t>& rising = found.rising;
  std::ranges::sort(rising);
  for (size_t i = 1; i < rising.size(); ++i)
    found.longest = std::max(found.longest, rising[i] - rising[i - 1]);
  // Frames before the first key frame cannot be decoded.
  if (timed && first_key && !is_intra_only(codec)) {
    rising.erase(rising.begin(), std::ranges::lower_bound(rising, *first_key));
    found.frames = rising.size();
  }
  if (timed && rising.size() > 1 && rising.back() > rising.front())
    found.rate_Hz = static_cast<double>(rising.size() - 1) /
                    (static_cast<double>(rising.back() - rising.front()) * ratio(packets.stream().time_base));
  if (!timed || std::ranges::adjacent_find(rising) != rising.end()) rising.clear();
  return found;
}

}  // namespace palpate
