// Layers of the source tree and the dependencies between them: what a file includes lies in its own room or
// in one below, and no two components (a header with the source of its name) need each other.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace palpate {
namespace {

namespace fs = std::filesystem;

struct Arrow {
  const char* rooms;
  const char* below;  ///< and all that is below these
};
// A room is a folder or a single component; a file belongs to the longest name that fits.
constexpr Arrow kArrows[] = {
    {"shaders engine/include", ""},
    {"engine/base", "engine/include"},
    {"engine/gpu", "engine/base shaders"},
    {"engine/sensor", "engine/base"},
    {"engine/numeric", "engine/gpu engine/sensor"},
    {"engine/pad", "engine/numeric"},
    {"engine/motion", "engine/numeric"},
    {"engine/map", "engine/motion"},
    {"engine/elasticity", "engine/pad"},
    {"engine/optics", "engine/numeric"},
    {"engine/measure", "engine/pad"},
    {"engine/stages", "engine/measure engine/motion"},
    {"engine/pipeline", "engine/stages"},
    {"engine/calibrate", "engine/measure engine/optics"},
    {"engine/elasticity/modulus", "engine/elasticity"},
    {"engine/grip", "engine/measure"},
    {"engine/tissue", "engine/numeric"},
    {"engine/fem/scene", "engine/tissue"},
    {"engine/fem/linear", "engine/fem/scene"},
    {"engine/fem/device engine/fem/large_strain", "engine/fem/linear"},
    {"engine/fem", "engine/fem/device engine/fem/large_strain"},
    {"engine/lump/observation", "engine/tissue"},
    {"engine/lump/lump_case", "engine/lump/observation engine/fem"},
    {"engine/lump/network", "engine/lump/observation"},
    {"engine/lump/pair", "engine/lump/network"},
    {"engine/lump/fem_inverse", "engine/lump/lump_case engine/lump/network"},
    {"engine/lump", "engine/lump/fem_inverse engine/lump/pair"},
    {"engine/palpation", "engine/lump engine/motion engine/pipeline"},
    {"capture/truth", "engine/base"},
    {"capture/source", "capture/truth"},
    {"capture/sensors", "engine/sensor"},
    {"capture/video", "capture/source"},
    {"capture/files/images", "capture/source"},
    {"capture/rectify", "capture/files/images"},
    {"capture/files",
     "capture/video capture/rectify capture/sensors engine/calibrate engine/elasticity/modulus "
     "engine/grip engine/map engine/palpation"},
    {"capture/messages", "capture/files"},
    {"capture/mcap capture/hdf5", "capture/messages"},
    {"capture/camera", "capture/files"},
    {"capture/session capture/v4l2 capture/genicam", "capture/camera"},
    {"capture/synthetic", "capture/camera engine/motion"},
    {"capture/log", "capture/session"},
    {"capture/open_source capture/module_folder",
     "capture/session capture/v4l2 capture/genicam capture/synthetic"},
    {"capture/series", "capture/open_source"},
    {"capture/live", "capture/series capture/log"},
    {"capture/serve", "capture/messages"},
    {"capture/run", "capture/live capture/mcap capture/hdf5"},
    {"capture/pair", "capture/run engine/grip"},
    {"capture/calibrate", "capture/run"},
    {"viz/look", ""},
    {"viz/report viz/live", "capture/calibrate capture/pair viz/look"},
    {"perf/profile/profile", "engine/base"},
    {"perf/profile/report/answers perf/profile/report/tables", "perf/profile/profile"},
    {"perf/profile/report/compare", "perf/profile/report/tables"},
    {"viz/python", "capture/calibrate capture/pair perf/profile/report/compare"},
    {"viz/render", "viz/live"},
    {"viz/panels", "viz/render"},
    {"viz/display", "viz/panels viz/report"},
    {"perf/measure", "engine/base"},
    {"perf/motion", "engine/motion capture/synthetic perf/measure"},
    {"perf/map", "engine/map perf/motion"},
    {"perf/profile", "perf/measure viz/report perf/profile/report/answers perf/profile/report/compare"},
    {"viz/commands/support/help_text", ""},
    {"viz/commands/support/options", "engine/base viz/commands/support/help_text"},
    {"viz/commands/support", "capture/calibrate capture/pair viz/commands/support/options"},
    {"perf/tools", "perf/profile viz/commands/support"},
    {"viz/commands", "viz/display perf/profile viz/commands/support capture/serve"},
    {"viz/main", "viz/commands"},
    // The laboratory uses the instrument, and nothing uses the laboratory.
    {"perf/rivals", "engine/pad"},
    {"perf/lab", "perf/profile perf/rivals viz/commands/support"},
};

using Names = std::set<std::string>;

std::vector<std::string> words(const std::string& text) {
  std::istringstream in(text);
  return {std::istream_iterator<std::string>(in), {}};
}

/// Each room with all that is below it.
std::map<std::string, Names> rooms() {
  std::map<std::string, Names> all;
  for (const Arrow& arrow : kArrows) {
    Names below;
    for (const std::string& room : words(arrow.below)) {
      below.insert(room);
      below.merge(Names(all.at(room)));  // throws where a row comes before those below it
    }
    for (const std::string& room : words(arrow.rooms)) all[room] = below;
  }
  return all;
}

/// The file without its ending: a header and the source of its name are one component.
std::string component(const fs::path& file) {
  return fs::path(file).replace_extension().generic_string();
}

/// Empty where a file lies in no room.
std::string room_of(const std::map<std::string, Names>& all, const std::string& file) {
  for (fs::path at = component(file); !at.empty(); at = at.parent_path())
    if (all.contains(at.generic_string())) return at.generic_string();
  return {};
}

/// Our own files that a file includes, by their paths from the root of the tree.
std::vector<std::string> includes_of(const fs::path& root, const fs::path& file) {
  std::vector<std::string> found;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    if (line.rfind("#include ", 0) != 0) continue;
    const size_t from = line.find_first_of("\"<") + 1, to = line.find_first_of("\">", from);
    const fs::path named = line.substr(from, to - from);
    for (const fs::path& base :
         {fs::path(), fs::path("engine/include"), fs::relative(file, root).parent_path()})
      if (fs::exists(root / base / named)) {
        found.push_back((base / named).lexically_normal().generic_string());
        break;
      }
  }
  return found;
}

/// Headers of libraries that only the laboratory may know.
bool includes_lab_library(const fs::path& file) {
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);)
    if (line == "#include <hdf5.h>" || line == "#include <mpi.h>") return true;
  return false;
}

class Layers : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    const fs::path root = PALPATE_SOURCE_DIR;
    for (const char* top : {"engine", "capture", "viz", "perf", "shaders"})
      for (const auto& entry : fs::recursive_directory_iterator(root / top)) {
        const fs::path& file = entry.path();
        if (file.extension() == ".h" || file.extension() == ".cpp")
          includes_[fs::relative(file, root).generic_string()] = includes_of(root, file);
      }
  }

  static std::map<std::string, std::vector<std::string>> includes_;
};
std::map<std::string, std::vector<std::string>> Layers::includes_;

TEST_F(Layers, IncludesPointDown) {
  const std::map<std::string, Names> all = rooms();
  ASSERT_GT(includes_.size(), 400u);
  for (const auto& [file, included] : includes_) {
    const std::string room = room_of(all, file);
    EXPECT_NE(room, "") << file << " lies in no room of the table";
    for (const std::string& other : included) {
      const std::string below = room_of(all, other);
      EXPECT_TRUE(room == below || (!room.empty() && all.at(room).contains(below)))
          << file << " includes " << other << ": '" << room << "' is not above '" << below << "'";
    }
  }
}

TEST_F(Layers, TheInstrumentKnowsNoLaboratory) {
  const std::string lab = "perf/lab/";
  size_t inside = 0;
  for (const auto& [file, included] : includes_) {
    if (file.starts_with(lab)) {
      inside += includes_lab_library(fs::path(PALPATE_SOURCE_DIR) / file);
      continue;
    }
    for (const std::string& other : included)
      EXPECT_FALSE(other.starts_with(lab)) << file << " includes " << other;
    EXPECT_EQ(includes_lab_library(fs::path(PALPATE_SOURCE_DIR) / file),
              file == "capture/hdf5/module/handle.h")
        << file << ": HDF5 is for perf/lab and a module of capture's, MPI for perf/lab alone";
  }
  EXPECT_EQ(inside, 2u) << "data sets and processes";
}

TEST_F(Layers, ComponentsDoNotNeedEachOther) {
  std::map<std::string, Names> needs;
  for (const auto& [file, included] : includes_)
    for (const std::string& other : included)
      if (component(other) != component(file)) needs[component(file)].insert(component(other));
  // Depth first; what is met again on the way down closes a circle.
  Names done;
  std::vector<std::string> way;
  const std::function<void(const std::string&)> visit = [&](const std::string& at) {
    const auto met = std::find(way.begin(), way.end(), at);
    if (met != way.end()) {
      std::string circle;
      for (auto step = met; step != way.end(); ++step) circle += *step + " -> ";
      ADD_FAILURE() << "a circle of includes: " << circle << at;
      return;
    }
    if (done.contains(at)) return;
    way.push_back(at);
    for (const std::string& next : needs[at]) visit(next);
    way.pop_back();
    done.insert(at);
  };
  for (const auto& [file, included] : includes_) visit(component(file));
}

}  // namespace
}  // namespace palpate
