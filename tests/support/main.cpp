// The main function of all test programs.
#include <gtest/gtest.h>

#include "engine/base/freed_memory.h"

int main(int argc, char** argv) {
  palpate::keep_freed_memory();  // as the programs do
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
