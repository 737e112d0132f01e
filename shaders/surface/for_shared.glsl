// The workgroup's loop over `count` things; all invocations make the same number of turns.
#define FOR_SHARED(n, count) \
  for (int turn = 0, n = int(gl_LocalInvocationIndex); turn < (count); turn += int(gl_WorkGroupSize.x), n += int(gl_WorkGroupSize.x)) \
    if (n < (count))
