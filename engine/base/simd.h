// One piece of work compiled for several widths of vector units, and the widest that the processor has
// chosen as it runs.
#pragma once

#if defined(__x86_64__) && defined(__GNUC__)
#define PALPATE_WIDE 1
#define PALPATE_AVX2 __attribute__((target("avx2,fma")))
#define PALPATE_AVX512 __attribute__((target("avx512f,avx512vl,avx2,fma")))
/// Registers of 512 bits also where the compiler would take 256.
#ifdef __clang__
#define PALPATE_AVX512_FULL \
  __attribute__((target("avx512f,avx512dq,avx512vl,avx2,fma"), min_vector_width(512)))
#else
#define PALPATE_AVX512_FULL \
  __attribute__((target("avx512f,avx512dq,avx512vl,avx2,fma,prefer-vector-width=512")))
#endif
#endif
/// Before a loop whose rounds do not depend on each other, whatever its pointers look like.
#ifdef __clang__
#define PALPATE_INDEPENDENT _Pragma("clang loop vectorize(assume_safety)")
#else
#define PALPATE_INDEPENDENT _Pragma("GCC ivdep")
#endif
/// Functions that a work's run() calls must be inlined into it, or they stay compiled for the narrowest
/// vectors.
#define PALPATE_INLINE inline __attribute__((always_inline))

namespace palpate {
namespace vector_units {

#ifdef PALPATE_WIDE
/// The processor has what PALPATE_AVX2, PALPATE_AVX512 and PALPATE_AVX512_FULL are compiled for.
inline bool avx2() {
  return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
}
inline bool avx512() {
  return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl");
}
inline bool avx512_full() {
  return avx512() && __builtin_cpu_supports("avx512dq");
}

template <typename Work>
PALPATE_AVX2 void wide(const Work& work) {
  work.run();
}
template <typename Work>
PALPATE_AVX512_FULL void widest(const Work& work) {
  work.run();
}
#endif

}  // namespace vector_units

/// Calls work.run(), which is PALPATE_INLINE and const.
template <typename Work>
void run_widest(const Work& work) {
#ifdef PALPATE_WIDE
  if (vector_units::avx512_full()) return vector_units::widest(work);
  if (vector_units::avx2()) return vector_units::wide(work);
#endif
  work.run();
}

}  // namespace palpate
