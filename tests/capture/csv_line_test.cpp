#include "capture/files/csv_line.h"

#include <gtest/gtest.h>

namespace palpate {
namespace {

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

TEST(CsvLine, TrimmedHasNoBlanksAndQuotesAround) {
  EXPECT_EQ(trimmed(" \t\"a b\" \r"), "a b");
  EXPECT_EQ(trimmed("\" \""), "");
}

}  // namespace
}  // namespace palpate
