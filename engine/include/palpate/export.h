// PALPATE_API: symbols that programs outside may link to; everything else, and PALPATE_HIDDEN parts of it,
// stays inside libpalpate.
#pragma once

#if defined(__GNUC__)
#define PALPATE_API __attribute__((visibility("default")))
#define PALPATE_HIDDEN __attribute__((visibility("hidden")))
#else
#define PALPATE_API
#define PALPATE_HIDDEN
#endif
