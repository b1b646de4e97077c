// Depths of bodies in a pile, against lattices with known depths.

#include <gtest/gtest.h>

#include <algorithm>

#include "core/parallel_for.h"
#include "core/rotation.h"
#include "finish/burial.h"
#include "support/small_model.h"

namespace pilesim {
namespace {

constexpr double kRadius = 0.12, kSpacing = 0.15;  // m; the balls of a lattice leave no gaps
// A cell is half a radius wide. The centres of a ball and of the probe are each at most half a
// cell's diagonal from the middles of their cells, and the bound subtracts that once more.
constexpr double kError = 2 * 1.7321 * kRadius / 2;

struct Lattice : SmallModel {
  Lattice() { ball = sphere(kRadius); }

  // (2 side + 1)^3 balls about the origin.
  void fill(int side) {
    for (int x = -side; x <= side; ++x) {
      for (int y = -side; y <= side; ++y) {
        for (int z = -side; z <= side; ++z) add(kSpacing * Vec3(x, y, z));
      }
    }
  }
  uint32_t add(const Vec3& centre) {
    body(ball, stuff, centre);
    return static_cast<uint32_t>(model.bodies.size() - 1);
  }
  std::vector<double> depths() const { return depths_under_surface(model, states()); }
  // Depth of a ball this far from the outermost ones: its top is lower than theirs by this.
  static double layers(int count) { return count * kSpacing; }

  uint32_t ball = 0, stuff = material(0, 0.5);
};

uint32_t at(const Lattice& lattice, const Vec3& place) {
  for (uint32_t i = 0; i < lattice.model.bodies.size(); ++i) {
    if ((lattice.model.bodies[i].pose.position - place).norm() < 1e-9) return i;
  }
  ADD_FAILURE() << "no ball at " << place.transpose();
  return 0;
}

TEST(Burial, IsTheWayToTheNearestAirAndNotMore) {
  Lattice lattice;
  const int side = 5;
  lattice.fill(side);
  const std::vector<double> depths = lattice.depths();
  for (int layer = 0; layer <= side; ++layer) {
    const double depth = depths[at(lattice, kSpacing * Vec3(side - layer, 0, 0))];
    EXPECT_LE(depth, Lattice::layers(layer)) << layer;
    EXPECT_GE(depth, Lattice::layers(layer) - kError) << layer;
  }
}

TEST(Burial, AHoleThatIsOpenCountsAndOneThatIsClosedDoesNot) {
  for (const bool is_open : {true, false}) {
    Lattice lattice;
    for (int x = -4; x <= 4; ++x) {
      for (int y = -4; y <= 4; ++y) {
        for (int z = -4; z <= 4; ++z) {
          const bool is_hole = std::abs(x) <= 1 && std::abs(z) <= 1 && y >= 0;
          if (is_hole && (is_open || y < 3)) continue;
          lattice.add(kSpacing * Vec3(x, y, z));
        }
      }
    }
    const double depth = lattice.depths()[at(lattice, kSpacing * Vec3(0, -1, 0))];
    if (is_open) {
      EXPECT_EQ(depth, 0);
    } else {
      EXPECT_GT(depth, Lattice::layers(3) - kError);
    }
  }
}

// Between halves of a lattice: narrower than the probe, then wide enough for it.
TEST(Burial, AGapThatTheProbeDoesNotPassIsClosed) {
  for (const bool is_open : {false, true}) {
    Lattice lattice;
    const double gap = (is_open ? 2.5 : 0.75) * kRadius;
    for (int x = -4; x <= 4; ++x) {
      if (x == 0) continue;
      const double half = (x > 0 ? 1 : -1) * (gap / 2 + kRadius - kSpacing);
      for (int y = -4; y <= 4; ++y) {
        for (int z = -4; z <= 4; ++z) lattice.add(kSpacing * Vec3(x, y, z) + Vec3(half, 0, 0));
      }
    }
    const Vec3 beside(gap / 2 + kRadius, 0, 0);
    const double depth = lattice.depths()[at(lattice, beside)];
    if (is_open) {
      EXPECT_EQ(depth, 0);
    } else {
      EXPECT_GT(depth, Lattice::layers(3) - kError);  // the gap's mouth is wider
    }
  }
}

TEST(Burial, BodiesOnAPlaneAreNotSeenThroughIt) {
  Lattice lattice;
  lattice.fill(5);
  const std::vector<double> without = lattice.depths();
  const uint32_t lowest = at(lattice, kSpacing * Vec3(0, -5, 0));
  EXPECT_EQ(without[lowest], 0);
  lattice.body(lattice.plane(), lattice.stuff, Vec3(0, -5 * kSpacing - kRadius, 0), Role::fixed);
  EXPECT_GT(lattice.depths()[lowest], Lattice::layers(4) - kError);
}

TEST(Burial, BodiesBetweenPlanesAreSeenFromBetweenThem) {
  Lattice lattice;
  lattice.fill(4);
  const uint32_t ground = lattice.plane();
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {1.0, -1.0}) {
      lattice.body(ground, lattice.stuff, -sign * 1.0 * Vec3::Unit(axis), Role::fixed);
      lattice.model.bodies.back().pose.orientation =
          rotation_between(Vec3::UnitY(), sign * Vec3::Unit(axis));
    }
  }
  const std::vector<double> depths = lattice.depths();
  EXPECT_EQ(depths[at(lattice, kSpacing * Vec3(4, 4, 4))], 0);
}

// One ball in five hundred, which would make the cells as wide as the pile.
TEST(Burial, StraysChangeNothing) {
  Lattice lattice;
  lattice.fill(4);
  const uint32_t centre = at(lattice, Vec3::Zero());
  const double before = lattice.depths()[centre];
  const uint32_t far = lattice.add({4000, 0, 1000});
  const std::vector<double> depths = lattice.depths();
  EXPECT_EQ(depths[far], 0);
  EXPECT_NEAR(depths[centre], before, kError);
  EXPECT_GT(before, kRadius);
}

TEST(Burial, AbsentBodiesHideNothingAndHaveNoDepth) {
  Lattice lattice;
  lattice.fill(4);
  BodyStates states = lattice.states();
  const uint32_t centre = at(lattice, Vec3::Zero());
  for (uint32_t i = 0; i < states.size(); ++i) {
    if (states.position[i].x() > 0) states.flags[i] = i % 2 == 0 ? 0 : kPresent | kHeld;
  }
  const std::vector<double> depths = depths_under_surface(lattice.model, states);
  EXPECT_EQ(depths[centre], 0);
  EXPECT_EQ(depths[at(lattice, kSpacing * Vec3(3, 0, 0))], 0);
}

TEST(Burial, DoesNotDependOnThreads) {
  Lattice lattice;
  lattice.fill(4);
  const int threads = thread_count();
  set_thread_count(1);
  const std::vector<double> one = lattice.depths();
  set_thread_count(2);
  EXPECT_EQ(lattice.depths(), one);
  set_thread_count(threads);
}

}  // namespace
}  // namespace pilesim
