#include "viz/display/recording_pictures.h"

#include <optional>

namespace palpate::viz {
namespace {

class DrawnRecording : public RecordingPictures {
 public:
  DrawnRecording(gpu::Context& context, const PictureSetting& setting, const PictureOptions& look)
      : setting_(setting), renderer_(context, setting.sensor, look_of(setting, look), &setting.background) {}

  void follow(const Touch& touch) override { renderer_.follow(touch); }

  void draw(const Frame& frame, const Touch& touch, const Result& result, const std::filesystem::path& png,
            bool to_film) override {
    const RgbImage image = renderer_.render(frame, touch, result);
    if (!png.empty()) write_png(image, png);
    if (!to_film) return;
    if (!film_) film_.emplace(setting_.film, image.width, image.height, setting_.film_rate_Hz);
    film_->add(image);
  }

  void finish() override {
    if (film_) film_->finish();
  }

 private:
  static PictureOptions look_of(const PictureSetting& setting, PictureOptions look) {
    look.separate = setting.separate;
    return look;
  }

  PictureSetting setting_;
  PictureRenderer renderer_;
  std::optional<Film> film_;
};

}  // namespace

std::function<std::unique_ptr<RecordingPictures>(gpu::Context&, const PictureSetting&)> recording_pictures(
    const PictureOptions& look) {
  return [look](gpu::Context& context, const PictureSetting& setting) {
    return std::make_unique<DrawnRecording>(context, setting, look);
  };
}

}  // namespace palpate::viz
