// Fields of the live window that letters are typed in.
#pragma once

#include "viz/render/layout.h"
#include "viz/render/view_state.h"

namespace palpate::viz {

/// A field that has the keyboard from its first picture on; letters that come before it takes them wait.
void text_field(const char* id, const char* hint, TypedText& typed);

/// Where the text of an event is typed.
void label_window(const ViewRect& around, float scale, ViewState& state);
/// That text is done: the event is marked with it, or it is forgotten.
void end_labelling(ViewState& state, bool mark);

}  // namespace palpate::viz
