#include "viz/render/fonts.h"

#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <utility>

#include "viz/look/measures.h"

namespace palpate::viz {
namespace {

// As Debian and others install them; looked for when the window opens.
constexpr const char* kFaces[] = {
    "/usr/share/fonts/opentype/inter/Inter-Regular.otf", "/usr/share/fonts/inter/Inter-Regular.otf",
    "/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf", "/usr/share/fonts/TTF/DejaVuSans.ttf"};
constexpr const char* kIconFaces[] = {"/usr/share/fonts/truetype/font-awesome/fontawesome-webfont.ttf",
                                      "/usr/share/fonts/fontawesome/fontawesome-webfont.ttf"};

// Places in Font Awesome 4.
constexpr std::pair<std::string_view, ImWchar> kIcons[] = {
    {"Pause", 0xF04C},    {"Continue", 0xF04B},    {"Record", 0xF111},     {"Stop", 0xF04D},
    {"Snapshot", 0xF030}, {"Zero", 0xF05B},        {"End zero", 0xF0E2},   {"Mark", 0xF024},
    {"Text", 0xF040},     {"Sources", 0xF07C},     {"View", 0xF0B2},       {"Sensor", 0xF2DB},
    {"Settings", 0xF013}, {"Help", 0xF059},        {"Find", 0xF002},       {"Step back", 0xF048},
    {"Step on", 0xF051},  {"Slower", 0xF04A},      {"Faster", 0xF04E},     {"No loop", 0xF00D},
    {"Largest", 0xF148},  {"Mark before", 0xF060}, {"Mark after", 0xF061}, {"Pictures", 0xF0DB}};

template <size_t Count>
const char* installed(const char* const (&files)[Count]) {
  const auto* const found =
      std::ranges::find_if(files, [](const char* file) { return std::filesystem::exists(file); });
  return found == std::end(files) ? nullptr : *found;
}

ImFont* add_face(ImFontAtlas& atlas, const char* face, float size_px) {
  static const ImWchar kRanges[] = {0x20, 0xFF, 0x2190, 0x2193, 0};
  if (face)
    if (ImFont* font = atlas.AddFontFromFileTTF(face, size_px, nullptr, kRanges)) return font;
  ImFontConfig config;  // ImGui's own: plain, but complete
  config.SizePixels = size_px;
  return atlas.AddFontDefault(&config);
}

/// Into the font that was added last.
void add_icons(ImFontAtlas& atlas, const char* face, float size_px) {
  static const ImVector<ImWchar> ranges = [] {
    ImFontGlyphRangesBuilder builder;
    for (const auto& [word, place] : kIcons) builder.AddChar(place);
    ImVector<ImWchar> made;
    builder.BuildRanges(&made);
    return made;
  }();
  ImFontConfig config;
  config.MergeMode = true;
  config.PixelSnapH = true;
  config.GlyphMinAdvanceX = 1.2f * size_px;  // words behind them begin at one place
  atlas.AddFontFromFileTTF(face, size_px, &config, ranges.Data);
}

}  // namespace

Fonts add_fonts(ImFontAtlas& atlas, float scale) {
  const char *const face = installed(kFaces), *const icons = installed(kIconFaces);
  const auto size = [scale](float px) { return std::max(6.0f, std::round(px * scale)); };
  Fonts fonts;
  fonts.body = add_face(atlas, face, size(kBody_px));
  if (icons) add_icons(atlas, icons, size(kBody_px));
  fonts.small = add_face(atlas, face, size(kSmall_px));
  fonts.large = add_face(atlas, face, size(kHeadline_px));
  return fonts;
}

void make_figures_tabular(ImFontAtlas& atlas) {
  constexpr std::string_view kFigures = "0123456789";
  for (ImFont* font : atlas.Fonts) {
    float width = 0;
    for (const char figure : kFigures)
      width = std::max(width, font->GetCharAdvance(static_cast<ImWchar>(figure)));
    for (ImFontGlyph& glyph : font->Glyphs) {
      if (glyph.Codepoint > 0x7F || kFigures.find(static_cast<char>(glyph.Codepoint)) == kFigures.npos)
        continue;
      const float shift = std::round((width - glyph.AdvanceX) / 2);
      glyph.X0 += shift;
      glyph.X1 += shift;
      glyph.AdvanceX = font->IndexAdvanceX[static_cast<int>(glyph.Codepoint)] = width;
    }
  }
}

std::string icon_of(std::string_view word) {
  word = word.substr(0, word.find("##"));
  const auto* const found =
      std::ranges::find_if(kIcons, [word](const auto& icon) { return icon.first == word; });
  if (found == std::end(kIcons) || !ImGui::GetFont()->FindGlyphNoFallback(found->second)) return {};
  const unsigned place = found->second;  // three bytes, as all from 0x800 to 0xFFFF
  return {static_cast<char>(0xE0 | place >> 12), static_cast<char>(0x80 | (place >> 6 & 0x3F)),
          static_cast<char>(0x80 | (place & 0x3F))};
}

}  // namespace palpate::viz
