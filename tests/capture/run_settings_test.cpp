// The table that command line, window and Python read: whole, and in agreement with the settings' defaults.
#include "capture/run/run_settings.h"

#include <gtest/gtest.h>

#include <array>
#include <cctype>
#include <cmath>
#include <set>

namespace palpate {
namespace {

TEST(RunSettingsTable, NamesEachSettingOnce) {
  std::set<std::string> names, options;
  for (const Setting& setting : run_settings()) {
    SCOPED_TRACE(setting.name);
    EXPECT_TRUE(names.insert(setting.name).second);
    EXPECT_TRUE(options.insert(setting.option).second);
    EXPECT_EQ(std::string(setting.option).rfind("--", 0), 0u);
    EXPECT_TRUE(std::isupper(static_cast<unsigned char>(setting.sentence[0])));
    EXPECT_EQ(&run_setting(setting.name), &setting);
    const bool number = std::holds_alternative<double RunSettings::*>(setting.member) ||
                        std::holds_alternative<uint64_t RunSettings::*>(setting.member);
    EXPECT_EQ(number, *setting.example != 0) << "a number out of range needs something to try";
  }
}

TEST(RunSettingsTable, DefaultsAreInRangeOrMeanNone) {
  const RunSettings defaults;
  for (const Setting& setting : run_settings()) {
    SCOPED_TRACE(setting.name);
    if (const auto* member = std::get_if<double RunSettings::*>(&setting.member)) {
      const double value = defaults.**member;
      EXPECT_TRUE(in_range(setting, value) || (setting.may_be_none && value == 0)) << value;
    }
    if (const auto* member = std::get_if<bool RunSettings::*>(&setting.member)) {
      EXPECT_FALSE(defaults.**member) << "a flag can only switch on";
    }
  }
}

TEST(RunSettingsTable, RangesHaveWords) {
  EXPECT_EQ(range_words(run_setting("rate_Hz")), "above 0");
  EXPECT_EQ(range_words(run_setting("frames")), "of at least 1");
  EXPECT_EQ(range_words(run_setting("speed")), "from 0.015625 to 64");
  EXPECT_FALSE(in_range(run_setting("rate_Hz"), 0));
  EXPECT_FALSE(in_range(run_setting("rate_Hz"), NAN));
  EXPECT_TRUE(in_range(run_setting("patience_s"), 0));
  EXPECT_FALSE(in_range(run_setting("speed"), 65));
}

TEST(RunSettings, ContactsAndSkinNeedTheForce) {
  EXPECT_EQ(outputs_of(std::array{Output::Contacts}), Output::Contacts | Output::Force);
  EXPECT_EQ(outputs_of(std::array{Output::Skin}), Output::Skin | Output::Force);
  EXPECT_EQ(outputs_of(std::array{Output::Surface}), Outputs(Output::Surface));
}

TEST(RunSettings, OfASessionOnlyWhatIsLeftOpenIsAsItWasRecorded) {
  SessionInfo session;
  session.solver = SurfaceSolver::Best;
  session.solve_by = SolveBy::Host;
  session.fixed_light = true;
  RunSettings open, chosen;
  chosen.solver = SurfaceSolver::Live;
  as_recorded(open, session);
  as_recorded(chosen, session);
  EXPECT_EQ(open.solver, SurfaceSolver::Best);
  EXPECT_EQ(open.solve_by, SolveBy::Host);
  EXPECT_EQ(chosen.solver, SurfaceSolver::Live);
  EXPECT_EQ(chosen.solve_by, SolveBy::Auto);
  EXPECT_TRUE(open.fixed_light && chosen.fixed_light);
}

}  // namespace
}  // namespace palpate
