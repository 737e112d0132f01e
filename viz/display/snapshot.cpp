#include "viz/display/snapshot.h"

#include "capture/files/images/images.h"
#include "capture/files/output_file.h"
#include "viz/display/picture.h"
#include "viz/render/format.h"

namespace palpate::viz {

std::filesystem::path next_snapshot(const std::filesystem::path& folder, int& number) {
  std::filesystem::path stem;
  do {
    stem = folder / text("palpate-%04d", ++number);
  } while (std::filesystem::exists(stem.string() + ".png") ||
           std::filesystem::exists(stem.string() + ".csv"));
  return stem;
}

void write_snapshot(const Snapshot& snapshot, const std::filesystem::path& stem) {
  make_output_folder(stem.has_parent_path() ? stem.parent_path() : ".");
  write_png(snapshot.picture, stem.string() + ".png");
  write_whole(stem.string() + "-frame.png", encode_image(snapshot.frame, ".png"));
  write_whole(stem.string() + ".csv",
              Measurements::header(snapshot.columns) + "\n" +
                  Measurements::row(snapshot.touch, snapshot.columns, Digits::Deserved) + "\n");
}

}  // namespace palpate::viz
