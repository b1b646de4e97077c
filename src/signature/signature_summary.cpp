#include "signature/signature_summary.h"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <numeric>

#include "signature/rest/known_rest_poses.h"
#include "signature/table/axis_labels.h"

namespace pilesim {
namespace {

__attribute__((format(printf, 1, 2))) std::string format(const char* pattern, ...) {
  va_list arguments, again;
  va_start(arguments, pattern);
  va_copy(again, arguments);
  const int length = std::vsnprintf(nullptr, 0, pattern, arguments);
  std::string text(static_cast<size_t>(length), '\0');
  std::vsnprintf(text.data(), text.size() + 1, pattern, again);
  va_end(arguments);
  va_end(again);
  return text;
}

// Numbers are printed with three digits: avoid "-0.000".
Vec3 without_negative_zero(const Vec3& v) {
  return v.unaryExpr([](double x) { return std::abs(x) < 5e-4 ? 0.0 : x; });
}

std::string axis_text(const Axis& axis) {
  return format("%s %zu (%.3g .. %.3g %s%s)", axis.name.c_str(), axis.size(), axis.nodes.front(),
                axis.nodes.back(), axis.unit.c_str(), axis.period > 0 ? ", periodic" : "");
}

std::string body_text(const Signature& s) {
  const SignatureBody& b = s.body;
  const Vec3& c = b.centre_of_mass;
  return format("%s  mesh %s\n", b.mesh.c_str(), b.mesh_hash.c_str()) +
         format("  volume %.4g m^3, hull of %u vertices, outer radius %.4g m\n", b.volume_m3,
                b.hull_vertices, b.outer_radius_m) +
         format("  centre of mass (%.4g, %.4g, %.4g) m\n", c.x(), c.y(), c.z()) +
         format("  principal inertia per kg (%.4g, %.4g, %.4g) m^2, radius of gyration %.4g m\n",
                b.inertia_m2.x(), b.inertia_m2.y(), b.inertia_m2.z(), b.gyration_m) +
         format("material: restitution %.3g, friction %.3g", s.material.restitution,
                s.material.friction) +
         (s.material.scale_free()
              ? "\n"
              : format(", no bounce below %.3g m/s\n", s.material.restitution_threshold_m_s));
}

std::string heights_text(const CollisionHeightTable& t) {
  const auto trials = std::accumulate(t.trials.begin(), t.trials.end(), 0.0);
  const auto [low, high] = std::minmax_element(t.mean_m.begin(), t.mean_m.end());
  const float error = *std::max_element(t.error_m.begin(), t.error_m.end());
  const bool fitted = trials == 0;
  return format("collision height: %s layout, keys %s, %s%s\n", layout_name(t.layout).c_str(),
                axis_text(t.spin).c_str(), axis_text(t.tilt).c_str(), fitted ? ", fitted" : "") +
         format("  mean %.4g .. %.4g m", *low, *high) +
         (fitted
              ? "\n"
              : format(", %.0f effective trials, standard error at most %.2g m\n", trials, error));
}

std::string origin_text(const Signature& s) {
  const ResponseTable& t = s.responses;
  std::string text = format(
      "collision response: %s layout, %s, seed %llu\n", layout_name(t.layout).c_str(),
      s.kind == TrialKind::macro ? "until the body leaves the plane (macro)" : "one impact (micro)",
      static_cast<unsigned long long>(s.seed));
  if (s.collisions) {
    text +=
        format("  from %llu collisions of %s\n",
               static_cast<unsigned long long>(s.collisions->count), s.collisions->file.c_str());
  }
  text += "  keys";
  for (const Axis& axis : t.axes) text += " " + axis_text(axis);
  return text + "\n";
}

std::string growth_text(const ResponseTable& t) {
  if (t.most_growth <= 1) return {};
  return format("  sqrt(v^2 + k^2 w^2) grows up to %.3g times (99%% of trials)\n", t.most_growth);
}

std::string spline_text(const char* name, const SplineField& field) {
  std::string degrees, points;
  for (const SplineAxis& axis : field.axes) {
    degrees += (degrees.empty() ? "" : " ") + std::to_string(axis.basis.degree());
    points += (points.empty() ? "" : " x ") + std::to_string(axis.basis.control_points());
  }
  const auto [fewest, most] = std::minmax_element(field.bits.begin(), field.bits.end());
  return format("  %s: %s control points of %zu values, degrees %s, %d .. %d bits, %zu bytes\n",
                name, points.c_str(), field.width, degrees.c_str(), *fewest, *most,
                packed_size(field.control_points(), field.bits));
}

std::string fit_text(const Signature& s) {
  const ResponseFit& fit = *s.fit;
  return origin_text(s) +
         format("  fitted B-splines, %s coordinates, %s parameters\n",
                coordinates_name(fit.coordinates).c_str(),
                parametrisation_name(fit.parametrisation).c_str()) +
         spline_text("mean", fit.mean) + spline_text("spread", fit.spread) +
         growth_text(s.responses);
}

// Lists cells that took the response of others: their number per node of each axis, and the first
// ones by their keys.
constexpr size_t kEmptyListed = 8;

std::string empty_text(const ResponseTable& t) {
  const auto empty = static_cast<size_t>(std::ranges::count(t.trials, 0.0F));
  if (empty == 0) return {};
  std::string text = format(
      "  %zu cells had too few collisions and have the response of the nearest others\n", empty);
  for (size_t axis = 0; axis < 4; ++axis) {
    std::vector<size_t> counts(t.axes[axis].size(), 0);
    for (size_t cell = 0; cell < t.cell_count(); ++cell) {
      if (t.trials[cell] == 0) ++counts[t.cell_index(cell)[axis]];
    }
    text += format("    by %s, of %zu each:", label(t.axes[axis]).c_str(),
                   t.cell_count() / counts.size());
    for (size_t node = 0; node < counts.size(); ++node) {
      text += format(" %.3g: %zu%s", shown(t.axes[axis], node), counts[node],
                     node + 1 < counts.size() ? "," : "\n");
    }
  }
  size_t listed = 0;
  for (size_t cell = 0; cell < t.cell_count() && listed < kEmptyListed; ++cell) {
    if (t.trials[cell] != 0) continue;
    const std::array<uint32_t, 4> index = t.cell_index(cell);
    text += listed++ == 0 ? "    they are (" : ", (";
    for (size_t axis = 0; axis < 4; ++axis) {
      text += format("%s%.3g", axis == 0 ? "" : " ", shown(t.axes[axis], index[axis]));
    }
    text += ")";
  }
  return text + (empty > listed ? format(" and %zu more\n", empty - listed) : "\n");
}

std::string responses_text(const Signature& s) {
  const ResponseTable& t = s.responses;
  const auto [fewest, most] = std::minmax_element(t.trials.begin(), t.trials.end());
  // Standard error of the mean velocity and of the mean spin, root mean square over cells.
  double squares[2] = {0, 0};
  for (size_t i = 0; i < t.mean_error.size(); ++i) {
    squares[i % 6 < 3 ? 0 : 1] += static_cast<double>(t.mean_error[i]) * t.mean_error[i];
  }
  const double cells = static_cast<double>(t.cell_count());
  const bool raw = t.layout == TableLayout::dissertation;
  std::string text = origin_text(s);
  text +=
      format("  %zu cells, %.0f .. %.0f effective trials a cell\n", t.cell_count(), *fewest, *most);
  text += empty_text(t);
  text +=
      format("  standard error of the mean (rms over cells): v %.2g%s, %s %.2g%s\n",
             std::sqrt(squares[0] / cells), raw ? " m/s" : "", raw ? "w" : "k w",
             std::sqrt(squares[1] / cells), raw ? " rad/s" : ", in units of sqrt(v^2 + k^2 w^2)");
  text += growth_text(t);
  if (t.exemplar_count > 0) text += format("  %u exemplars a cell\n", t.exemplar_count);
  return text;
}

// A round side has dozens of poses: further ones are counted, not listed.
constexpr size_t kPosesListed = 12;

std::string pose_list(const Signature& s, const char* source) {
  std::string text;
  size_t left = 0;
  double left_probability = 0;
  for (const KnownRestPose& p : s.rest_poses) {
    if (p.source != source) continue;
    if (std::count(text.begin(), text.end(), '\n') >= static_cast<ptrdiff_t>(kPosesListed)) {
      ++left;
      left_probability += p.probability;
      continue;
    }
    const Vec3 up = without_negative_zero(p.up);
    text += format("  %5.1f%% (%.1f .. %.1f)  height %.4g m  up (%.3f, %.3f, %.3f)  by %s\n",
                   100 * p.probability, 100 * p.probability_low, 100 * p.probability_high,
                   p.height_m, up.x(), up.y(), up.z(), source);
  }
  if (left > 0) {
    text += format("  %5.1f%% in %zu more by %s\n", 100 * left_probability, left, source);
  }
  return text;
}

std::string agreement_text(const Signature& s) {
  const std::vector<RestPoseComparison> families = compare_rest_poses(s.rest_poses, s.rest_drops);
  if (families.empty()) return {};
  std::string text = format(
      "rest poses by geometry against %u simulated drops (within %.0f degrees; poses above "
      "%.0f%% in one must be above %.1f%% in the other):\n",
      s.rest_drops, degrees(kRestPoseAngle), 100 * kLeastRestProbability,
      100 * kRestAgreement * kLeastRestProbability);
  size_t apart = 0;
  for (const RestPoseComparison& f : families) {
    const Vec3 up = without_negative_zero(f.up);
    text += format("  geometry %5.1f%%  simulation %5.1f%% (%.1f .. %.1f)  up (%.3f, %.3f, %.3f)",
                   100 * f.by_geometry, 100 * f.by_simulation, 100 * f.simulation_low,
                   100 * f.simulation_high, up.x(), up.y(), up.z());
    if (f.poses > 1) text += format(" and %zu more of its family", f.poses - 1);
    text += f.agrees ? "\n" : "  DIFFERS\n";
    apart += f.agrees ? 0 : 1;
  }
  text += apart == 0 ? "  they agree on which poses exist\n"
                     : format("  they do not agree on %zu of %zu poses\n", apart, families.size());
  return text;
}

std::string rest_text(const Signature& s) {
  if (s.rest_poses.empty()) return "rest poses: none recorded\n";
  return "rest poses:\n" + pose_list(s, "geometry") + pose_list(s, "simulation") +
         agreement_text(s);
}

std::string packing_text(const Signature& s) {
  if (!s.packing) return "packing: not measured\n";
  const Packing& p = *s.packing;
  const double r = s.body.outer_radius_m;
  const auto row = [&](const char* name, double PackingFigures::*figure, double unit,
                       const char* unit_name) {
    if (p.measured.*figure == 0) return format("  %-29s not told: too few lie there\n", name);
    const std::string error = p.pours > 1 ? format(" +- %.2g", unit * p.error.*figure) : "";
    return format("  %-29s %.4g%s%s, spheres %.4g\n", name, unit * p.measured.*figure,
                  error.c_str(), unit_name, unit * p.spheres.*figure);
  };
  return format("packing: poured %u times into two heaps and a column, and let go one by one\n",
                p.pours) +
         row("heap, mean height", &PackingFigures::heap_height, r, " m") +
         row("heap, mean radius", &PackingFigures::heap_spread, r, " m") +
         row("heap, reach below centres", &PackingFigures::heap_reach, r, " m") +
         row("larger heap, mean height", &PackingFigures::large_heap_height, r, " m") +
         row("larger heap, mean radius", &PackingFigures::large_heap_spread, r, " m") +
         row("column, mean height", &PackingFigures::column_height, r, " m") +
         row("column, mean radius", &PackingFigures::column_spread, r, " m") +
         row("column, reach below centres", &PackingFigures::column_reach, r, " m") +
         row("column, solid share", &PackingFigures::column_fraction, 1, "") +
         row("column, of its lower half", &PackingFigures::column_deep_fraction, 1, "") +
         row("column, nearest centres", &PackingFigures::column_nearest, r, " m") +
         row("alone, dropped, goes", &PackingFigures::dropped, r, " m") +
         row("alone, thrown, goes", &PackingFigures::thrown, r, " m") +
         format(
             "  among others a ball of %.4g m; rolling resistance %.3g; impacts turn it by "
             "%.3g, walls at %.3g sqrt(g / R); rebounds from surfaces by %.3g\n",
             p.radius_m, p.rolling, p.turning, p.leaning, p.rebound);
}

}  // namespace

std::string fit_report_text(const FitRun& run) {
  std::string text;
  if (!run.curve.empty()) {
    text += "size against error (units of sqrt(v^2 + k^2 w^2)):\n      bytes  expected  measured\n";
    for (size_t i = 0; i < run.curve.size(); ++i) {
      const FitCurvePoint& p = run.curve[i];
      text += format("  %9zu    %.4f", p.bytes, p.expected_error) +
              (p.distance ? format("    %.4f", *p.distance) : std::string("         -")) +
              (i == run.chosen ? "  chosen\n" : "\n");
    }
  }
  const bool raw = run.table.responses.layout == TableLayout::dissertation;
  text += format("residuals, fit less table at the nodes%s:\n  %-32s       rms   largest\n",
                 raw ? " (m/s, rad/s)" : " (units of sqrt(v^2 + k^2 w^2))", "");
  for (const FitResidual& r : run.residuals) {
    text += format("  %-32s  %8.4f  %8.4f\n", r.component.c_str(), r.rms, r.largest);
  }
  return text;
}

std::string accuracy_text(const AccuracyReport& r) {
  std::string text = format(
      "accuracy: sliced Wasserstein-2 distance to %u x %u fresh trials, in units of "
      "sqrt(v^2 + k^2 w^2)\n",
      r.collisions, r.trials);
  for (const ModelAccuracy& m : r.models) {
    text += format("  %-26s %.4f (worst %.3f)  before limits: energy gain %.2f%%, inward %.2f%%\n",
                   m.model.c_str(), m.distance, m.worst, 100 * m.energy_gain, 100 * m.inward);
  }
  text += format("  %-26s %.4f\n", "noise floor", r.noise_floor);
  text += format(
      "  true responses that gain v^2 + k^2 w^2: %.2f%%; variance of the mean collision "
      "height left unexplained: %.1f%%\n",
      100 * r.true_energy_gain, 100 * r.height_unexplained);
  return text;
}

std::string summary_text(const Signature& signature) {
  std::string text = body_text(signature) + heights_text(signature.heights) +
                     (signature.fit ? fit_text(signature) : responses_text(signature)) +
                     rest_text(signature) + packing_text(signature);
  if (signature.accuracy) text += accuracy_text(*signature.accuracy);
  return text;
}

}  // namespace pilesim
