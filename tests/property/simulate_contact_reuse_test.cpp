// Reused contacts against contacts found again in the same poses.

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "simulate/exact/exact_constants.h"
#include "simulate/exact/pair.h"
#include "support/small_model.h"

namespace pilesim::exact {
namespace {

double deepest_m(const std::vector<Contact>& contacts) {
  double deepest = 1;
  for (const Contact& contact : contacts) deepest = std::min<double>(deepest, contact.distance_m);
  return deepest;
}

class ContactReuse : public testing::Test {
 protected:
  ContactReuse() {
    m_.box({0.4, 0.3, 0.2});
    std::vector<Vec3> points;
    std::mt19937 random(3);
    std::normal_distribution<double> normal;
    for (int i = 0; i < 30; ++i) {
      points.push_back(0.2 * Vec3(normal(random), normal(random), normal(random)).normalized());
    }
    m_.hull(points);
    for (const ModelShape& shape : m_.model.shapes) shapes_.emplace_back(shape);
    m_.body(0, m_.material(0, 0.5), Vec3::Zero());
    m_.body(1, 0, Vec3::Zero());
  }

  PosedBody posed(uint32_t shape, const Vec3& position, const Quat& orientation) const {
    Body body;
    body.shape = shape;
    body.moves = Moves::by_contacts;
    body.position = position;
    body.orientation = orientation;
    return PosedBody(body, shapes_[shape]);
  }

  Vec3 any_direction() {
    std::normal_distribution<double> normal;
    return Vec3(normal(random_), normal(random_), normal(random_)).normalized();
  }
  Quat any_turn(double angle) { return Quat(Eigen::AngleAxisd(angle, any_direction())); }

  std::vector<Contact> found(Pair& pair, const PosedBody& a, const PosedBody& b) {
    std::vector<Contact> contacts;
    pair.bound_m = pair.list_bound_m = -1;
    for (PiecePair& pieces : pair.pieces) pieces.bound_m = -1;
    find_contacts(pair, a, b, settings_, {}, contacts, scratch_);
    return contacts;
  }

  SmallModel m_;
  std::vector<CollisionShape> shapes_;
  ModelSurroundings surroundings_{m_.model, shapes_};
  NarrowSettings settings_{1.0 / 240, 9.81, &surroundings_};
  NarrowScratch scratch_;
  std::mt19937 random_{7};
};

TEST_F(ContactReuse, AreWrongByNoMoreThanTheMotionSince) {
  const double extent = smaller_extent(shapes_[0], shapes_[1]);
  const double most_m = exact_constants::kResolution * extent;
  int compared = 0;
  for (int i = 0; i < 300; ++i) {
    const PosedBody a = posed(0, 100 * any_direction(), any_turn(1.1 * i));
    const Quat turn = any_turn(0.7 * i);
    // From one direction until they nearly touch.
    const Vec3 way = any_direction();
    Pair pair{0, 1};
    Vec3 at = a.position + 0.5 * way;
    for (int k = 0; k < 20; ++k) {
      const double gap = deepest_m(found(pair, a, posed(1, at, turn)));
      if (std::abs(gap) < most_m) break;
      at -= std::min(gap, 0.01) * way;
    }
    const std::vector<Contact> contacts = found(pair, a, posed(1, at, turn));
    if (contacts.empty()) continue;
    // Both bodies move far together, but at most by `most_m` relative to each other.
    const Quat all = any_turn(1);
    const Vec3 from = 10 * any_direction(), by = 0.4 * most_m * any_direction();
    const Quat own = any_turn(0.4 * most_m / shapes_[1].radius_m);
    const PosedBody moved_a = posed(0, from + all * a.position, all * Quat(a.orientation));
    const PosedBody moved_b = posed(1, from + all * (at + by), all * own * turn);
    std::vector<Contact> reused;
    ASSERT_TRUE(reuse_contacts(pair, moved_a, moved_b, settings_, contacts, reused)) << i;
    ASSERT_EQ(reused.size(), contacts.size());
    Pair other{0, 1};
    const std::vector<Contact> again = found(other, moved_a, moved_b);
    EXPECT_NEAR(deepest_m(reused), deepest_m(again), 0.5 * most_m) << i;
    ++compared;
  }
  EXPECT_GT(compared, 250);
}

TEST_F(ContactReuse, IsRefusedBeyondThatMotionAndAheadOfAFastOne) {
  const double most_m = exact_constants::kResolution * smaller_extent(shapes_[0], shapes_[1]);
  const PosedBody a = posed(0, Vec3::Zero(), Quat::Identity());
  const Vec3 at(0, 0.28, 0);
  Pair pair{0, 1};
  const std::vector<Contact> contacts = found(pair, a, posed(1, at, Quat::Identity()));
  std::vector<Contact> reused;
  const auto is_reused = [&](const PosedBody& b) {
    return reuse_contacts(pair, a, b, settings_, contacts, reused);
  };
  EXPECT_TRUE(is_reused(posed(1, at, Quat::Identity())));
  EXPECT_FALSE(is_reused(posed(1, at + Vec3(1.01 * most_m, 0, 0), Quat::Identity())));
  EXPECT_FALSE(is_reused(posed(1, at, any_turn(1.01 * most_m / shapes_[1].radius_m))));
  PosedBody fast = posed(1, at, Quat::Identity());
  fast.velocity = {0, -2, 0};
  EXPECT_FALSE(is_reused(fast));
}

}  // namespace
}  // namespace pilesim::exact
