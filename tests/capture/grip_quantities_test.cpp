// The list of a grip's quantities is the table of the README and the columns of pairs.csv.
#include "engine/grip/grip_quantities.h"

#include <cstdlib>

#include "capture/files/measurements.h"
#include "tests/support/csv_table.h"
#include "tests/support/json.h"
#include "tests/support/text_file.h"

namespace palpate {
namespace {

std::string table() {
  std::string text = "| column | unit | what it is |\n|---|---|---|\n";
  for (const auto& q : grip_quantities()) {
    text += std::string("| `") + q.name + '`';
    if (q.kind == QuantityKind::Estimated) text += ", `" + error_name(q) + '`';
    if (q.state) text += std::string(", `") + q.state + '`';
    text += std::string(" | ") + q.unit + " | " + q.sentence + " |\n";
  }
  return text;
}

TEST(GripQuantities, TheTableInTheReadmeIsTheList) {
  const std::string file = std::string(PALPATE_SOURCE_DIR) + "/capture/pair/README.md";
  const std::string text = slurp(file), begin = "<!-- quantities -->\n", end = "<!-- end -->\n";
  const size_t from = text.find(begin) + begin.size(), to = text.find(end);
  ASSERT_LT(from, to + 1) << file;
  if (std::getenv("PALPATE_WRITE_TABLES"))
    spill(file, text.substr(0, from) + table() + text.substr(to));
  else
    EXPECT_EQ(text.substr(from, to - from), table()) << "PALPATE_WRITE_TABLES=1 writes the table";
}

TEST(GripQuantities, RowsSayWhatIsKnownAndWhy) {
  GripFrame frame;
  frame.time_ns = 250'000'000;
  frame.left = 7;
  frame.right = 9;
  frame.skew_ms = -1.5;
  frame.opening_mm = {20, 0.1, Validity::Valid};
  Grip& grip = frame.grip.emplace();
  grip.force_N = {1.25, 0.012, Validity::Valid};
  grip.load_z_N = {-0.5, 0.02, Validity::OnsetUnseen};
  grip.slip = Slip::Incipient;
  grip.thickness_mm = {20.8, 0.11, Validity::Valid};
  grip.stiffness = StiffnessState::NotIdentifiable;
  EXPECT_EQ(
      grip_header(),
      "time_s,left_frame,right_frame,skew_ms,grip_force_N,grip_force_sd_N,grip_force_state,imbalance_N,"
      "imbalance_sd_N,load_x_N,load_x_sd_N,load_y_N,load_y_sd_N,load_z_N,load_z_sd_N,load_state,turn_rad,"
      "turn_sd_rad,turn_state,grip_slip,opening_mm,opening_sd_mm,thickness_mm,thickness_sd_mm,"
      "thickness_state,stiffness_N_per_mm,stiffness_sd_N_per_mm,stiffness_state");
  EXPECT_EQ(
      grip_row(frame),
      "0.250000,7,9,-1.5000,1.250,0.012,valid,,,,,,,-0.500,0.020,onset unseen,,,not calibrated,incipient "
      "slip,20.00,0.10,20.80,0.11,valid,,,not identifiable");
  const Json json = Json::parse(grip_json_line(frame));
  EXPECT_EQ(json["grip_force_N"], 1.25);
  EXPECT_EQ(json["stiffness_state"], "not identifiable");
  EXPECT_FALSE(json.contains("stiffness_N_per_mm"));
  // A frame without a partner has its number and time.
  frame.right.reset();
  frame.skew_ms.reset();
  frame.grip.reset();
  frame.opening_mm = {};
  EXPECT_EQ(grip_row(frame), "0.250000,7" + std::string(26, ','));
}

}  // namespace
}  // namespace palpate
