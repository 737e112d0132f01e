// Note of what measures folders of pictures, see separate_presses().
#pragma once

namespace palpate {

inline constexpr const char* kSeparatePictures =
    "pictures without a rate: each is a press of its own (--sequence: they follow each other)";

}  // namespace palpate
