// Interface of the failing layer to a test in the same process, by dlopen of the file that the loader has
// loaded too.
#pragma once

#include <vulkan/vulkan.h>

#include <cstdint>

extern "C" {

/// From now on the `at`-th call (from 1; 0: none) of the Vulkan function `call` ("": of any that may fail)
/// fails: submissions and waits find the device lost or, with `device_lost` false, no memory, as all others
/// do.
void palpate_layer_arm(const char* call, uint64_t at, bool device_lost);
/// Calls that counted since it was armed.
uint64_t palpate_layer_calls();
/// Name of the call that failed, "" if none did.
const char* palpate_layer_failed();
/// Vulkan objects and memory created and not destroyed.
int64_t palpate_layer_live();

VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL palpate_layer_device_proc(VkDevice device, const char* name);
VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL palpate_layer_instance_proc(VkInstance instance, const char* name);
}
