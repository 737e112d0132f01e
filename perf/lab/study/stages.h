// Steps of a lump network as its file has them: for pictures and for people.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace palpate::lump {

struct Model;

/// One step from an observation to what lies behind it.
struct Stage {
  enum class Kind : uint8_t {
    Given,    ///< inputs: an observation's or a lump's numbers
    Formula,  ///< a fixed rule with fitted numbers
    Network,  ///< layers, tanh between them
    Search,   ///< repeated until the two sides agree
  };
  Kind kind = Kind::Formula;
  std::string name;                  ///< "the block alone"
  std::vector<std::string> inputs;   ///< with units: "thickness, mm"
  std::vector<uint32_t> widths;      ///< numbers in, of each layer between, and out
  std::vector<std::string> outputs;  ///< with units
  uint32_t copies = 1;               ///< networks of one kind whose mean is used
};

/// In the order of work: the observation without its block, the network from bumps to lumps, the emulator
/// from lumps to bumps, the search that compares both, and the answer.
std::vector<Stage> lump_stages(const Model& model);

}  // namespace palpate::lump
