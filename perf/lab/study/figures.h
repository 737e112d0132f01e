// The paper's Figures 17 and 19 to 22 from our own forward model (Figure 18 is in
// lump_network_figure.h): what the inclusions of its phantoms show at its forces, and how the map changes
// with each of the six inputs.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "engine/fem/large_strain/large_strain.h"
#include "engine/fem/scene.h"
#include "engine/lump/observation/gaussian_profile.h"

namespace palpate::lump {

/// One press of one phantom. Where `good` is false the press ended before its force, and only
/// `last_force_N` is to be used.
struct FigurePress {
  std::string name;  ///< as the plots have it
  fem::Scene scene;
  double wanted_N = 0;
  bool good = false;
  double last_force_N = 0;
  fem::PressedBlock press;
  Profile profile;  ///< pressure, Pa, along x through the bump
  GaussianFit fit;  ///< of the profile within four tenths of the block on either side
  Profile bump;     ///< the same less that of the block without the inclusion at the same force
  GaussianFit bump_fit;
};

/// The paper's values for a line in Fig. 20 or 22, without units: a in gray levels (its 2323 for 12 mm is
/// beyond 8 bits; 232.3 fits its figure), sigma^2 in squares of its own pixels or mm.
struct PaperFit {
  double amplitude_gray = 0, variance = 0;
};

struct FigureRow {
  FigurePress press;
  PaperFit paper;
};

/// The phantoms of Sect. 5.3. The paper names its materials, not their moduli.
struct FigureOptions {
  double tissue_Pa = 4000;
  double play_doh_Pa = 40000;  ///< flour dough: 15 to 90 kPa
  double rubber_Pa = 2000000;  ///< of a ball: 1 to 5 MPa
  std::array<uint32_t, 3> cells = {32, 32, 16};
};

struct Figures {
  std::vector<FigureRow> by_size;      ///< Fig. 19, 20: 12, 8 and 4 mm of Play-Doh at 2 N
  std::vector<FigureRow> by_material;  ///< Fig. 21, 22: 8 mm of rubber and of Play-Doh at 2.35 N
};
/// `done` hears how many presses of how many are ready. Throws what the solver throws.
Figures make_figures(const FigureOptions& options, const fem::PressSolver& solver,
                     const std::function<void(uint64_t done, uint64_t total)>& done);

/// Larger amplitudes for larger and for stiffer inclusions, of the profile and of the bump alone: what the
/// paper's own numbers show. One line for each that does not hold.
std::vector<std::string> broken_orderings(const Figures& figures);

/// One input of Fig. 17 changed by itself.
struct InputRow {
  std::string input;  ///< "d", "h", "E_r", "s", "t", "l"
  double value = 0;   ///< mm, a ratio, N of the load; of shapes their number
  FigurePress press;
  std::optional<Profile> small_strain;  ///< of "l": what linear elasticity says at that force
};
/// Around 8 mm, 5 mm deep, Play-Doh, 2 N (a quarter of the block). What does not fit the block is left out.
std::vector<InputRow> vary_inputs(const FigureOptions& options, const fem::PressSolver& solver,
                                  const std::function<void(uint64_t done, uint64_t total)>& done);

}  // namespace palpate::lump
