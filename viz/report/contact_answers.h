// One contact by each available formula, against the exact solution of indentation.h.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "engine/elasticity/modulus/indentation.h"

namespace palpate {

/// From this Poisson ratio on the published corrections, made for 0.5, are meant.
inline constexpr double kIncompressiblePoisson = 0.49;

/// One formula's answer.
struct ContactAnswer {
  std::string name, key;
  Indentation contact;
  double off = 0;    ///< its force at the reference's depth over the reference's, less 1
  std::string note;  ///< why not to trust it
};

struct ContactProblem {
  Pad pad;
  Indenter indenter;
  bool by_force = true;
  double wanted = 0;
  double layers_paper_MPa = 0, layers_weighted_MPa = 0;  ///< 0: one layer only
};

struct ContactAnswers {
  std::optional<Indentation> exact;  ///< none where the contact is wider than the solver or the sphere goes
  std::vector<ContactAnswer> ways;   ///< the exact one first
  /// Reasons why plain Hertz, or all of it, is doubtful here, with the size of the error where it is known.
  std::vector<std::string> warnings;
};
/// Throws Error(Failure::Input) on a problem out of range.
ContactAnswers contact_answers(const ContactProblem& problem);

}  // namespace palpate
