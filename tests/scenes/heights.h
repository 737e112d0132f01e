// Ground truth of surface reconstruction; `palpate profile` measures its errors on the same surfaces.
#pragma once

#include "capture/synthetic/heights.h"  // IWYU pragma: export
