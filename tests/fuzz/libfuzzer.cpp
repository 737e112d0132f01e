// libFuzzer's entry to one reader, PALPATE_READER.
#include <unistd.h>

#include <cstdio>
#include <cstdlib>

#include "capture/video/module.h"
#include "engine/base/module.h"
#include "tests/fuzz/readers.h"

extern "C" const palpate::VideoModule* palpate_video_functions();

namespace palpate {

/// The part for videos, which the program opens when it needs it, is linked here.
void* module_function(const std::string&, const char*, const std::string&) {
  return reinterpret_cast<void*>(&palpate_video_functions);
}

}  // namespace palpate

namespace fs = std::filesystem;
using palpate::fuzz::Reader;

namespace {

const Reader& chosen() {
  static const Reader& reader = palpate::fuzz::reader(PALPATE_READER);
  return reader;
}

/// A folder of this process alone, removed at its end.
struct Folder {
  fs::path path = fs::temp_directory_path() / ("palpate-fuzz-" + std::to_string(::getpid()));
  Folder() { fs::create_directories(path); }
  ~Folder() {
    std::error_code ignored;
    fs::remove_all(path, ignored);
  }
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* bytes, size_t count) {
  static const Folder folder;
  const std::string trouble = palpate::fuzz::trouble_of(chosen(), {bytes, count}, folder.path);
  if (trouble.empty()) return 0;
  std::fprintf(stderr, "palpate: %s\n", trouble.c_str());
  std::abort();
}

#ifdef PALPATE_CHECK_SUMS
extern "C" size_t LLVMFuzzerMutate(uint8_t* bytes, size_t count, size_t most);

extern "C" size_t LLVMFuzzerCustomMutator(uint8_t* bytes, size_t count, size_t most, unsigned seed) {
  const size_t changed = LLVMFuzzerMutate(bytes, count, most);
  constexpr unsigned kWrongOneIn = 16;
  if (seed % kWrongOneIn != 0) chosen().mend({bytes, changed});
  return changed;
}
#endif
