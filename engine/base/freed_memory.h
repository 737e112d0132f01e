// What a program does with memory that it no longer uses.
#pragma once

namespace palpate {

/// Keeps up to 256 MB of freed memory for the next picture instead of giving it back to the system after
/// each: pictures are allocated and freed all the time, and the system clears every page that it hands out
/// anew. For a program's main function, before its first thread; a library leaves its host's memory alone.
/// Nothing happens with another C library than glibc.
void keep_freed_memory();

}  // namespace palpate
