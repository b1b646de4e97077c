// Groups of contacts against the same contacts one at a time, in double.

#include "simulate/sphere/contact_groups.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "core/philox.h"
#include "core/types.h"

namespace pilesim {
namespace {

constexpr size_t kBodies = 60, kContacts = 400;
constexpr float kInverseStep = 60;

struct PlainMotion {
  Vec3 velocity, spin;
  double inverse_mass, inverse_inertia;
};

Vec3 random_vector(Philox& random) {
  return {random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
}

class ContactsInGroups : public testing::TestWithParam<uint64_t> {
 protected:
  ContactsInGroups() : random_(GetParam(), Stream::test, 0) {
    for (size_t i = 0; i < kBodies; ++i) {
      const bool moves = i % 10 != 0;
      motions_.push_back({random_vector(random_).cast<float>(),
                          moves ? static_cast<float>(random_.uniform(0.1, 3)) : 0,
                          random_vector(random_).cast<float>(),
                          moves ? static_cast<float>(random_.uniform(0.1, 9)) : 0});
    }
    std::vector<uint64_t> used(kBodies, 0);
    std::set<std::pair<uint32_t, uint32_t>> pairs;
    while (pairs.size() < kContacts) {
      const auto a = static_cast<uint32_t>(random_.uniform(0, kBodies));
      auto b = static_cast<uint32_t>(random_.uniform(0, kBodies));
      if (a == b || !pairs.insert(std::minmax(a, b)).second) continue;
      if (pairs.size() % 7 == 0) b = ContactGroups::kFixed | 1;
      slots_.push_back(contacts_.add(contact(a, b), used));
    }
    contacts_.clear_marks(used);
    EXPECT_EQ(std::ranges::count(used, 0), kBodies);
    // The contacts' own rows 0 and 1.
    motions_.emplace_back();
    motions_.push_back({.velocity = Vec3f(0.3F, 0, 0.1F)});
    contacts_.close(kBodies);
  }

  SphereContact contact(uint32_t a, uint32_t b) {
    const auto number = [&](double low, double high) {
      return static_cast<float>(random_.uniform(low, high));
    };
    return {.a = a,
            .b = b,
            .normal = random_vector(random_).normalized().cast<float>(),
            .gap = number(-0.02, 0.02),
            .arm_a = number(0.1, 0.5),
            .arm_b = number(0.1, 0.5),
            .friction = number(0, 1),
            .rolling_m = number(0, 0.1),
            .lift = number(0, 0.5),
            .impulse = {number(0, 0.2), 0.1F * random_vector(random_).cast<float>(),
                        0.1F * random_vector(random_).cast<float>()}};
  }

  Philox random_;
  std::vector<SphereMotion> motions_;
  ContactGroups contacts_;
  std::vector<uint32_t> slots_;
};

struct PlainContact {
  const ContactGroup& group;
  size_t lane;
  double normal_impulse;
  Vec3 friction, rolling;

  double of(const ContactGroup::Row& row) const { return row[lane]; }
  Vec3 normal() const { return group.normal_of(lane).cast<double>(); }

  void apply(const Vec3& push, const Vec3& turn, PlainMotion& a, PlainMotion& b) const {
    a.velocity += a.inverse_mass * push;
    a.spin += a.inverse_inertia * (turn - of(group.arm_a) * normal().cross(push));
    b.velocity -= b.inverse_mass * push;
    b.spin -= b.inverse_inertia * (turn + of(group.arm_b) * normal().cross(push));
  }
  void prepare(PlainMotion& a, PlainMotion& b) {
    friction -= friction.dot(normal()) * normal();
    apply(normal_impulse * normal() + friction, rolling, a, b);
  }
  static Vec3 limited(const Vec3& v, double limit) {
    return v.norm() > limit ? Vec3(v.normalized() * limit) : v;
  }
  void solve(PlainMotion& a, PlainMotion& b) {
    const Vec3 n = normal();
    const double inverse_mass = a.inverse_mass + b.inverse_mass;
    if (inverse_mass == 0) return;
    const double arm_a = of(group.arm_a), arm_b = of(group.arm_b);
    const Vec3 slip = a.velocity - arm_a * a.spin.cross(n) - b.velocity - arm_b * b.spin.cross(n);
    const double push =
        std::max(0.0, normal_impulse - (slip.dot(n) + std::max(0.0, of(group.gap)) * kInverseStep) /
                                           inverse_mass);
    const Vec3 along = slip - slip.dot(n) * n;
    const double across =
        inverse_mass + arm_a * arm_a * a.inverse_inertia + arm_b * arm_b * b.inverse_inertia;
    const Vec3 rub = limited(friction - along / across, of(group.friction) * push);
    const Vec3 turn = limited(rolling - (a.spin - b.spin) / (a.inverse_inertia + b.inverse_inertia),
                              of(group.rolling_m) * push);
    apply((push - normal_impulse) * n + rub - friction, turn - rolling, a, b);
    normal_impulse = push;
    friction = rub;
    rolling = turn;
  }
};

TEST_P(ContactsInGroups, ShareNoSphere) {
  for (const ContactGroup& group : contacts_.groups()) {
    std::set<uint32_t> met;
    for (size_t lane = 0; lane < kLanes; ++lane) {
      for (const uint32_t place : {group.a[lane], group.b[lane]}) {
        EXPECT_TRUE(place >= kBodies || met.insert(place).second);
      }
    }
  }
  EXPECT_EQ(std::set<uint32_t>(slots_.begin(), slots_.end()).size(), kContacts);
  EXPECT_LT(contacts_.groups().size(), kContacts / 4);
}

TEST_P(ContactsInGroups, AreSolvedAsOneByOne) {
  std::vector<PlainMotion> plain;
  for (const SphereMotion& m : motions_) {
    plain.push_back(
        {m.velocity.cast<double>(), m.spin.cast<double>(), m.inverse_mass, m.inverse_inertia});
  }
  std::vector<PlainContact> one_by_one;
  for (const ContactGroup& group : contacts_.groups()) {
    for (size_t lane = 0; lane < kLanes; ++lane) {
      const ContactImpulse impulse = group.impulse(lane);
      if (group.a[lane] >= kBodies) continue;
      one_by_one.push_back({group, lane, impulse.normal, impulse.friction.cast<double>(),
                            impulse.rolling.cast<double>()});
    }
  }
  ASSERT_EQ(one_by_one.size(), kContacts);
  const auto a = [&](const PlainContact& c) -> PlainMotion& { return plain[c.group.a[c.lane]]; };
  const auto b = [&](const PlainContact& c) -> PlainMotion& { return plain[c.group.b[c.lane]]; };
  for (PlainContact& c : one_by_one) c.prepare(a(c), b(c));
  prepare(contacts_.groups(), motions_);
  for (int sweep = 0; sweep < 3; ++sweep) {
    for (PlainContact& c : one_by_one) c.solve(a(c), b(c));
    solve(kInverseStep, contacts_.groups(), motions_);
  }
  for (size_t i = 0; i < plain.size(); ++i) {
    EXPECT_LT((motions_[i].velocity.cast<double>() - plain[i].velocity).norm(), 1e-4) << i;
    EXPECT_LT((motions_[i].spin.cast<double>() - plain[i].spin).norm(), 1e-3) << i;
    EXPECT_EQ(motions_[i].inverse_mass, static_cast<float>(plain[i].inverse_mass));
  }
}

TEST_P(ContactsInGroups, ComeApartAsOneByOne) {
  constexpr float kSlop = 0.005F;
  std::vector<SphereShift> shifts;
  std::vector<Vec3> plain;
  for (const SphereMotion& m : motions_) {
    shifts.push_back({0.01F * random_vector(random_).cast<float>(), m.inverse_mass});
    plain.push_back(shifts.back().way.cast<double>());
  }
  prepare(contacts_.groups(), motions_);
  for (const ContactGroup& group : contacts_.groups()) {
    for (size_t lane = 0; lane < kLanes; ++lane) {
      Vec3 &a = plain[group.a[lane]], &b = plain[group.b[lane]];
      const double mass_a = shifts[group.a[lane]].inverse_mass;
      const double mass_b = shifts[group.b[lane]].inverse_mass;
      if (group.a[lane] >= kBodies || mass_a + mass_b == 0) continue;
      const Vec3 n = group.normal_of(lane).cast<double>();
      const double depth = -(group.gap[lane] + n.dot(a - b)) - kSlop * group.arm_a[lane];
      if (depth <= 0) continue;
      const Vec3 push = group.lift[lane] * depth / (mass_a + mass_b) * n;
      a += mass_a * push;
      b -= mass_b * push;
    }
  }
  separate(kSlop, contacts_.groups(), shifts);
  for (size_t i = 0; i < plain.size(); ++i) {
    EXPECT_LT((shifts[i].way.cast<double>() - plain[i]).norm(), 1e-6) << i;
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, ContactsInGroups, testing::Range(uint64_t{1}, uint64_t{6}));

}  // namespace
}  // namespace pilesim
