#include "signature/accuracy.h"

#include <algorithm>
#include <cmath>

#include "core/parallel_for.h"

namespace pilesim {
namespace {

// Keeps the random sequences of the accuracy report apart from those of the tables.
constexpr uint64_t kAccuracyObjects = uint64_t{1} << 41;
constexpr uint64_t kSecondSample = uint64_t{1} << 42;
constexpr double kMostTheta = radians(84), kMostAlpha = radians(87);  // the tables' last nodes
constexpr double kSpeed_m_s = 5;  // sqrt(v^2 + k^2 w^2), in the middle of the dissertation's axes

TrialRequest held_out_collision(const TrialSetup& setup, uint32_t number) {
  Philox random(setup.seed, Stream::signature, kAccuracyObjects + number, 1);
  const double theta = std::asin(std::sin(kMostTheta) * std::sqrt(random.uniform()));
  const double alpha = random.uniform(0, kMostAlpha);
  TrialRequest request;
  request.velocity = kSpeed_m_s * std::cos(alpha) * Vec3(std::sin(theta), -std::cos(theta), 0);
  request.spin = kSpeed_m_s * std::sin(alpha) / setup.body->gyration_m * random.direction();
  return request;
}

Vector6 relative(const Vec3& velocity, const Vec3& spin, double gyration_m) {
  Vector6 response;
  response.head<3>() = (velocity / kSpeed_m_s).cast<float>();
  response.tail<3>() = (gyration_m / kSpeed_m_s * spin).cast<float>();
  return response;
}

struct TrueSample {
  std::vector<Vector6> responses;
  double mean_height = 0;
};

TrueSample true_sample(const TrialSetup& setup, TrialRequest request, uint64_t object,
                       uint32_t trials) {
  request.object = object;
  request.count = candidates_for(setup, request, trials);
  std::vector<TrialResult> results;
  run_trials(setup, std::span(&request, 1), results);
  TrueSample sample;
  for (const TrialResult& result : results) {
    if (!result.kept) continue;
    sample.responses.push_back(relative(result.velocity, result.spin, setup.body->gyration_m));
    sample.mean_height += result.height_m;
  }
  sample.mean_height /= static_cast<double>(std::max<size_t>(1, sample.responses.size()));
  return sample;
}

// The figures of one collision, one row per model.
struct Comparison {
  double floor = 0, true_gain = 0;
  double mean_height = 0, second_mean_height = 0, table_height = 0;
  std::vector<ModelAccuracy> models;
};

Comparison compare(const TrialSetup& setup, const CollisionHeightTable& heights,
                   const std::vector<ModelUnderTest>& models, const AccuracySettings& settings,
                   uint32_t number) {
  const TrialRequest request = held_out_collision(setup, number);
  const uint64_t object = kAccuracyObjects + number;
  const TrueSample truth = true_sample(setup, request, object, settings.trials);
  const TrueSample second = true_sample(setup, request, object + kSecondSample, settings.trials);
  const double k = setup.body->gyration_m;
  const Vec3f normal = Vec3f::UnitY();
  const Vec3f v = request.velocity.cast<float>(), w = request.spin.cast<float>();
  Comparison result;
  result.floor = sliced_wasserstein(truth.responses, second.responses, settings.slices);
  result.mean_height = truth.mean_height;
  result.second_mean_height = second.mean_height;
  result.table_height = collision_height(heights, static_cast<float>(k), normal, v, w).mean_m;
  for (const Vector6& r : truth.responses) result.true_gain += r.squaredNorm() > 1 ? 1 : 0;
  result.true_gain /= static_cast<double>(truth.responses.size());
  for (const ModelUnderTest& model : models) {
    Philox random(setup.seed, Stream::response, object);
    ModelAccuracy accuracy{.model = model.name};
    std::vector<Vector6> drawn;
    for (size_t i = 0; i < truth.responses.size(); ++i) {
      const ResponseDraw draw =
          draw_response(model.responses, model.model, static_cast<float>(k),
                        setup.material.restitution, setup.material.friction, normal, v, w, random);
      drawn.push_back(relative(draw.velocity.cast<double>(), draw.spin.cast<double>(), k));
      accuracy.energy_gain += draw.limits.energy_gain ? 1 : 0;
      accuracy.inward += draw.limits.inward ? 1 : 0;
    }
    accuracy.distance = sliced_wasserstein(truth.responses, drawn, settings.slices);
    accuracy.energy_gain /= static_cast<double>(drawn.size());
    accuracy.inward /= static_cast<double>(drawn.size());
    result.models.push_back(accuracy);
  }
  return result;
}

}  // namespace

double sliced_wasserstein(const std::vector<Vector6>& a, const std::vector<Vector6>& b,
                          uint32_t slices) {
  Philox random(0, Stream::signature, kAccuracyObjects - 1);
  std::vector<float> pa(a.size()), pb(b.size());
  double sum = 0;
  for (uint32_t slice = 0; slice < slices; ++slice) {
    Vector6 direction;
    for (Eigen::Index i = 0; i < 6; ++i) direction(i) = static_cast<float>(random.normal());
    direction.normalize();
    for (size_t i = 0; i < a.size(); ++i) pa[i] = direction.dot(a[i]);
    for (size_t i = 0; i < b.size(); ++i) pb[i] = direction.dot(b[i]);
    std::sort(pa.begin(), pa.end());
    std::sort(pb.begin(), pb.end());
    // Both quantile functions are step functions: walk their common refinement. Shares are counted
    // in units of 1 / (|a| |b|) to stay exact.
    size_t i = 0, j = 0, at = 0;
    const size_t all = a.size() * b.size();
    double squares = 0;
    while (at < all) {
      const size_t next = std::min((i + 1) * b.size(), (j + 1) * a.size());
      const double apart = static_cast<double>(pa[i]) - pb[j];
      squares += apart * apart * static_cast<double>(next - at);
      at = next;
      if (at == (i + 1) * b.size()) ++i;
      if (at == (j + 1) * a.size()) ++j;
    }
    sum += squares / static_cast<double>(all);
  }
  return std::sqrt(sum / slices);
}

AccuracyReport measure_accuracy(const TrialSetup& setup, const CollisionHeightTable& heights,
                                const std::vector<ModelUnderTest>& models,
                                const AccuracySettings& settings) {
  std::vector<Comparison> comparisons(settings.collisions);
  parallel_for(settings.collisions, 1, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      comparisons[i] = compare(setup, heights, models, settings, static_cast<uint32_t>(i));
    }
  });

  AccuracyReport report{.collisions = settings.collisions, .trials = settings.trials};
  const double count = settings.collisions;
  for (const ModelUnderTest& model : models) report.models.push_back({.model = model.name});
  double height_sum = 0;
  for (const Comparison& c : comparisons) {
    report.noise_floor += c.floor / count;
    report.true_energy_gain += c.true_gain / count;
    height_sum += (c.mean_height + c.second_mean_height) / 2;
    for (size_t m = 0; m < models.size(); ++m) {
      report.models[m].distance += c.models[m].distance / count;
      report.models[m].worst = std::max(report.models[m].worst, c.models[m].distance);
      report.models[m].energy_gain += c.models[m].energy_gain / count;
      report.models[m].inward += c.models[m].inward / count;
    }
  }
  // Multiply two independent samples instead of squaring one, so that the noise of their means
  // cancels.
  double variance = 0, unexplained = 0;
  for (const Comparison& c : comparisons) {
    const double mean = height_sum / count;
    variance += (c.mean_height - mean) * (c.second_mean_height - mean);
    unexplained += (c.mean_height - c.table_height) * (c.second_mean_height - c.table_height);
  }
  // A sphere has a single height, so there is no variance to explain.
  report.height_unexplained =
      variance > 1e-12 * height_sum * height_sum ? std::max(0.0, unexplained / variance) : 0;
  return report;
}

}  // namespace pilesim
