#include "capture/pair/pair_files.h"

#include <fstream>
#include <iterator>

#include "capture/files/output_file.h"
#include "capture/session/session.h"
#include "engine/base/json.h"
#include "palpate/error.h"

namespace fs = std::filesystem;

namespace palpate {

namespace {

constexpr int kPairVersion = 1;

std::string whole_text(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(in), {}};
  if (!in)
    throw Error(Failure::Input, "a folder with " + std::string(kPairJson),
                "'" + file.string() + "' unreadable",
                "a folder that palpate record --left ... --right ... wrote");
  return text;
}

}  // namespace

bool is_pair_session(const fs::path& folder) {
  return fs::is_regular_file(folder / kPairJson) && is_session(finger_folder(folder, Side::Left)) &&
         is_session(finger_folder(folder, Side::Right));
}

fs::path finger_folder(const fs::path& folder, Side side) {
  return folder / to_string(side);
}

void write_pair_info(const fs::path& folder, const PairInfo& info) {
  json::Value value = {{"palpate_pair", kPairVersion}, {"period_s", info.period_s}};
  for (const Side side : kSides) value[to_string(side)] = {{"input", info.inputs[index(side)]}};
  if (info.grip) value["grip"] = to_json(*info.grip);
  value["complete"] = info.complete;
  if (info.complete) {
    value["pairs"] = info.skew.pairs();
    value["skew_mean_ms"] = info.skew.mean_ms();
    value["skew_sd_ms"] = info.skew.sd_ms();
    for (const Side side : kSides) value[to_string(side)]["alone"] = info.alone[index(side)];
  }
  write_whole(folder / kPairJson, value.dump(2) + "\n");
}

PairInfo read_pair_info(const fs::path& folder) {
  const fs::path file = folder / kPairJson;
  PairInfo info;
  try {
    const json::Value value = json::parse(whole_text(file));
    if (value.at("palpate_pair").get<int>() > kPairVersion)
      throw json::Error("a newer version of palpate wrote it");
    info.period_s = value.at("period_s").number();
    if (!(info.period_s > 0)) throw json::Error("\"period_s\" above 0 expected");
    for (const Side side : kSides) {
      const json::Value& finger = value.at(to_string(side));
      info.inputs[index(side)] = finger.at("input").text();
      if (const json::Value* alone = finger.find("alone")) info.alone[index(side)] = alone->get<uint64_t>();
    }
    if (const json::Value* grip = value.find("grip")) info.grip = grip_from_text(grip->dump(), file);
    info.complete = value.at("complete").boolean();
  } catch (const json::Error& error) {
    throw Error(Failure::Input, "a pair of sessions", "'" + file.string() + "': " + error.what(),
                "one of its sessions alone: " + finger_folder(folder, Side::Left).string());
  }
  return info;
}

}  // namespace palpate
