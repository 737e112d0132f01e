// Our JSON values against nlohmann's: the same bytes out, the same values in.
#include "engine/base/json.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <vector>

namespace palpate::json {
namespace {

using Theirs = nlohmann::ordered_json;

std::string random_text(std::mt19937_64& random) {
  static const std::vector<std::string> kPieces = {"a",    "\"",   "\\", "/", "\n", "\t",
                                                   "\x01", "\x7f", "é",  "µ", "😀",  " "};
  std::string text;
  for (size_t n = random() % 6; n > 0; --n) text += kPieces[random() % kPieces.size()];
  return text;
}

/// A tree in both.
void grow(std::mt19937_64& random, int depth, Value& ours, Theirs& theirs) {
  const auto both = [&](const auto& value) { ours = Value(value), theirs = Theirs(value); };
  switch (random() % (depth > 0 ? 9 : 7)) {
    case 0:
      return both(nullptr);
    case 1:
      return both(random() % 2 == 0);
    case 2:
      return both(static_cast<int64_t>(random()));
    case 3:
      return both(random());
    case 4:
      return both(std::ldexp(static_cast<double>(random()), static_cast<int>(random() % 400) - 260));
    case 5:
      return both(static_cast<float>(random() % 2000) / 1000.0f);
    case 6:
      return both(random_text(random));
    case 7:
      ours = Value::array(), theirs = Theirs::array();
      for (size_t n = random() % 4; n > 0; --n) {
        Value own;
        Theirs their;
        grow(random, depth - 1, own, their);
        ours.push_back(own), theirs.push_back(their);
      }
      return;
    default:
      ours = Value::object(), theirs = Theirs::object();
      for (size_t n = random() % 4; n > 0; --n) {
        const std::string key = random_text(random);
        grow(random, depth - 1, ours[key], theirs[key]);
      }
  }
}

TEST(Json, WritesTheSameBytesAsTheLibrary) {
  std::mt19937_64 random(7);
  for (int i = 0; i < 3000; ++i) {
    Value ours;
    Theirs theirs;
    grow(random, 4, ours, theirs);
    for (const int indent : {-1, 1, 2}) ASSERT_EQ(ours.dump(indent), theirs.dump(indent));
    ASSERT_EQ(ours.dump(-1, Utf8::Ascii), theirs.dump(-1, ' ', true));
  }
}

TEST(Json, ReadsWhatTheLibraryWrites) {
  std::mt19937_64 random(8);
  for (int i = 0; i < 1000; ++i) {
    Value ours;
    Theirs theirs;
    grow(random, 4, ours, theirs);
    const std::string text = theirs.dump(2);
    ASSERT_EQ(parse(text).dump(2), text);
    ASSERT_EQ(parse(text, {.sorted_keys = true}).dump(2), nlohmann::json::parse(text).dump(2));
    ours.sort_keys();
    ASSERT_EQ(ours.dump(2), nlohmann::json::parse(text).dump(2));
  }
}

TEST(Json, ListsArePairsOrArrays) {
  const std::array<double, 2> pair = {1, 2.5};
  const std::vector<std::vector<int>> rows = {{1}, {}, {2, 3}};
  const char* name = "pad";
  const Value ours = {{"name", name},
                      {"pair", pair},
                      {"rows", rows},
                      {"one", {1, "two", nullptr}},
                      {"in", {{"a", 1}, {"b", true}}},
                      {"none", Value::array()},
                      {"x", 0.1f}};
  const Theirs theirs = {{"name", name},
                         {"pair", pair},
                         {"rows", rows},
                         {"one", {1, "two", nullptr}},
                         {"in", {{"a", 1}, {"b", true}}},
                         {"none", Theirs::array()},
                         {"x", 0.1f}};
  EXPECT_EQ(ours.dump(2), theirs.dump(2));
  EXPECT_EQ(Value(std::map<std::string, int>{{"b", 1}, {"a", 2}}).dump(), R"({"a":2,"b":1})");
  EXPECT_EQ(Value({1.0, 2.0}).dump(), "[1.0,2.0]");
  EXPECT_EQ((Value{{"complete", true}}).dump(), R"({"complete":true})");
}

TEST(Json, NumbersThatAreNotFiniteAreNull) {
  const Value value = {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()};
  EXPECT_EQ(value.dump(), "[null,null]");
}

TEST(Json, BytesThatAreNoTextAreReplacedWhereThatIsAsked) {
  const Value value = {{"path", "a\xff"}};
  EXPECT_THROW(static_cast<void>(value.dump()), Error);
  EXPECT_EQ(value.dump(-1, Utf8::Replace), "{\"path\":\"a\xef\xbf\xbd\"}");
}

TEST(Json, ErrorsTellWhere) {
  try {
    static_cast<void>(parse("{\"a\": 1,\n \"b\": }"));
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("at line 2"), std::string::npos) << error.what();
  }
  EXPECT_THROW(static_cast<void>(parse("{\"a\": 1, \"a\": 2}", {.unique_keys = true})), KeyTwice);
  EXPECT_EQ(parse("{\"a\": 1, /* no */ \"a\": 2}", {.comments = true}).dump(), R"({"a":2})");
  EXPECT_THROW(static_cast<void>(parse("[1]").at("a")), Error);
  EXPECT_THROW(static_cast<void>(parse("{}").at("a")), Error);
  EXPECT_THROW(static_cast<void>(parse("\"a\"").number()), Error);
}

TEST(Json, ErrorsArePrintableWhateverTheBytesAre) {
  for (const char* text : {"[1,\x7f", "[1,\xff\xfe", "{\"a\x01", "[1,\n\n\x80"}) {
    try {
      static_cast<void>(parse(text));
      ADD_FAILURE() << "taken as JSON";
    } catch (const Error& error) {
      for (const char* c = error.what(); *c; ++c) EXPECT_TRUE(*c >= ' ' && *c <= '~') << error.what();
    }
  }
}

TEST(Json, ValuesAreTakenAsTypes) {
  const Value value =
      parse(R"({"w": [1, 2.5], "n": 7, "low": -3, "t": "pad", "yes": true, "big": 18446744073709551615})");
  EXPECT_EQ((value["w"].get<std::array<double, 2>>()), (std::array<double, 2>{1, 2.5}));
  EXPECT_EQ(value["w"].get<std::vector<float>>(), (std::vector<float>{1, 2.5f}));
  EXPECT_EQ(value["n"].get<uint8_t>(), 7);
  EXPECT_EQ(value["low"].get<int64_t>(), -3);
  EXPECT_EQ(value["t"].get<std::string>(), "pad");
  EXPECT_TRUE(value["yes"].get<bool>());
  EXPECT_EQ(value["big"].get<uint64_t>(), UINT64_MAX);
  EXPECT_EQ(value["big"].get<double>(), 0x1p64);
  EXPECT_THROW(static_cast<void>(value["big"].get<int64_t>()), Error);
  EXPECT_THROW(static_cast<void>(value["low"].get<uint64_t>()), Error);
  EXPECT_THROW(static_cast<void>(parse("256").get<uint8_t>()), Error);
  EXPECT_THROW(static_cast<void>(parse("-129").get<int8_t>()), Error);
  EXPECT_EQ(parse("-128").get<int8_t>(), -128);
  EXPECT_THROW(static_cast<void>(parse("1.5").get<int>()), Error);
  EXPECT_THROW(static_cast<void>(value["t"].get<double>()), Error);
  EXPECT_THROW(static_cast<void>(value["n"].get<std::string>()), Error);
  EXPECT_THROW(static_cast<void>((value["w"].get<std::array<double, 3>>())), Error);
  EXPECT_THROW(static_cast<void>(value["n"].get<std::vector<double>>()), Error);
}

TEST(Json, EqualValuesAreEqualWhateverTheyAreWrittenAs) {
  EXPECT_TRUE(parse("[1, {\"a\": 2, \"b\": null}]") == parse("[1.0, {\"b\": null, \"a\": 2}]"));
  EXPECT_FALSE(parse("[1]") == parse("[1, 1]"));
  EXPECT_FALSE(parse("{\"a\": 1}") == parse("{\"b\": 1}"));
  EXPECT_FALSE(parse("\"1\"") == parse("1"));
  EXPECT_FALSE(parse("true") == parse("1"));
  EXPECT_FALSE(parse("-1") == parse("18446744073709551615"));
  EXPECT_TRUE(parse("3") == 3 && parse("\"pad\"") == "pad");
}

// Reading takes a time that grows with their number, not with its square: this would take minutes.
TEST(Json, ManyKeysAreReadAtOnce) {
  constexpr int kKeys = 400'000;
  std::string text = "{";
  for (int i = 0; i < kKeys; ++i) text += "\"k" + std::to_string(i) + "\":" + std::to_string(i) + ",";
  const Value value = parse(text + "\"k7\":-1}");
  EXPECT_EQ(value.size(), size_t{kKeys});
  EXPECT_EQ(value["k7"], -1) << "the last value of a key counts";
  EXPECT_EQ(value.keys().back(), "k399999");
  EXPECT_THROW(static_cast<void>(parse(text + "\"k7\":-1}", {.unique_keys = true})), KeyTwice);
}

TEST(Json, NestingIsRefusedWhereItIsLimited) {
  EXPECT_NO_THROW(static_cast<void>(parse("[[1]]", {.deepest = 2})));
  EXPECT_THROW(static_cast<void>(parse("[[{}]]", {.deepest = 2})), TooDeep);
}

TEST(Json, NestingDeeperThanTheStackIsFreed) {
  const size_t depth = 1'000'000;
  EXPECT_TRUE(parse(std::string(depth, '[') + std::string(depth, ']')).is_array());
}

}  // namespace
}  // namespace palpate::json
