#include "signature/spline/fit_search.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "core/error.h"
#include "core/parallel_for.h"

namespace pilesim {
namespace {

constexpr std::array kSteps = {0.002, 0.003, 0.004, 0.006, 0.008, 0.012,
                               0.016, 0.024, 0.032, 0.048, 0.064};
constexpr size_t kLongestMove = 3;  // most control points that one move adds
// Control points exceed the data's range by about this share of it.
constexpr double kOvershoot = 0.2;
constexpr double kFewestBits = 5;  // per level; bounds the number of control points tried

struct Option {
  SplineSize size;
  double step = 0;
  size_t bytes = 0;
  double error2 = 0;
};

// The search for one of the two splines.
class SizeSearch {
 public:
  SizeSearch(const ResponseTable& table, const FitProblem& problem, Parametrisation parametrisation,
             int most_degree, double unit)
      : table_(table),
        problem_(problem),
        axes_(problem.axes(table, constant_size(), parametrisation)),
        most_degree_(most_degree),
        unit_(unit) {
    for (const FitPart& part : problem.parts) {
      residuals_.emplace_back(part.data, part.weights);
      for (size_t k = 0; k < part.data.width; ++k) {
        double low = part.data.values[k], high = low;
        for (size_t i = k; i < part.data.values.size(); i += part.data.width) {
          low = std::min(low, part.data.values[i]);
          high = std::max(high, part.data.values[i]);
        }
        ranges_.push_back((high - low) * (1 + kOvershoot));
      }
    }
  }

  // Options by rising bytes and falling error.
  std::vector<Option> run(size_t most_bytes) const {
    std::vector<Option> options;
    SplineSize size = constant_size();
    double error2 = expected_error2(size).value();
    while (true) {
      add_options(size, error2, most_bytes, options);
      const std::optional<Move> move = best_move(size, error2, most_bytes);
      if (!move) break;
      size = move->size;
      error2 = move->error2;
    }
    std::sort(options.begin(), options.end(), [](const Option& a, const Option& b) {
      return std::pair(a.bytes, a.error2) < std::pair(b.bytes, b.error2);
    });
    std::vector<Option> front;
    for (const Option& option : options) {
      if (front.empty() || option.error2 < front.back().error2) front.push_back(option);
    }
    return front;
  }

 private:
  struct Move {
    SplineSize size;
    double error2, gain;
  };

  static SplineSize constant_size() {
    return {.degree = {0, 0, 0, 0}, .control_points = {1, 1, 1, 1}};
  }

  std::vector<SplineAxis> axes_of(const SplineSize& size) const {
    std::vector<SplineAxis> axes = axes_;
    for (size_t i = 0; i < axes.size(); ++i) {
      axes[i].basis = BSplineBasis(size.degree[i], size.control_points[i], axes[i].axis.period > 0);
    }
    return axes;
  }

  // Empty where a control point sees no data.
  std::optional<double> expected_error2(const SplineSize& size) const {
    const auto axes = axes_of(size);
    double residual = 0;
    try {
      for (const SeparableResidual& part : residuals_) residual += part.of(axes);
    } catch (const Error&) {
      return std::nullopt;
    }
    const auto cells = static_cast<double>(table_.cell_count());
    const double share = static_cast<double>(size.count()) / cells;
    // The residual lacks the noise that the fit follows and contains the noise that it does not.
    return std::max(residual / cells - problem_.noise * (1 - 2 * share), problem_.noise * share);
  }

  SplineSize grown(const SplineSize& size, size_t axis, int by) const {
    SplineSize next = size;
    next.control_points[axis] += by;
    next.degree[axis] = std::min(most_degree_, next.control_points[axis] - 1);
    return next;
  }

  std::optional<Move> best_move(const SplineSize& size, double error2, size_t most_bytes) const {
    std::vector<std::optional<Move>> moves(4 * kLongestMove);
    parallel_for(moves.size(), 1, [&](size_t begin, size_t end) {
      for (size_t i = begin; i < end; ++i) {
        const SplineSize next =
            grown(size, i / kLongestMove, 1 + static_cast<int>(i % kLongestMove));
        const auto points = static_cast<size_t>(next.control_points[i / kLongestMove]);
        const double bytes = static_cast<double>(next.count() * problem_.width()) * kFewestBits / 8;
        if (points > table_.axes[i / kLongestMove].size() ||
            bytes > static_cast<double>(most_bytes)) {
          continue;
        }
        if (const auto error = expected_error2(next)) {
          moves[i] = {next, *error,
                      (error2 - *error) / static_cast<double>(next.count() - size.count())};
        }
      }
    });
    std::optional<Move> best;
    for (const auto& move : moves) {
      if (move && move->gain > 0 && (!best || move->gain > best->gain)) best = move;
    }
    return best;
  }

  void add_options(const SplineSize& size, double error2, size_t most_bytes,
                   std::vector<Option>& options) const {
    // Share of the control points' rounding that remains in the surface: the mean square weight.
    double kept = 1;
    for (const SplineAxis& axis : axes_of(size)) {
      const std::vector<double> parameters(axis.parameters.begin(), axis.parameters.end());
      kept *= axis.basis.matrix(parameters).rowwise().squaredNorm().mean();
    }
    for (const double step : kSteps) {
      std::vector<uint8_t> bits;
      for (const double range : ranges_) {
        bits.push_back(static_cast<uint8_t>(std::ceil(std::log2(range / (step * unit_) + 1))));
      }
      const size_t bytes = packed_size(size.count(), bits);
      if (bytes > most_bytes) continue;
      const double rounding = static_cast<double>(problem_.width()) * step * step / 12 * kept;
      options.push_back({size, step, bytes, error2 + rounding});
    }
  }

  const ResponseTable& table_;
  const FitProblem& problem_;
  std::vector<SplineAxis> axes_;              // of constants
  std::vector<SeparableResidual> residuals_;  // of the problem's parts
  int most_degree_;
  double unit_;
  std::vector<double> ranges_;  // of the problem's values
};

}  // namespace

std::vector<FitCandidate> search_fits(const ResponseTable& table, double gyration_m,
                                      ResponseCoordinates coordinates,
                                      Parametrisation parametrisation, int most_degree,
                                      size_t most_bytes) {
  const FitProblem mean = mean_problem(table, gyration_m, coordinates);
  const FitProblem spread = spread_problem(table, gyration_m);
  const auto means =
      SizeSearch(table, mean, parametrisation, most_degree, rounding_unit(table, gyration_m))
          .run(most_bytes);
  const auto spreads = SizeSearch(table, spread, parametrisation, most_degree, 1).run(most_bytes);

  std::vector<FitCandidate> all;
  for (const Option& m : means) {
    for (const Option& s : spreads) {
      if (m.bytes + s.bytes > most_bytes) break;
      all.push_back({.settings = {.coordinates = coordinates,
                                  .parametrisation = parametrisation,
                                  .mean = m.size,
                                  .spread = s.size,
                                  .mean_step = m.step,
                                  .spread_step = s.step},
                     .level_bytes = m.bytes + s.bytes,
                     .expected_error = std::sqrt((m.error2 + s.error2) / 6)});
    }
  }
  std::stable_sort(all.begin(), all.end(), [](const FitCandidate& a, const FitCandidate& b) {
    return std::pair(a.level_bytes, a.expected_error) < std::pair(b.level_bytes, b.expected_error);
  });
  std::vector<FitCandidate> front;
  for (const FitCandidate& candidate : all) {
    if (front.empty() || candidate.expected_error < front.back().expected_error) {
      front.push_back(candidate);
    }
  }
  return front;
}

}  // namespace pilesim
