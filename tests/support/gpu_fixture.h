// A Vulkan context with the validation layer on, shared by the tests of one process; any message fails the
// test.
#pragma once

#include <gtest/gtest.h>

#include "engine/gpu/context.h"

namespace palpate {

class GpuTest : public testing::Test {
 protected:
  static gpu::Context& context() {
    static gpu::Context shared([] {
      gpu::ContextOptions options;
      options.validation = true;
      options.timers = true;
      return options;
    }());
    return shared;
  }
  void SetUp() override { seen_ = context().validation_messages().size(); }
  void TearDown() override {
    const auto messages = context().validation_messages();
    for (size_t i = seen_; i < messages.size(); ++i) ADD_FAILURE() << "validation: " << messages[i];
  }

 private:
  size_t seen_ = 0;
};

}  // namespace palpate
