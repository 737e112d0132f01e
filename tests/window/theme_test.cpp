// Colours of the window: words can be read on every ground, in either theme.
#include "viz/look/theme.h"

#include <gtest/gtest.h>

#include <set>
#include <string>
#include <tuple>

#include "viz/report/html.h"

namespace palpate::viz {
namespace {

TEST(Theme, ContrastIsThatOfTheGuidelines) {
  EXPECT_DOUBLE_EQ(contrast({0, 0, 0}, {255, 255, 255}), 21);
  EXPECT_DOUBLE_EQ(contrast({12, 34, 56}, {12, 34, 56}), 1);
  EXPECT_NEAR(contrast({118, 118, 118}, {255, 255, 255}), 4.54, 0.005);  // the lightest gray that passes
}

TEST(Theme, WordsCanBeReadOnEveryGround) {
  for (const Theme* t : {&dark_theme(), &light_theme()})
    for (const Rgb word : {t->text, t->faint, t->valid, t->doubtful, t->wrong, t->slips, t->chosen, t->second,
                           t->third, t->depth, t->limit})
      for (const Rgb ground : {t->ground, t->panel, t->chart, t->field, t->picked})
        EXPECT_GE(contrast(word, ground), 4.5)
            << int{word.red} << ' ' << int{word.green} << ' ' << int{word.blue} << " on " << int{ground.red};
}

TEST(Theme, EachMeaningHasItsOwnColour) {
  for (const Theme* t : {&dark_theme(), &light_theme()}) {
    std::set<std::tuple<int, int, int>> colours;
    for (int i = 0; i < kMeanings; ++i) {
      const Rgb c = t->of(static_cast<Meaning>(i));
      EXPECT_TRUE(colours.insert({c.red, c.green, c.blue}).second) << i;
    }
  }
}

TEST(Theme, OneIsInUse) {
  use_theme(true);
  EXPECT_EQ(&theme(), &light_theme());
  use_theme(false);
  EXPECT_EQ(&theme(), &dark_theme());
}

TEST(Theme, PagesHaveBothAndTheReadersScreenChooses) {
  const std::string page = html_page("a <b> & c", "<p>body</p>\n");
  EXPECT_NE(page.find("<title>a &lt;b&gt; &amp; c</title>"), std::string::npos);
  EXPECT_NE(page.find("<body>\n<p>body</p>\n</body>"), std::string::npos);
  const size_t light = page.find("--text: #161a20"), dark = page.find("--text: #e6ebf0");
  ASSERT_NE(light, std::string::npos);
  ASSERT_NE(dark, std::string::npos);
  EXPECT_LT(light, page.find("prefers-color-scheme: dark"));
  EXPECT_GT(dark, page.find("prefers-color-scheme: dark"));
}

}  // namespace
}  // namespace palpate::viz
