// Sampled responses against the distribution of the signature.

#include "signature/response_draw.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "core/philox.h"
#include "support/random_vectors.h"
#include "support/statistical_scene.h"

namespace pilesim {
namespace {

constexpr size_t kDraws = 4000;

// The largest distance between the two empirical distributions (Kolmogorov-Smirnov).
double largest_distance(std::vector<double> a, std::vector<double> b) {
  std::ranges::sort(a);
  std::ranges::sort(b);
  double largest = 0;
  size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    const double at = std::min(a[i], b[j]);
    while (i < a.size() && a[i] == at) ++i;
    while (j < b.size() && b[j] == at) ++j;
    largest = std::max(largest, std::abs(static_cast<double>(i) / static_cast<double>(a.size()) -
                                         static_cast<double>(j) / static_cast<double>(b.size())));
  }
  return largest;
}

class ResponseDraws : public test::StatisticalScene {
 protected:
  ResponseDraws() {
    add_shape("box", box_mesh({0.3, 0.2, 0.1}));
    signature_ = read_signature(directory_ / "box.sig");
    responses_.emplace(signature_);
    gyration_m_ = static_cast<float>(signature_.body.gyration_m);
  }
  std::vector<Vector6> draw(DrawModel model, const Vec3f& normal, const Vec3f& v, const Vec3f& w) {
    Philox random(5, Stream::test, 1);
    const WorkingFrame frame = working_frame(normal, v);
    const float measure = std::sqrt(v.squaredNorm() + gyration_m_ * gyration_m_ * w.squaredNorm());
    std::vector<Vector6> result;
    for (size_t i = 0; i < kDraws; ++i) {
      const ResponseDraw drawn = draw_response(*responses_, model, gyration_m_, kRestitution,
                                               kFriction, normal, v, w, random);
      Vector6 row;
      row << frame.to_frame(drawn.velocity) / measure,
          gyration_m_ / measure * frame.to_frame(drawn.spin);
      result.push_back(row);
    }
    return result;
  }
  // Normal distributions with the stated mean, covariance and limits, by another generator and the
  // plain formula.
  std::vector<Vector6> expected(const Vec3f& normal, const Vec3f& v, const Vec3f& w) {
    const WorkingFrame frame = working_frame(normal, v);
    Vector6 mean;
    SpreadFactor factor;
    responses_->evaluate(
        response_keys(responses_->table(), gyration_m_, frame.to_frame(v), frame.to_frame(w)), mean,
        factor);
    Eigen::Matrix<float, 6, 6> lower = Eigen::Matrix<float, 6, 6>::Zero();
    size_t at = 0;
    for (Eigen::Index i = 0; i < 6; ++i) {
      for (Eigen::Index j = 0; j <= i; ++j) lower(i, j) = factor[at++];
    }
    std::mt19937_64 generator(7);
    std::normal_distribution<float> normal_number;
    std::vector<Vector6> result;
    for (size_t n = 0; n < kDraws; ++n) {
      Vector6 number;
      for (Eigen::Index i = 0; i < 6; ++i) number(i) = normal_number(generator);
      Vector6 row = mean + lower * number;
      limit_response(responses_->table().most_growth, row);
      result.push_back(row);
    }
    return result;
  }
  // Limits put many samples on one value, which loses its last bits on the way to the world frame
  // and back.
  static double rounded(float value) { return std::round(1e5 * value); }
  static double worst(const std::vector<Vector6>& a, const std::vector<Vector6>& b) {
    double largest = 0;
    for (Eigen::Index i = 0; i < 6; ++i) {
      std::vector<double> x, y;
      for (const Vector6& row : a) x.push_back(rounded(row(i)));
      for (const Vector6& row : b) y.push_back(rounded(row(i)));
      largest = std::max(largest, largest_distance(x, y));
    }
    return largest;
  }

  Signature signature_;
  std::optional<ResponseModel> responses_;
  float gyration_m_ = 0;
};

// Also if it only spins, or comes straight down.
TEST(WorkingFrame, IsOrthonormalWhateverTheVelocity) {
  Philox random(3, Stream::test, 2);
  for (int i = 0; i < 20; ++i) {
    const Vec3f normal = random.direction().cast<float>();
    const Vec3f any = random.direction().cast<float>();
    for (const Vec3f& velocity : {Vec3f(Vec3f::Zero()), Vec3f(-3 * normal), any}) {
      const WorkingFrame frame = working_frame(normal, velocity);
      Mat3 axes;
      axes << frame.x.cast<double>(), frame.y.cast<double>(), frame.z.cast<double>();
      EXPECT_TRUE((axes.transpose() * axes).isIdentity(1e-5)) << velocity.transpose();
      EXPECT_EQ(frame.y, normal);
      EXPECT_GE(frame.to_frame(velocity).x(), -1e-5);
      EXPECT_NEAR(frame.to_frame(velocity).z(), 0, 1e-5);
    }
  }
}

TEST_F(ResponseDraws, FollowTheStatedDistribution) {
  // Exceeded by chance once in 10,000 comparisons.
  const double bound = 2.2 * std::sqrt(2.0 / kDraws);
  Philox random(1, Stream::test, 2);
  for (int i = 0; i < 12; ++i) {
    const Vec3f normal = random.direction().cast<float>();
    Vec3f v = random.direction().cast<float>();
    if (v.dot(normal) > 0) v = -v;
    const Vec3f w = test::random_arrow(random, 0, 10).cast<float>();
    EXPECT_LT(worst(draw(DrawModel::full, normal, v, w), expected(normal, v, w)), bound) << i;
    // The comparison detects a slightly different motion.
    EXPECT_GT(worst(draw(DrawModel::full, normal, v, w), expected(normal, v, w + 2 * normal)),
              bound)
        << i;
  }
}

TEST_F(ResponseDraws, ScaleWithTheMotion) {
  const Vec3f normal(0, 1, 0), v(0.6F, -0.8F, 0), w(3, 1, -2);
  const std::vector<Vector6> slow = draw(DrawModel::exemplars, normal, v, w);
  const std::vector<Vector6> fast = draw(DrawModel::exemplars, normal, 4 * v, 4 * w);
  for (size_t i = 0; i < kDraws; ++i) EXPECT_EQ(slow[i], fast[i]);
}

}  // namespace
}  // namespace pilesim
