#include "viz/report/contact_answers.h"

#include <cmath>
#include <cstdio>
#include <limits>
#include <tuple>

#include "engine/base/text.h"
#include "palpate/error.h"

namespace palpate {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

Indentation ask(const ContactProblem& p, const PadIndenter& indenter) {
  return p.by_force ? indenter.at_force(p.wanted) : indenter.at_depth(p.wanted);
}

/// A published correction of the sphere's force for the pad's thickness.
ContactAnswer corrected(const ContactProblem& p, ThicknessModel model, const char* name, const char* key,
                        double modulus_MPa) {
  ContactAnswer a;
  a.name = name;
  a.key = key;
  const double r = p.indenter.radius_mm, h = p.pad.thickness_mm;
  Indentation& c = a.contact;
  c.depth_mm = p.by_force ? sphere_indentation_mm(model, p.wanted, modulus_MPa, r, h) : p.wanted;
  c.force_N = p.by_force ? p.wanted : sphere_force_N(model, p.wanted, modulus_MPa, r, h);
  c.radius_mm = sphere_contact_radius_mm(model, c.depth_mm, r, h);
  c.pressure_max_MPa = std::numeric_limits<double>::quiet_NaN();
  const double chi = std::sqrt(r * c.depth_mm) / h, limit = thickness_model_limit(model);
  if (chi > limit) a.note = text("sqrt(R d)/H = %.2f, good up to %.2f", chi, limit);
  return a;
}

std::vector<ContactAnswer> answers_of(const ContactProblem& p, std::optional<Indentation>& reference,
                                      std::string& why_none) {
  std::vector<ContactAnswer> answers;
  const bool sphere = p.indenter.shape == IndenterShape::Sphere, thin = std::isfinite(p.pad.thickness_mm);
  const PadIndenter exact(p.pad, p.indenter);
  const double modulus = exact.effective_modulus_MPa();
  try {
    reference = ask(p, exact);
    answers.push_back(
        {thin ? "exact, on the pad's thickness" : "exact, half space", "exact", *reference, 0, ""});
  } catch (const Error& error) {
    why_none = error.what();
  }
  Pad deep = p.pad;
  deep.thickness_mm = kInfinite;
  Indenter parabola = p.indenter;
  if (sphere) parabola.shape = IndenterShape::Paraboloid;
  const auto closed = [&](const char* name, const char* key, const Indenter& indenter) {
    const PadIndenter solver(deep, indenter);
    ContactAnswer a{name, key, ask(p, solver), 0, ""};
    if (reference && reference->force_N > 0)
      a.off = solver.at_depth(reference->depth_mm).force_N / reference->force_N - 1;
    answers.push_back(a);
  };
  if (sphere)
    closed("Hertz", "hertz", parabola);
  else if (thin)
    closed(p.indenter.shape == IndenterShape::Cone ? "Sneddon's cone, half space" : "flat punch, half space",
           "half_space", p.indenter);
  if (!thin || p.pad.material.poisson < kIncompressiblePoisson || !std::isinf(p.indenter.material.young_MPa))
    return answers;
  const auto add = [&](ContactAnswer a, double force_at_reference) {
    if (reference && reference->force_N > 0) a.off = force_at_reference / reference->force_N - 1;
    answers.push_back(a);
  };
  const double d = reference ? reference->depth_mm : 0, r = p.indenter.radius_mm, h = p.pad.thickness_mm;
  if (sphere && p.pad.base == Base::Bonded) {
    for (const auto& [model, name, key] :
         {std::tuple(ThicknessModel::Dimitriadis, "Dimitriadis 2002, bonded", "dimitriadis"),
          std::tuple(ThicknessModel::Garcia, "Garcia and Garcia 2018, bonded", "garcia")})
      add(corrected(p, model, name, key, modulus), sphere_force_N(model, d, modulus, r, h));
  } else if (sphere) {
    const auto model = ThicknessModel::DimitriadisUnbonded;
    add(corrected(p, model, "Dimitriadis 2002, sliding", "dimitriadis_sliding", modulus),
        sphere_force_N(model, d, modulus, r, h));
  } else if (p.indenter.shape == IndenterShape::FlatPunch && p.pad.base == Base::Bonded) {
    const double stiffness = 2 * modulus * r * flat_punch_thickness_factor(r / h);
    ContactAnswer a;
    a.name = "Garcia and Garcia 2018, bonded";
    a.key = "garcia";
    a.contact.force_N = p.by_force ? p.wanted : p.wanted * stiffness;
    a.contact.depth_mm = a.contact.force_N / stiffness;
    a.contact.radius_mm = r;
    a.contact.pressure_max_MPa = kInfinite;
    if (r > 0.7 * h) a.note = text("b/H = %.2f, good up to 0.7", r / h);
    add(a, d * stiffness);
  }
  return answers;
}

/// Reasons why plain Hertz, or all of it, is doubtful here, with the size of the error where it is known.
std::vector<std::string> warnings_of(const ContactProblem& p, const std::optional<Indentation>& reference,
                                     const std::string& why_none) {
  std::vector<std::string> lines;
  if (!reference) {
    lines.push_back("no exact answer: " + why_none + "; the closed forms below stand outside their validity");
    return lines;
  }
  if (!(reference->depth_mm > 0)) return lines;
  const HertzErrors e = hertz_errors(p.pad, p.indenter, *reference);
  const char* plain = p.indenter.shape == IndenterShape::Sphere ? "plain Hertz" : "the half space";
  if (std::abs(e.thickness) > 0.1)
    lines.push_back(
        text("the pad is thin for this contact (a/H = %.2f): %s makes the force at this depth %.1f %% "
             "too low",
             reference->radius_mm / p.pad.thickness_mm, plain, -100 * e.thickness));
  if (std::abs(e.parabola) > 0.04)
    lines.push_back(
        text("the contact is wide (a/R = %.2f): a paraboloid for the sphere makes the force at this "
             "depth %.1f %% too high",
             reference->radius_mm / p.indenter.radius_mm, 100 * e.parabola));
  const bool deep = reference->depth_mm > 0.3 * p.pad.thickness_mm ||
                    (p.indenter.shape != IndenterShape::Cone && reference->depth_mm > p.indenter.radius_mm);
  if (deep || e.strain > 0.1)
    lines.push_back(
        text("strains are not small (0.2 a/R = %.0f %%, depth %.2g mm): linear elasticity is beyond its "
             "range, by how "
             "much depends on the material and is not known here",
             100 * e.strain, reference->depth_mm));
  return lines;
}

}  // namespace

ContactAnswers contact_answers(const ContactProblem& problem) {
  ContactAnswers found;
  std::string why_none;
  found.ways = answers_of(problem, found.exact, why_none);
  found.warnings = warnings_of(problem, found.exact, why_none);
  return found;
}

}  // namespace palpate
