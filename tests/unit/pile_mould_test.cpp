// Guides filled as moulds.
#include <gmock/gmock.h>

#include <algorithm>

#include "geometry/inside_test.h"
#include "geometry/primitives.h"
#include "inspect/pile_inspection.h"
#include "pile/guide/guide_constants.h"
#include "pile/guide/upside_down.h"
#include "support/small_model.h"

#include <gtest/gtest.h>

namespace pilesim {
namespace {

using ::testing::HasSubstr;

TriangleMesh moved(TriangleMesh mesh, const Vec3& way) {
  for (Vec3& vertex : mesh.vertices) vertex += way;
  return mesh;
}

TriangleMesh together(TriangleMesh mesh, const TriangleMesh& other) {
  const auto first = static_cast<uint32_t>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), other.vertices.begin(), other.vertices.end());
  for (const Triangle& t : other.triangles) {
    mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  }
  return mesh;
}

// Cubes for the guide.
struct Moulded : SmallModel {
  Moulded(TriangleMesh guide, uint32_t count, double size_m = 0.1) {
    scene.frame_rate = 60;
    scene.step_s.reset();
    scene.guide.emplace().file = "guide.obj";
    const uint32_t wood = material(0.3, 0.5), cube = box(Vec3::Constant(size_m));
    model.guide = std::move(guide);
    for (uint32_t i = 0; i < count; ++i) body(cube, wood, Vec3::Zero());
    model.guide_fill = {0, count, 0, true};
    filling = fill_guide(scene, model);
  }
  // Largest distance of corners outside the box.
  double outside(const Bounds& box) const {
    double most = 0;
    for (const ModelBody& body : model.bodies) {
      for (const Vec3& corner : model.shapes[body.shape].mesh.vertices) {
        const Vec3 point = body.pose.apply(corner);
        most = std::max({most, (box.min() - point).maxCoeff(), (point - box.max()).maxCoeff()});
      }
    }
    return most;
  }
  GuideFilling filling;
};

TEST(Mould, IsFilledToARandomPacking) {
  const Moulded moulded(box_mesh({0.6, 0.6, 0.6}), 216);
  EXPECT_GT(moulded.filling.volume_share, 0.36);  // six cubes wide
  EXPECT_LT(moulded.filling.volume_share, 0.8);
  EXPECT_EQ(moulded.filling.kept, moulded.filling.dropped);
  EXPECT_EQ(moulded.filling.kept, moulded.model.bodies.size());
  EXPECT_LT(moulded.outside(Bounds(Vec3::Constant(-0.3), Vec3::Constant(0.3))), 0.01);
  EXPECT_LT(moulded.filling.outside_m, 0.01);
}

TEST(Mould, OfMillimetresIsFilledAsOneOfMetres) {
  const double large = Moulded(box_mesh({6, 6, 6}), 216, 1).filling.volume_share;
  const double small = Moulded(box_mesh({0.012, 0.012, 0.012}), 216, 0.002).filling.volume_share;
  EXPECT_NEAR(small, large, 0.06);
}

// Without ground all fall together while contacts are looked for; none leaves the guide meanwhile.
TEST(Mould, InTheAirOfAnySizeKeepsItsBodies) {
  for (const double size : {1.0, 0.1, 0.002, 0.0014, 0.0003}) {
    const Moulded moulded(box_mesh(Vec3::Constant(4 * size)), 40, size);
    EXPECT_TRUE(moulded.filling.floats) << size;
    EXPECT_EQ(moulded.filling.kept, moulded.filling.dropped) << size;
  }
}

TEST(Mould, FillsEveryChamberOfAGuideWithoutALevelBase) {
  const Quat tilted(Eigen::AngleAxisd(0.5, Vec3(1, 0, 1).normalized()));
  TriangleMesh guide = together(moved(box_mesh({0.4, 0.5, 0.4}), {-1, 1, 0}),
                                moved(box_mesh({0.4, 0.5, 0.4}), {1, 3, 0}));
  for (Vec3& vertex : guide.vertices) vertex = tilted * vertex;
  const InsideTest inside(guide);
  const Moulded moulded(guide, 160);
  const auto lower = std::ranges::count_if(moulded.model.bodies, [&](const ModelBody& body) {
    return (tilted.conjugate() * body.pose.position).y() < 2;
  });
  const auto count = static_cast<ptrdiff_t>(moulded.model.bodies.size());
  EXPECT_GT(lower, 25);
  EXPECT_GT(count - lower, 25);
  for (const ModelBody& body : moulded.model.bodies) {
    EXPECT_TRUE(inside.contains(body.pose.position));
  }
}

// Square in plan, about the y axis: half widths at heights, m.
TriangleMesh lathe(const std::vector<std::pair<double, double>>& profile) {
  TriangleMesh mesh;
  for (const auto& [y, half] : profile) {
    for (const Vec3& corner : {Vec3(-1, 0, -1), Vec3(1, 0, -1), Vec3(1, 0, 1), Vec3(-1, 0, 1)}) {
      mesh.vertices.push_back(half * corner + y * Vec3::UnitY());
    }
  }
  const auto rings = static_cast<uint32_t>(profile.size());
  for (uint32_t ring = 0; ring + 1 < rings; ++ring) {
    for (uint32_t k = 0; k < 4; ++k) {
      const uint32_t a = 4 * ring + k, b = 4 * ring + (k + 1) % 4;
      mesh.triangles.push_back({a, a + 4, b + 4});
      mesh.triangles.push_back({a, b + 4, b});
    }
  }
  const uint32_t top = 4 * (rings - 1);
  mesh.triangles.insert(mesh.triangles.end(),
                        {{0, 1, 2}, {0, 2, 3}, {top, top + 2, top + 1}, {top, top + 3, top + 2}});
  return mesh;
}

TEST(EmptyParts, ThereAreNoneWhereAMouldIsFilled) {
  const Moulded box(box_mesh({0.6, 0.6, 0.6}), 216);
  EXPECT_GT(box.filling.empty.filled_share, 0.98);
  EXPECT_TRUE(box.filling.empty.parts.empty());
}

// The upper part is narrower than a cube; the other guide is wide, and stands to the left.
TEST(EmptyParts, SayWhereAndWhy) {
  const TriangleMesh thick = lathe({{0, 0.15}, {0.3, 0.15}, {0.3, 0.045}, {1.5, 0.045}});
  const Moulded two(together(thick, moved(box_mesh({0.4, 0.4, 0.4}), {-2, 0.2, 0})), 250);
  ASSERT_EQ(two.filling.empty.parts.size(), 1U);
  const EmptyPart& part = two.filling.empty.parts.front();
  EXPECT_EQ(part.part, 2U);
  EXPECT_EQ(part.parts, 2U);
  EXPECT_NEAR(part.box.max().y(), 1.5, 0.04);
  EXPECT_LT(part.box.min().y(), 0.5);
  EXPECT_THAT(part.place, HasSubstr("the upper "));
  EXPECT_THAT(part.place, HasSubstr("% of part 2 of 2 of the guide (x "));
  EXPECT_THAT(part.reason, HasSubstr("wide"));
  EXPECT_LT(two.filling.empty.filled_share, 0.95);
  EXPECT_THAT(describe(part), HasSubstr(" is empty: "));
}

TEST(EmptyParts, OfACountAreTold) {
  const Moulded moulded(box_mesh({0.6, 0.6, 0.6}), 40);
  ASSERT_EQ(moulded.filling.empty.parts.size(), 1U);
  const EmptyPart& part = moulded.filling.empty.parts.front();
  EXPECT_THAT(part.place, HasSubstr("the upper "));
  EXPECT_THAT(part.place, HasSubstr(" % of the guide (x -0.3 to 0.30"));
  EXPECT_GT(part.guide_share, 0.4);
  EXPECT_THAT(part.reason, HasSubstr("\"count\""));
}

TEST(EmptyParts, UpsideDownBehindANeck) {
  SmallModel world;
  world.scene.frame_rate = 60;
  world.scene.step_s = 1.0 / 240;
  world.scene.guide.emplace().file = "guide.obj";
  world.scene.guide->hold = HoldKind::freeze;
  const uint32_t wood = world.material(0.3, 0.5), cube = world.box(Vec3::Constant(0.1));
  for (int i = 0; i < 90; ++i) world.body(cube, wood, Vec3::Zero());
  world.model.guide =
      lathe({{0, 0.25}, {0.4, 0.25}, {0.4, 0.02}, {0.5, 0.02}, {0.5, 0.25}, {0.9, 0.25}});
  world.model.guide_fill = {0, 90, 0, false};
  const GuideFilling filling = fill_guide(world.scene, world.model);
  ASSERT_EQ(filling.empty.parts.size(), 1U);
  EXPECT_THAT(filling.empty.parts[0].place, HasSubstr("the upper "));
  EXPECT_FALSE(filling.empty.parts[0].reason.empty());
}

// Before anything falls.
TEST(EmptyParts, KnowsWhatIsTooNarrowForAnyBody) {
  SmallModel world;
  world.scene.guide.emplace().file = "guide.obj";
  const uint32_t wood = world.material(0.3, 0.5), cube = world.box(Vec3::Constant(0.1));
  for (int i = 0; i < 90; ++i) world.body(cube, wood, Vec3::Zero());
  world.model.guide_fill = {0, 90, 0, true};
  world.model.guide = lathe({{0, 0.25}, {0.5, 0.25}});
  EXPECT_TRUE(too_narrow_parts(world.scene, world.model).parts.empty());
  world.model.guide = lathe({{0, 0.15}, {0.3, 0.15}, {0.3, 0.03}, {3.3, 0.03}});
  const EmptyParts narrow = too_narrow_parts(world.scene, world.model);
  ASSERT_EQ(narrow.parts.size(), 1U);
  EXPECT_THAT(describe(narrow.parts[0]), HasSubstr("and the bodies are at least 0.1 m thick"));
}

TEST(Mould, TakesNoMoreThanItIsGiven) {
  const Moulded moulded(box_mesh({0.6, 0.6, 0.6}), 5);
  EXPECT_EQ(moulded.filling.kept, 5);
  // They rest on its floor.
  for (const ModelBody& body : moulded.model.bodies) EXPECT_LT(body.pose.position.y(), -0.2);
}

TEST(Mould, TheSameSeedGivesTheSameFilling) {
  const Moulded first(box_mesh({0.4, 0.4, 0.4}), 40), second(box_mesh({0.4, 0.4, 0.4}), 40);
  ASSERT_EQ(first.model.bodies.size(), second.model.bodies.size());
  for (size_t i = 0; i < first.model.bodies.size(); ++i) {
    EXPECT_EQ(first.model.bodies[i].pose.position, second.model.bodies[i].pose.position);
  }
}

// A mould of cubes on the ground, and the attempts whose filling glue can hold.
struct Refilled : SmallModel {
  explicit Refilled(uint32_t first_that_stands) {
    scene.guide.emplace().file = "guide.obj";
    const uint32_t wood = material(0.3, 0.5), cube = box(Vec3::Constant(0.1));
    model.guide = box_mesh({0.4, 0.4, 0.4});
    for (int i = 0; i < 40; ++i) body(cube, wood, Vec3::Zero());
    model.guide_fill = {0, 40, 0, true};
    filling = fill_guide(scene, model, [&](const Scene&, const Model& filled) {
      EXPECT_FALSE(filled.guide_fill.has_value()) << "as it is simulated";
      return GlueVerdict{++asked >= first_that_stands, {}};
    });
  }
  uint32_t asked = 0;
  GuideFilling filling;
};

bool are_alike(const Model& one, const Model& other) {
  return std::ranges::equal(one.bodies, other.bodies, [](const ModelBody& a, const ModelBody& b) {
    return a.pose.position == b.pose.position;
  });
}

TEST(Mould, AFillingThatNoGlueHoldsIsReplaced) {
  const Refilled first(1), second(2), again(2), third(3), none(9);
  EXPECT_EQ(first.filling.tries, 1);
  EXPECT_EQ(second.filling.tries, 2);
  EXPECT_EQ(third.filling.tries, guide_constants::kMostFillings);
  EXPECT_FALSE(are_alike(first.model, second.model));
  EXPECT_FALSE(are_alike(second.model, third.model));
  EXPECT_TRUE(are_alike(second.model, again.model));
  // None stands: the last one is used.
  EXPECT_EQ(none.filling.tries, guide_constants::kMostFillings);
  EXPECT_TRUE(are_alike(third.model, none.model));
  EXPECT_EQ(none.filling.kept, none.model.bodies.size());
}

// Two chambers; one is in the air.
TEST(Mould, BodiesThatTouchOnlyTheMouldAreLeftOut) {
  SmallModel world;
  world.scene.frame_rate = 60;
  world.scene.step_s = 1.0 / 240;
  world.scene.guide.emplace().file = "guide.obj";
  const uint32_t wood = world.material(0.3, 0.5), cube = world.box(Vec3::Constant(0.1));
  world.body(world.plane(), wood, Vec3::Zero(), Role::fixed);
  for (int i = 0; i < 160; ++i) world.body(cube, wood, Vec3::Zero());
  world.body(cube, wood, {9, 0.05, 0}).name = "last";
  world.model.guide = together(moved(box_mesh({0.4, 0.5, 0.4}), {0, 0.25, 0}),
                               moved(box_mesh({0.4, 0.5, 0.4}), {1, 3, 0}));
  world.model.guide_fill = {1, 160, 0, true};
  world.model.events.push_back({5, ModelEvent::Kind::remove, {0, 1, 161}, Vec3::Zero(), {}});
  const GuideFilling filling = fill_guide(world.scene, world.model);
  // Half of the some 40 that a chamber holds.
  EXPECT_GT(filling.hanging, 20U);
  EXPECT_GT(filling.kept, 20U);
  ASSERT_EQ(world.model.bodies.size(), filling.kept + 2);
  for (uint32_t i = 1; i <= filling.kept; ++i) {
    EXPECT_LT(world.model.bodies[i].pose.position.y(), 0.5);
    EXPECT_EQ(world.model.bodies[i].name, "body/" + std::to_string(i));
  }
  EXPECT_EQ(world.model.bodies.back().name, "last");
  EXPECT_NEAR(filling.volume_share, filling.kept * 0.001 / 0.16, 1e-9);
  EXPECT_EQ(world.model.events[0].bodies, (std::vector<uint32_t>{0, 1, filling.kept + 1}));
  ASSERT_EQ(filling.empty.parts.size(), 1U);
  EXPECT_EQ(filling.empty.parts[0].part, 2U);
  EXPECT_THAT(filling.empty.parts[0].reason, HasSubstr("touched no fixed body"));
  ASSERT_TRUE(world.model.moulded.has_value());
  EXPECT_TRUE(world.model.moulded->contains(1) && world.model.moulded->contains(filling.kept));
  EXPECT_FALSE(world.model.moulded->contains(0) || world.model.moulded->contains(filling.kept + 1));
}

// A guide of 0.6 m above the ground or embedded in it, in a world that also has a fixed body.
struct Immersed : SmallModel {
  template <typename Fixed>
  Immersed(double low_m, const Fixed& fixed) {
    scene.frame_rate = 60;
    scene.step_s = 1.0 / 240;
    scene.guide.emplace().file = "guide.obj";
    const uint32_t stone = material(0.3, 0.5), cube = box(Vec3::Constant(0.1));
    body(plane(), stone, Vec3::Zero(), Role::fixed);
    fixed(*this, stone);
    const auto first = static_cast<uint32_t>(model.bodies.size());
    for (int i = 0; i < 216; ++i) body(cube, stone, Vec3::Zero());
    model.guide = moved(box_mesh({0.6, 0.6, 0.6}), {0, low_m + 0.3, 0});
    model.guide_fill = {first, 216, 0, true};
    filling = fill_guide(scene, model);
  }
  double deepest() const { return std::ranges::max(overlap_depths(model, states())); }
  GuideFilling filling;
};

void nothing(SmallModel&, uint32_t) {}

// A level sheet of `cells` by `cells` squares.
TriangleMesh grid(uint32_t cells, double width_m, double level_m) {
  TriangleMesh mesh;
  for (uint32_t i = 0; i <= cells; ++i) {
    for (uint32_t j = 0; j <= cells; ++j) {
      mesh.vertices.emplace_back(width_m * (i / static_cast<double>(cells) - 0.5), level_m,
                                 width_m * (j / static_cast<double>(cells) - 0.5));
      if (i == cells || j == cells) continue;
      const uint32_t a = i * (cells + 1) + j, b = a + cells + 1;
      mesh.triangles.push_back({a, a + 1, b + 1});
      mesh.triangles.push_back({a, b + 1, b});
    }
  }
  return mesh;
}

TEST(Mould, IsFilledAroundWhatIsFixed) {
  constexpr double kTouching = 1e-3;
  // By less than a cell, and by more.
  for (const double low : {-0.003, -0.01, -0.15}) {
    const Immersed embedded(low, nothing);
    EXPECT_LT(embedded.deepest(), kTouching) << low;
    EXPECT_GT(embedded.filling.kept, 40) << low;
  }
  for (const double turn : {0.3, 0.5, 0.7}) {
    const Immersed with_a_block(0, [turn](SmallModel& world, uint32_t stone) {
      world.body(world.box({0.2, 0.3, 0.9}), stone, {0.1, 0.15, 0}, Role::fixed).pose.orientation =
          Eigen::AngleAxisd(turn, Vec3(1, 2, 3).normalized());
    });
    EXPECT_LT(with_a_block.deepest(), kTouching) << turn;
    EXPECT_GT(with_a_block.filling.kept, 40) << turn;
  }
  const Immersed with_a_shelf(0, [](SmallModel& world, uint32_t stone) {  // thinner than a cell
    world.body(world.box({2, 0.02, 2}), stone, {0, 0.3, 0}, Role::kinematic);
  });
  EXPECT_LT(with_a_shelf.deepest(), kTouching);
  EXPECT_GT(with_a_shelf.filling.kept, 40);
  const Immersed with_a_ball(0, [](SmallModel& world, uint32_t stone) {
    world.body(world.sphere(0.15), stone, {0.1, 0.3, 0}, Role::fixed);
  });
  EXPECT_LT(with_a_ball.deepest(), kTouching);
  // A step that is a mesh, closed, and a cloth on the ground, which is open.
  for (const bool is_open : {false, true}) {
    const Immersed with_a_mesh(0, [&](SmallModel& world, uint32_t stone) {
      const uint32_t step = world.box({2, 0.24, 2});
      ModelShape& shape = world.model.shapes[step];
      shape.pieces.clear();
      shape.collides_as_mesh = true;
      if (is_open) shape.mesh = grid(20, 2, 0.12);
      world.body(step, stone, {0.1, 0, 0.2}, Role::fixed).pose.orientation =
          Eigen::AngleAxisd(0.5, Vec3::UnitY());
    });
    EXPECT_GT(with_a_mesh.filling.kept, 40);
    for (const ModelBody& body : with_a_mesh.model.bodies) {
      if (body.role == Role::fixed) continue;
      EXPECT_GT(body.pose.position.y(), 0.12 + 0.045) << is_open;
    }
  }
}

// Cubes held by the mould's round bottom come down to the ground, beside a post that they touch.
TEST(Mould, ComesDownBesideWhatStands) {
  SmallModel world;
  world.scene.frame_rate = 60;
  world.scene.step_s = 1.0 / 240;
  world.scene.guide.emplace().file = "guide.obj";
  const uint32_t stone = world.material(0.3, 0.5), cube = world.box(Vec3::Constant(0.1));
  world.body(world.plane(), stone, Vec3::Zero(), Role::fixed);
  world.body(world.box({0.1, 1, 0.1}), stone, {0.1, 0.55, 0}, Role::fixed);
  for (int i = 0; i < 216; ++i) world.body(cube, stone, Vec3::Zero());
  world.model.guide = cylinder_mesh(0.35, 0.5);
  for (Vec3& v : world.model.guide.vertices) v = Vec3(v.y(), v.x() + 0.35, v.z());
  for (Triangle& t : world.model.guide.triangles) std::swap(t[1], t[2]);
  world.model.guide_fill = {2, 216, 0, true};
  const GuideFilling filling = fill_guide(world.scene, world.model);
  EXPECT_FALSE(filling.floats);
  EXPECT_GT(filling.kept, 20);
  EXPECT_LT(std::ranges::max(overlap_depths(world.model, world.states())), 1e-3);
  double lowest = 1;
  for (uint32_t i = 2; i < world.model.bodies.size(); ++i) {
    for (const Vec3& corner : world.model.shapes[cube].mesh.vertices) {
      lowest = std::min(lowest, world.model.bodies[i].pose.apply(corner).y());
    }
  }
  EXPECT_NEAR(lowest, 0, 2e-4);
}

TEST(Mould, SaysWhetherItIsInTheAir) {
  EXPECT_FALSE(Immersed(0, nothing).filling.floats);
  const Immersed high(0.5, nothing);
  EXPECT_TRUE(high.filling.floats);
  EXPECT_EQ(high.filling.hanging, 0) << "all are kept";
}

// Three thin crossed rods, which hook into each other.
uint32_t jack(SmallModel& world) {
  constexpr double w = 0.012;
  const uint32_t rod = world.box({0.3, w, w});
  ModelShape& shape = world.model.shapes[rod];
  shape.pieces.clear();
  shape.mesh = {};
  for (const Vec3& size : {Vec3(0.3, w, w), Vec3(w, 0.3, w), Vec3(w, w, 0.3)}) {
    shape.pieces.push_back({CollisionPiece::Kind::box, {}, size, {}});
    shape.mesh = together(shape.mesh, box_mesh(size));
  }
  shape.mass = mass_properties(shape.mesh);
  return rod;
}

TEST(Mould, APenetratingBodyIsRemoved) {
  SmallModel world;
  world.scene.guide.emplace().hold = HoldKind::freeze;
  const uint32_t wood = world.material(0, 0.5), shape = jack(world);
  constexpr uint32_t kMost = 120;
  for (uint32_t i = 0; i < kMost; ++i) world.body(shape, wood, Vec3::Zero());
  world.model.guide = box_mesh({0.8, 0.9, 0.8});
  world.model.guide_fill = {0, kMost, 0, true};
  const GuideFilling filling = fill_guide(world.scene, world.model);
  EXPECT_GT(filling.kept, 0.8 * filling.dropped);
  EXPECT_LT(std::ranges::max(overlap_depths(world.model, world.states())),
            guide_constants::kMostPenetration * world.model.shapes[shape].bounding_radius);
}

TEST(Mould, WithoutGlueAMouldIsFilledOnce) {
  SmallModel world;
  world.scene.guide.emplace().hold = HoldKind::freeze;
  world.body(world.box(Vec3::Constant(0.1)), world.material(0.3, 0.5), Vec3::Zero());
  world.model.guide = box_mesh({0.4, 0.4, 0.4});
  world.model.guide_fill = {0, 1, 0, true};
  const GuideFilling filling = fill_guide(world.scene, world.model, [](const Scene&, const Model&) {
    return GlueVerdict{false, {}};
  });
  EXPECT_EQ(filling.tries, 1);
}

}  // namespace
}  // namespace pilesim
