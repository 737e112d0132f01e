// The truths that surface reconstruction is held against are also what `palpate profile` measures its errors
// on.
#pragma once

#include "capture/synthetic/heights.h"  // IWYU pragma: export
