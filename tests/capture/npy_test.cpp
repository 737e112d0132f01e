// Arrays written and read back, and a reader that survives any file.
#include "capture/files/npy.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstring>
#include <fstream>
#include <random>

#include "palpate/error.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

class Npy : public testing::Test {
 protected:
  void SetUp() override {
    file_ =
        fs::temp_directory_path() / ("palpate-npy-" + std::to_string(getpid()) + "-" +
                                     testing::UnitTest::GetInstance()->current_test_info()->name() + ".npy");
  }
  void TearDown() override { fs::remove(file_); }
  void spill(const std::string& bytes) { std::ofstream(file_, std::ios::binary | std::ios::trunc) << bytes; }
  std::string slurp() {
    std::ifstream in(file_, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  fs::path file_;
};

std::string with_header(int version, const std::string& header, const std::string& body) {
  std::string file("\x93NUMPY", 6);
  file += static_cast<char>(version);
  file += '\0';
  const auto bytes = static_cast<uint32_t>(header.size());
  const char* length = reinterpret_cast<const char*>(&bytes);
  file.append(length, version == 1 ? 2 : 4);
  return file + header + body;
}

TEST_F(Npy, RoundTrip) {
  std::mt19937 random(1);
  std::normal_distribution<float> value;
  for (const std::vector<size_t>& shape : {std::vector<size_t>{1}, {7}, {3, 5}, {4, 6, 2}, {1, 1, 1, 9}}) {
    size_t count = 1;
    for (const size_t size : shape) count *= size;
    std::vector<float> values(count);
    for (float& v : values) v = value(random);
    write_npy(file_, values, shape);
    const NpyArray array = read_npy(file_);
    EXPECT_EQ(array.shape, shape);
    EXPECT_EQ(array.values, values);
    EXPECT_EQ((slurp().size() - 4 * count) % 64, 0u) << "values are aligned as NumPy aligns them";
  }
}

TEST_F(Npy, WhatNumPyWrites) {
  const double doubles[] = {1.5, -2.25, 1e300, 4};
  const std::string body(reinterpret_cast<const char*>(doubles), 16);
  spill(with_header(1, "{'descr': '<f8', 'fortran_order': False, 'shape': (2,), }      \n", body));
  EXPECT_EQ(read_npy(file_).values, (std::vector<float>{1.5f, -2.25f}));
  spill(with_header(2, "{'shape':(1,2),'descr':'<f8','fortran_order':False}\n", body));
  EXPECT_EQ(read_npy(file_).shape, (std::vector<size_t>{1, 2}));
  spill(with_header(3, "{'descr': '<f8', 'fortran_order': False, 'shape': (4,), }\n",
                    std::string(reinterpret_cast<const char*>(doubles), 32)));
  EXPECT_THROW(read_npy(file_), Error) << "1e300 does not fit float32";
}

TEST_F(Npy, DamagedFilesAreErrorsNeverMore) {
  const std::vector<float> values(24, 1.0f);
  write_npy(file_, values, {4, 3, 2});
  const std::string whole = slurp();
  for (size_t length = 0; length < whole.size(); ++length) {
    spill(whole.substr(0, length));
    EXPECT_THROW(read_npy(file_), Error) << "cut to " << length << " bytes";
  }
  spill(whole + "x");
  EXPECT_THROW(read_npy(file_), Error) << "a byte too many";
  std::mt19937 random(2);
  for (int trial = 0; trial < 3000; ++trial) {
    std::string damaged = whole;
    for (int change = 0; change < 1 + trial % 4; ++change)
      damaged[random() % 128] = static_cast<char>(random());
    spill(damaged);
    try {
      const NpyArray array = read_npy(file_);
      size_t count = 1;
      for (const size_t size : array.shape) count *= size;
      EXPECT_EQ(array.values.size(), count) << "trial " << trial;
    } catch (const Error& error) {
      EXPECT_EQ(error.failure(), Failure::Input) << "trial " << trial;
    }
  }
}

}  // namespace
}  // namespace palpate
