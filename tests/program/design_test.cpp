// palpate optics and palpate contact on the command line.

#include "tests/support/json.h"
#include "tests/support/program_fixture.h"

namespace palpate {
namespace {

class Design : public Program {
 protected:
  Json ask(std::vector<std::string> arguments) {
    arguments.push_back("--json");
    const Ended ended = run(arguments);
    EXPECT_EQ(ended.exit_code, 0) << ended.err;
    EXPECT_EQ(ended.err, "");
    return parse_json(ended.out);
  }

  /// Runs the commands with --out and looks for NAME.csv, .png, .svg and .pdf.
  void expect_files(const std::vector<std::vector<std::string>>& commands,
                    const std::vector<std::string>& names) {
    const fs::path out = folder_ / "out";
    for (std::vector<std::string> arguments : commands) {
      arguments.insert(arguments.end(), {"--out", out.string()});
      const Ended ended = run(arguments);
      EXPECT_EQ(ended.exit_code, 0) << ended.err;
    }
    for (const std::string& name : names) {
      EXPECT_EQ(slurp(out / (name + ".png")).substr(1, 3), "PNG") << name;
      const std::string svg = slurp(out / (name + ".svg"));
      EXPECT_TRUE(contains(svg, "</svg>")) << name;
      EXPECT_FALSE(contains(svg, "^2")) << name << ": superscripts are written as such";
      EXPECT_EQ(slurp(out / (name + ".pdf")).substr(0, 5), "%PDF-") << name;
      const Table table(slurp(out / (name + ".csv")));
      EXPECT_GT(table.rows.size(), 15u) << name;
      table.expect_whole();
    }
  }
};

TEST_F(Design, StackPrintsItsShares) {
  const Json v = ask({"optics", "stack", "--indices", "1,1.39,1.40,1.41,1", "--angle-deg", "30"});
  EXPECT_NEAR(v["reflectance"]["unpolarised"], 0.0562253669366, 1e-12);
  for (const char* p : {"s", "p", "unpolarised"}) {
    const double r = v["reflectance"][p], t = v["transmittance"][p], a = v["absorptance"][p];
    EXPECT_NEAR(r + t + a, 1, 1e-12);
    EXPECT_EQ(a, 0);
  }
  EXPECT_NEAR((v["reflectance"]["s"].get<double>() + v["reflectance"]["p"].get<double>()) / 2,
              v["reflectance"]["unpolarised"], 1e-15);
  // alpha d = 0.05 in each layer.
  const std::string k = "1.2533451768486759e-06";  // 0.05 * 630e-6 / (4 pi 2)
  const Json absorbing = ask({"optics", "stack", "--indices", "1,1.39,1.40,1.41,1", "--extinction",
                              "0," + k + "," + k + "," + k + ",0", "--thickness-mm", "2", "--wavelength-nm",
                              "630", "--angle-deg", "60"});
  EXPECT_NEAR(absorbing["reflectance"]["unpolarised"], 0.108478342, 1e-8);
  EXPECT_NEAR(absorbing["transmittance"]["unpolarised"], 0.719599354, 1e-8);
  const Json inside = ask({"optics", "stack", "--indices", "1.41,1.40,1.39,1", "--angle-deg", "45.2"});
  EXPECT_EQ(inside["reflectance"]["unpolarised"], 1);
  EXPECT_TRUE(inside["total_reflection"]);
}

TEST_F(Design, CriticalAnglesAndIndexFromSpots) {
  const Json v = ask({"optics", "critical", "--indices", "1,1.39,1.40,1.41,1"});
  EXPECT_NEAR(v["layers"][1]["critical_angle_above_deg"], 45.584691, 5e-7);
  EXPECT_NEAR(v["layers"][1]["numerical_aperture"], 0.979796, 5e-7);
  EXPECT_NEAR(v["layers"][2]["acceptance_half_angle_deg"], 83.737305, 5e-7);
  const Json index = ask({"optics", "index", "--od-mm", "800", "--on-mm", "600", "--m1m2-mm", "10.3",
                          "--nm2-mm", "20", "--sd-mm", "0.1"});
  EXPECT_NEAR(index["index"], 1.4126, 2e-3);
  EXPECT_GT(index["standard_error"], 0.003);
  EXPECT_LT(index["standard_error"], 0.03);
  const Json bare =
      ask({"optics", "index", "--od-mm", "8", "--on-mm", "6", "--m1m2-mm", "10.3", "--nm2-mm", "20"});
  EXPECT_TRUE(bare["standard_error"].is_null());  // not 0
}

TEST_F(Design, OpticsWritesPlotsAndTables) {
  expect_files(
      {{"optics", "stack", "--indices", "1,1.4,1"},
       {"optics", "trapped", "--indices", "1,1.39,1.40,1.41,1"},
       {"optics", "contact", "--indices", "1,1.41,1", "--thickness-mm", "6", "--contact", "1.33,1.4"},
       {"optics", "led", "--indices", "1,1.41,1", "--thickness-mm", "6"}},
      {"reflectance", "trapped", "contact_light", "led"});
}

TEST_F(Design, ContactWritesPlotsAndTables) {
  expect_files(
      {{"contact", "--radius-mm", "5", "--force-N", "0.02", "--young-kPa", "24.3", "--thickness-mm", "6"},
       {"contact", "--figure", "7"},
       {"contact", "--figure", "8"}},
      {"contact", "fig7", "fig8"});
}

TEST_F(Design, ContactsAreToldApart) {
  const Json v = ask({"optics", "contact", "--indices", "1,1.41,1", "--thickness-mm", "6", "--contact",
                      "1,1.33,1.41,1.41", "--gap-nm", "0,0,0,100", "--reference-gray", "200",
                      "--reference-index", "1.41", "--reference-albedo", "0.5", "--albedo", "1,0.5,1,0.5"});
  const Json& c = v["contacts"];
  EXPECT_EQ(c[0]["gray"], 0);
  EXPECT_TRUE(c[0]["leaves_up_to_deg"].is_null());
  EXPECT_GT(c[1]["gray"], 100);
  EXPECT_LT(c[1]["gray"], 200);
  EXPECT_TRUE(c[2]["saturated"]);
  EXPECT_NEAR(c[2]["gray_without_saturation"], 400, 1e-6);
  EXPECT_LT(c[3]["gray"], 120);
  EXPECT_EQ(v["assumed"].size(), 4u);
}

TEST_F(Design, ContactGoesBothWaysAndWarns) {
  const std::vector<std::string> pad = {"contact", "--radius-mm",    "5", "--young-kPa",
                                        "60",      "--thickness-mm", "6"};
  std::vector<std::string> by_force = pad, by_depth = pad;
  by_force.insert(by_force.end(), {"--force-N", "0.05", "--bonded"});
  const Json f = ask(by_force);
  const double depth = f["exact"]["depth_mm"];
  by_depth.insert(by_depth.end(), {"--depth-mm", f["exact"]["depth_mm"].dump()});
  EXPECT_NEAR(ask(by_depth)["exact"]["force_N"], 0.05, 1e-12);
  ASSERT_EQ(f["ways"].size(), 4u);
  for (const Json& way : f["ways"])
    if (way["by"] == "garcia") {
      EXPECT_NEAR(way["depth_mm"].get<double>() / depth, 1, 0.01);
    } else if (way["by"] == "hertz") {
      EXPECT_LT(way["force_error"], -0.1);
    }
  EXPECT_TRUE(contains(f["warnings"].dump(), "thin"));
  const Json example = ask({"contact", "--example"});
  EXPECT_NEAR(example["cases"][0]["contact_radius_mm"], 6.7580, 5e-5);
  EXPECT_NEAR(example["series_paper_MPa"], 0.0242684, 5e-8);
  const Json layers = ask({"contact", "--radius-mm", "5", "--force-N", "0.02", "--young-kPa", "140,80,34",
                           "--poisson", "0.4", "--series", "paper", "--indenter-young-MPa", "200000"});
  EXPECT_NEAR(layers["effective_modulus_MPa"], 0.0242684, 5e-8);
  EXPECT_NEAR(layers["ways"][1]["contact_radius_mm"], 1.45597, 1e-3);
}

TEST_F(Design, NonsenseOfOpticsIsOneLine) {
  const auto optics = [&](std::vector<std::string> arguments, int code,
                          const std::vector<std::string>& words) {
    arguments.insert(arguments.begin(), "optics");
    expect_refusal(arguments, code, words);
  };
  optics({"stack", "--indices", "1,0.9,1"}, 3, {"at least 1", "0.9"});
  optics({"stack", "--indices", "1,nan,1"}, 3, {"nan"});
  optics({"stack", "--indices", "1,x,1"}, 2, {"--indices"});
  optics({"stack", "--indices", "1,1.4,1", "--angle-deg", "91"}, 3, {"0 to 90", "91"});
  optics({"stack", "--indices", "1,1.4,1", "--extinction", "0,1"}, 2, {"3 indices", "2 extinctions"});
  optics({"stack", "--indices", "1,1.4,1", "--extinction", "0,1,0"}, 2, {"thickness"});
  optics({"stack", "--indices", "1,1.4,1", "--extinction", "1,0,0"}, 3, {"first medium"});
  optics({"stack", "--indices", "1,1.4,1", "--thickness-mm", "0"}, 3, {"thicker than 0"});
  optics({"critical", "--indices", "1,1"}, 3, {"at least one layer"});
  optics({"led", "--indices", "1,1.4,1", "--thickness-mm", "6", "--depth-mm", "7"}, 3, {"depth"});
  optics({"contact", "--indices", "1.5,1.4,1.5", "--thickness-mm", "2", "--contact", "1.3"}, 3,
         {"none that does"});
  optics({"contact", "--indices", "1,1.4,1", "--thickness-mm", "2", "--contact", "1.3", "--albedo", "2"}, 3,
         {"albedo"});
  optics({"index", "--od-mm", "1", "--on-mm", "1", "--m1m2-mm", "2", "--nm2-mm", "1"}, 3, {"M1M2 < NM2"});
  optics({"index", "--od-mm", "1,2", "--on-mm", "1", "--m1m2-mm", "1", "--nm2-mm", "2"}, 2, {"--on-mm"});
  expect_refusal({"optics"}, 2, {"subcommand"});
}

TEST_F(Design, NonsenseOfContactsIsOneLine) {
  const auto contact = [&](std::vector<std::string> arguments, int code,
                           const std::vector<std::string>& words) {
    arguments.insert(arguments.begin(), "contact");
    expect_refusal(arguments, code, words);
  };
  contact({"--radius-mm", "5", "--young-kPa", "60"}, 2, {"--force-N"});
  contact({"--radius-mm", "5", "--force-N", "1"}, 2, {"--young-kPa"});
  contact({"--force-N", "1", "--young-kPa", "60"}, 2, {"--radius-mm"});
  contact({"--shape", "cone", "--force-N", "1", "--young-kPa", "60"}, 2, {"--half-angle-deg"});
  contact({"--shape", "cube", "--force-N", "1"}, 2, {"--shape"});
  contact({"--radius-mm", "-5", "--force-N", "1", "--young-kPa", "60"}, 3, {"radius"});
  contact({"--radius-mm", "5", "--force-N", "-1", "--young-kPa", "60"}, 3, {"force"});
  contact({"--radius-mm", "5", "--force-N", "nan", "--young-kPa", "60"}, 3, {"force"});
  contact({"--radius-mm", "5", "--force-N", "1", "--young-kPa", "60,70", "--thickness-mm", "1"}, 2,
          {"2 moduli"});
  contact({"--radius-mm", "5", "--force-N", "1", "--young-kPa", "60", "--poisson", "0.6"}, 3, {"Poisson"});
  contact({"--radius-mm", "5", "--force-N", "1", "--young-kPa", "60", "--thickness-mm", "0"}, 3,
          {"thickness"});
  contact({"--figure", "9"}, 2, {"--figure"});
}

}  // namespace
}  // namespace palpate
