// Parts of an error: as they were given, whatever they hold.
#include "palpate/error.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "palpate/device.h"

namespace palpate {
namespace {

TEST(Error, PartsAreThoseThatWereGiven) {
  const Error inner(Failure::Input, "a size to 20", "30; found twice", "20; try less");
  const Error outer(Failure::Sensor, "a block", std::string("one refused (") + inner.what() + ")", "");
  EXPECT_EQ(inner.wanted(), "a size to 20");
  EXPECT_EQ(inner.found(), "30; found twice");
  EXPECT_EQ(inner.remedy(), "20; try less");
  EXPECT_EQ(outer.wanted(), "a block");
  EXPECT_EQ(outer.found(), "one refused (wanted a size to 20; found 30; found twice; try 20; try less)");
  EXPECT_EQ(outer.remedy(), "");
  EXPECT_EQ(std::string(inner.what()), "wanted a size to 20; found 30; found twice; try 20; try less");
}

TEST(Error, PartsOutliveTheErrorThatWasCopied) {
  std::unique_ptr<Error> first = std::make_unique<DeviceLost>("a device", "none", "palpate devices");
  const Error copy = *first;
  first.reset();
  EXPECT_EQ(copy.wanted(), "a device");
  EXPECT_EQ(copy.found(), "none");
  EXPECT_EQ(copy.remedy(), "palpate devices");
  EXPECT_EQ(copy.failure(), Failure::Device);
}

}  // namespace
}  // namespace palpate
