// The Vulkan device that all streams and solves of a process share.
#pragma once

#include <memory>
#include <string>

#include "engine/gpu/context.h"

namespace palpate::python {

/// Opened when first asked for, by any thread; `which` as in Device. Throws Refusal in a process that was
/// forked after one was opened.
std::shared_ptr<gpu::Context> shared_device(const std::string& which);
/// Who asks next gets another one; streams that still use the lost one keep it.
void forget_device(const gpu::Context& lost);
/// At the interpreter's end; streams that still live keep theirs.
void close_devices();
/// Whether this process is a fork of the one that opened a device: nothing of it can be used.
bool forked();

}  // namespace palpate::python
