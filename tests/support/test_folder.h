// A folder of its own for each test.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <string>

namespace palpate {

/// New and empty. `kind`: of the tests, in its name.
inline std::filesystem::path test_folder(const std::string& kind) {
  std::string name = testing::UnitTest::GetInstance()->current_test_info()->name();
  std::replace(name.begin(), name.end(), '/', '-');  // tests with parameters have one
  std::filesystem::path folder = std::filesystem::temp_directory_path() /
                                 ("palpate-" + kind + "-" + std::to_string(getpid()) + "-" + name);
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  return folder;
}

}  // namespace palpate
