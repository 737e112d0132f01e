// One piece of work compiled for several widths of vector units, and the widest that the processor has
// chosen as it runs.
#pragma once

#if defined(__x86_64__) && defined(__GNUC__)
#define PALPATE_WIDE 1
#endif
/// What run() of a work calls must become part of it, or it stays compiled for the narrowest.
#define PALPATE_INLINE inline __attribute__((always_inline))

namespace palpate {
namespace vector_units {

#ifdef PALPATE_WIDE
template <typename Work>
__attribute__((target("avx2,fma"))) void wide(const Work& work) {
  work.run();
}
template <typename Work>
__attribute__((target("avx512f,avx512dq,avx512vl,avx2,fma,prefer-vector-width=512"))) void widest(
    const Work& work) {
  work.run();
}
#endif

}  // namespace vector_units

/// Calls work.run(), which is PALPATE_INLINE and const.
template <typename Work>
void run_widest(const Work& work) {
#ifdef PALPATE_WIDE
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
      __builtin_cpu_supports("avx512vl"))
    return vector_units::widest(work);
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return vector_units::wide(work);
#endif
  work.run();
}

}  // namespace palpate
