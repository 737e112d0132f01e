#include "capture/video/parts.h"

extern "C" __attribute__((visibility("default"))) const palpate::VideoModule* palpate_video_functions() {
  static const palpate::VideoModule functions{&palpate::read_session_video, &palpate::write_session_video,
                                              &palpate::decode_video, &palpate::read_video_packets,
                                              &palpate::encode_video};
  return &functions;
}
