#include "capture/files/tables/csv_table.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <map>
#include <random>

#include "engine/base/text.h"
#include "palpate/error.h"
#include "tests/support/test_folder.h"
#include "tests/support/text_file.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

using Cells = std::vector<std::string>;

TEST(CsvLine, CellsAreCutAtSeparatorsAndLoseTheirBlanks) {
  EXPECT_EQ(csv_cells("1, 2 ,\t3\r"), (Cells{"1", "2", "3"}));
  EXPECT_EQ(csv_cells("Force (N);a b\tc", ";\t"), (Cells{"Force (N)", "a b", "c"}));
  EXPECT_EQ(csv_cells("1;2"), (Cells{"1;2"}));
}

TEST(CsvLine, EmptyCellsStay) {
  EXPECT_EQ(csv_cells(""), (Cells{""}));
  EXPECT_EQ(csv_cells(",1,"), (Cells{"", "1", ""}));
  EXPECT_EQ(csv_cells("1\t\t2", "\t"), (Cells{"1", "", "2"}));
}

TEST(CsvLine, WhatIsQuotedIsText) {
  EXPECT_EQ(csv_cells(R"(1, " a, b " ,"say ""no""")"), (Cells{"1", " a, b ", R"(say "no")"}));
  EXPECT_EQ(csv_cells(R"("time_s","force_N")"), (Cells{"time_s", "force_N"}));
  EXPECT_EQ(csv_cells(R"(1,"never closed, 2)"), (Cells{"1", "never closed, 2"}));
}

TEST(CsvLine, HeadersHaveUnits) {
  const auto is = [](const char* text, const char* name, const char* unit) {
    const ColumnHeader header = column_header(text);
    EXPECT_EQ(header.name, name) << text;
    EXPECT_EQ(header.unit, unit) << text;
  };
  is("force_mN", "force", "mN");
  is("Force [mN]", "force", "mN");
  is("normal_force (kgf)", "normal_force", "kgf");
  is("frame", "frame", "");
  is("Time (s) ", "time", "s");
  is("Force kN", "force", "kN");
}

class CsvTableTest : public testing::Test {
 protected:
  void TearDown() override { fs::remove_all(folder_); }
  CsvTable open(const std::string& text, CsvOptions options = {}) {
    spill(file_, text);
    return {file_, "a table", options};
  }
  std::string refusal(const std::function<void()>& act) {
    try {
      act();
    } catch (const Error& error) {
      EXPECT_EQ(error.failure(), Failure::Input);
      return error.what();
    }
    return "not refused";
  }
  void says(const std::function<void()>& act, const std::string& part) {
    const std::string said = refusal(act);
    EXPECT_NE(said.find(part), std::string::npos) << said;
  }
  const fs::path folder_ = test_folder("csv");
  const fs::path file_ = folder_ / "table.csv";
};

TEST_F(CsvTableTest, LinesAreReadInTurn) {
  CsvTable table =
      open("\xef\xbb\xbf# remark\r\nx,name, y \r\n\r\n1,\"a, b\",+2.5e1\r\n# not this\r\n3,,nan");
  EXPECT_EQ(table.columns(), (Cells{"x", "name", "y"}));
  EXPECT_EQ(table.require({"y", "x"}), (std::vector<size_t>{2, 0}));
  EXPECT_FALSE(table.find("z"));
  ASSERT_TRUE(table.next());
  EXPECT_EQ(table.number(0), 1);
  EXPECT_EQ(table.cell(1), "a, b");
  EXPECT_EQ(table.number(2), 25);
  EXPECT_EQ(table.cell(3), "");
  ASSERT_TRUE(table.next());
  EXPECT_EQ(table.where(), "line 6 of " + file_.string());
  EXPECT_FALSE(table.number_if_any(1));
  EXPECT_FALSE(table.number_if_any(2));
  EXPECT_FALSE(table.next());
}

TEST_F(CsvTableTest, TheSeparatorIsTheTablesOwn) {
  CsvTable comma = open("x;y\n1,5;2\n");
  ASSERT_TRUE(comma.next());
  EXPECT_EQ(comma.number(0), 1.5);
  CsvTable tab = open("x\ty\n1\t2\n");
  ASSERT_TRUE(tab.next());
  EXPECT_EQ(tab.number(1), 2);
  CsvTable bare = open("1;2\n3;4\n", {.header = false});
  ASSERT_TRUE(bare.next());
  EXPECT_TRUE(bare.columns().empty());
  EXPECT_EQ(bare.number(1), 2);
}

TEST_F(CsvTableTest, DecimalCommasAreUnderstoodWhereTheyAreNoSeparator) {
  CsvTable tab = open("x\ty\n1,5\t-2,25e1\n");
  ASSERT_TRUE(tab.next());
  EXPECT_EQ(tab.number(0), 1.5);
  EXPECT_EQ(tab.number(1), -22.5);
  CsvTable semicolon = open("x;y;z\n1,5;2;;;\n", {.width = CsvWidth::Shorter});
  ASSERT_TRUE(semicolon.next());
  EXPECT_EQ(semicolon.cells().size(), 3u) << "separators at the end are nothing";
  EXPECT_EQ(semicolon.number(0), 1.5);
}

TEST_F(CsvTableTest, DecimalCommasBetweenCommasAreNamed) {
  for (const CsvWidth width : {CsvWidth::Equal, CsvWidth::Shorter})
    for (const char* text : {"frame,force_N\n0,0,00\n", "t,f\n0,5,1,25\n", "x,y\n-1,5,2\n", "x,y\n1,5e-3,2\n",
                             "frame,force_N,note\n0,0,00,\n", "recording,x_mm,y_mm\na.avi,0,5,1,5\n"}) {
      CsvTable table = open(text, {.width = width});
      says([&] { table.next(); }, "decimal commas");
      says([&] { open(text, {.width = width}).next(); }, "semicolons between the cells");
    }
  // More cells for another reason are refused without that hint; with points, empty ones at the end are read.
  CsvTable words = open("frame,note\n0,one, two\n", {.width = CsvWidth::Shorter});
  says([&] { words.next(); }, "at most 2 cells in line 2");
  EXPECT_EQ(refusal([&] { open("frame,note\n0,one, two\n").next(); }).find("decimal"), std::string::npos);
  CsvTable ends = open("x,y\n1,2.5,,\n1\n", {.width = CsvWidth::Shorter});
  ASSERT_TRUE(ends.next());
  EXPECT_EQ(ends.number(1), 2.5);
  EXPECT_TRUE(ends.next());
  CsvTable quoted = open("x,y\n1,\"2,5\"\n");
  ASSERT_TRUE(quoted.next());
  says([&] { quoted.number(1); }, "decimal points");
}

TEST_F(CsvTableTest, ALineThatSeemsCut) {
  const auto seems_cut = [&](const char* line) {
    CsvTable table = open(line, {.header = false});
    return table.next() && table.seems_cut();
  };
  EXPECT_TRUE(seems_cut("12,05,3,7\n"));
  EXPECT_FALSE(seems_cut("12,5,0,7\n"));
  EXPECT_FALSE(seems_cut("12.5,05\n"));
  EXPECT_FALSE(seems_cut("12;05\n"));
}

/// All lines are read. Four columns, line by line from `line`.
std::string table_of(const std::function<std::string(int i)>& line,
                     const char* header = "time_s,a,force_N,b\n") {
  std::string text = header;
  for (int i = 0; i < 60; ++i) text += line(i) + "\n";
  return text;
}

// A header with as many columns as decimal commas make of each line.
TEST_F(CsvTableTest, NumbersThatAreAllCutAreRefusedAtTheEnd) {
  const auto read = [&](const std::string& text) {
    CsvTable table = open(text, {.width = CsvWidth::Shorter});
    while (table.next()) {
    }
  };
  const auto two = [](const char* form, double a, double b) {
    std::array<char, 80> line{};
    std::snprintf(line.data(), line.size(), form, a, b);
    std::string text = line.data();
    std::replace(text.begin(), text.end(), '.', ',');
    return text;
  };
  const auto force = [](int i) { return 3 * std::sin(i / 7.0); };
  for (const char* form : {"%.2f,%.2f", "%.3f,%.2f", "%.2f,%.4f"}) {
    says([&] { read(table_of([&](int i) { return two(form, 0.37 * i, force(i)); })); },
         "every number cut in two by its decimal comma");
    says(
        [&] {
          read(table_of([&](int i) { return std::to_string(i) + "," + two(form, force(i), force(i + 9)); },
                        "frame,fx_N,a,fy_N,b\n"));
        },
        "semicolons between the cells");
  }
  EXPECT_EQ(refusal([&] {
              read(table_of([&](int i) { return two("%.2f;%.2f", 0.37 * i, force(i)); }, "time_s;force_N\n"));
            }),
            "not refused");
}

TEST_F(CsvTableTest, TablesOfWholeNumbersAreNeverTakenForCutOnes) {
  std::mt19937 numbers(5);
  const auto random = [&] { return static_cast<unsigned>(numbers()); };
  const auto up_to = [&](unsigned most) { return std::to_string(random() % (most + 1)); };
  const auto padded = [](unsigned value, size_t places) {
    const std::string digits = std::to_string(value);
    return std::string(places - std::min(places, digits.size()), '0') + digits;
  };
  const std::map<std::string, std::function<std::string(int i)>> lines = {
      {"counts", [&](int) { return up_to(999) + "," + up_to(999) + "," + up_to(999) + "," + up_to(999); }},
      {"two places", [&](int) { return up_to(9) + ",1" + up_to(9) + "," + up_to(9) + ",2" + up_to(9); }},
      {"grid", [](int i) { return text("%d,%d,%d,%d", i / 8, i % 8, i % 8, i / 8); }},
      {"padded",
       [&](int i) {
         return padded(40u * static_cast<unsigned>(i), 5) + "," + padded(random() % 90, 2) + "," +
                padded(random() % 999, 4) + "," + padded(random() % 90, 2);
       }},
      {"state and channel", [&](int i) { return text("%d,0%d,%d,1%d", 40 * i, i % 2, 7 * i % 90, i % 3); }},
      {"numbers of lines", [](int i) { return text("%d,%03d,%d,%03d", 40 * i, i, 7 * i % 90, i + 3); }},
      {"time of day", [](int i) { return text("%d,%d,%02d,%d", i, 7, i % 60, i * i % 50); }},
      {"one place", [&](int) { return up_to(99) + "," + up_to(9) + "," + up_to(99) + "," + up_to(9); }}};
  for (const auto& [name, line] : lines)
    for (int round = 0; round < 20; ++round) {
      CsvTable table = open(table_of(line));
      EXPECT_EQ(refusal([&] {
                  while (table.next()) {
                  }
                }),
                "not refused")
          << name;
    }
}

TEST_F(CsvTableTest, RefusesWithWhatIsWrong) {
  says([&] { open("# only a remark\n"); }, "an empty file");
  says([&] { CsvTable(folder_ / "none.csv", "a table"); }, "none.csv: no such file");
  says([&] { CsvTable(folder_, "a table"); }, "a folder");
  says([&] { open("x,y\n1,2\n").require({"x", "z"}); }, "a column 'z' in the first line");
  says([&] { open("x,y\n1,2\n").require({"w", "x", "z"}); }, "columns 'w' and 'z' in the first line");
  says([&] { open("x,y\n1,2\n").require({"x", "z"}); }, "found 'x,y'");
  says([&] { open("x,x\n1,2\n").find("x"); }, "one column 'x'");
  CsvTable ragged = open("x,y\n1,2\n3\n");
  ASSERT_TRUE(ragged.next());
  says([&] { ragged.next(); }, "2 cells in line 3");
  CsvTable words = open("x,y\n1,many\n2,inf\n", {.width = CsvWidth::Shorter});
  ASSERT_TRUE(words.next());
  says([&] { words.number(1); }, "a finite number in column 'y', line 2");
  says([&] { words.number(1); }, "found 'many'");
  says([&] { words.number_if_any(1); }, "found 'many'");
  ASSERT_TRUE(words.next());
  says([&] { words.number(1); }, "found 'inf'");
  says([&] { words.number(5); }, "found none");
  says([&] { open(std::string(2u << 20, '1')); }, "a line of more than 1 MiB");
}

}  // namespace
}  // namespace palpate
