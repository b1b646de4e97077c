// Joints and chains of a scene in the model.
#include <gmock/gmock.h>

#include "core/error.h"
#include "model/model.h"
#include "scene/scene_loader.h"

namespace pilesim {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// A floor, two bricks a metre apart, and `more` keys.
Scene scene_of(const std::string& more) {
  return parse_scene(R"({"version": 1, "materials": {"m": {}},
 "shapes": {"s": {"type": "box", "size": [0.1, 0.4, 0.1]}, "floor": {"type": "plane"}},
 "bodies": [{"name": "floor", "shape": "floor", "material": "m", "role": "static"},
            {"name": "a", "shape": "s", "material": "m", "position": [0, 1, 0]},
            {"name": "b", "shape": "s", "material": "m", "position": [1, 1, 0]}],
)" + more + "}",
                     "scene.json")
      .scene;
}

Model model_of(const std::string& more) { return build_model(scene_of(more)); }

std::string failure(const std::string& more) {
  try {
    scene_of(more);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

// Position of a joint's point on body a, and on b or in the world.
std::array<Vec3, 2> points(const Model& model, const ModelJoint& joint) {
  const auto world = [&](uint32_t body, const Vec3& point) {
    return body == ModelJoint::kWorld ? point : model.bodies[body].pose.apply(point);
  };
  return {world(joint.a, joint.point_a), world(joint.b, joint.point_b)};
}

TEST(ModelJoints, HoldWhatTheSceneSays) {
  const Model model = model_of(R"("joints": [
    {"type": "hinge", "a": "a", "b": "b", "point": [0.5, 1, 0], "axis": [0, 0, 2],
     "limits_deg": [-90, 180], "motor": {"turns_per_s": 0.5, "torque_nm": 3},
     "breaking_force_n": 7},
    {"type": "ball", "a": "b", "point": [1, 2, 0]}])");
  ASSERT_EQ(model.joints.size(), 2U);
  const ModelJoint &hinge = model.joints[0], &ball = model.joints[1];
  EXPECT_EQ(hinge.kind, JointKind::hinge);
  EXPECT_EQ(model.bodies[hinge.a].name, "a");
  EXPECT_EQ(model.bodies[hinge.b].name, "b");
  for (const Vec3& point : points(model, hinge)) EXPECT_LT((point - Vec3(0.5, 1, 0)).norm(), 1e-12);
  EXPECT_LT((hinge.axis_a - Vec3::UnitZ()).norm(), 1e-12);
  ASSERT_TRUE(hinge.limits && hinge.motor && hinge.breaking_force_n);
  EXPECT_NEAR((*hinge.limits)[0], -kPi / 2, 1e-12);
  EXPECT_NEAR((*hinge.limits)[1], kPi, 1e-12);
  EXPECT_EQ(hinge.motor->turns_per_s, 0.5);
  EXPECT_EQ(hinge.motor->torque_nm, 3);
  EXPECT_EQ(*hinge.breaking_force_n, 7);
  EXPECT_EQ(ball.b, ModelJoint::kWorld);
  EXPECT_FALSE(ball.breaking_force_n);
  for (const Vec3& point : points(model, ball)) EXPECT_LT((point - Vec3(1, 2, 0)).norm(), 1e-12);
}

// By default bodies collide if they can separate, and with a plane, through which they would fall.
TEST(ModelJoints, BodiesThatStayTogetherDoNotCollide) {
  const auto kept_apart = [](const std::string& joint) {
    return model_of(R"("joints": [{"type": "ball", "point": [0, 0, 0], )" + joint + "}]")
        .kept_apart;
  };
  const uint64_t a_b = pair_key(1, 2), floor_a = pair_key(0, 1);
  EXPECT_THAT(kept_apart(R"("a": "a", "b": "b")"), ElementsAre(a_b));
  EXPECT_THAT(kept_apart(R"("a": "a", "b": "b", "collide": true)"), IsEmpty());
  EXPECT_THAT(kept_apart(R"("a": "a", "b": "b", "breaking_force_n": 1)"), IsEmpty());
  EXPECT_THAT(kept_apart(R"("a": "a", "b": "b", "breaking_force_n": 1, "collide": false)"),
              ElementsAre(a_b));
  EXPECT_THAT(kept_apart(R"("a": "a", "b": "floor")"), IsEmpty());
  EXPECT_THAT(kept_apart(R"("a": "a", "b": "floor", "collide": false)"), ElementsAre(floor_a));
  EXPECT_THAT(kept_apart(R"("a": "a")"), IsEmpty());
}

TEST(ModelChains, LinksLieEndToEnd) {
  const Vec3 from(0, 4, 0), to(0, 4, 2);
  const Model model = model_of(R"("chains": [{"name": "c", "shape": "s", "material": "m",
    "count": 5, "from": [0, 4, 0], "to": [0, 4, 2], "start": "world", "end": "b",
    "breaking_force_n": 9}])");
  ASSERT_EQ(model.bodies.size(), 8U);
  for (int i = 0; i < 5; ++i) {
    const ModelBody& link = model.bodies[static_cast<size_t>(3 + i)];
    EXPECT_EQ(link.name, "c/" + std::to_string(i));
    EXPECT_EQ(link.role, Role::dynamic);
    EXPECT_LT((link.pose.position - (from + (i + 0.5) / 5 * (to - from))).norm(), 1e-12);
    EXPECT_LT((link.pose.orientation * Vec3::UnitY() - Vec3::UnitZ()).norm(), 1e-12);
  }
  ASSERT_EQ(model.joints.size(), 6U);
  const auto [start, between, end] =
      std::tuple(model.joints.front(), model.joints[1], model.joints.back());
  EXPECT_EQ(start.b, ModelJoint::kWorld);
  EXPECT_EQ(model.bodies[end.b].name, "b");
  for (const ModelJoint& joint : model.joints) {
    EXPECT_EQ(joint.kind, JointKind::ball);
    EXPECT_EQ(joint.breaking_force_n, 9);
    const auto [on_a, on_b] = points(model, joint);
    EXPECT_LT((on_a - on_b).norm(), 1e-12);
  }
  EXPECT_LT((points(model, start)[0] - from).norm(), 1e-12);
  EXPECT_LT((points(model, between)[0] - (from + 0.2 * (to - from))).norm(), 1e-12);
  EXPECT_LT((points(model, end)[0] - to).norm(), 1e-12);
  EXPECT_EQ(model.kept_apart.size(), 5U);  // neighbours and the end's body
}

TEST(ModelChains, AFreeEndHangsOnNothing) {
  EXPECT_EQ(model_of(R"("chains": [{"shape": "s", "material": "m", "count": 3,
    "from": [0, 4, 0], "to": [0, 3, 0]}])")
                .joints.size(),
            2U);
}

// Links are named like bodies of emitters.
TEST(ModelChains, LinksAreNamedByEvents) {
  const std::string chain = R"("chains": [{"name": "c", "shape": "s", "material": "m",
    "count": 3, "from": [0, 4, 0], "to": [0, 3, 0]}], )";
  const auto event = [&](const std::string& body) {
    return chain + R"("events": [{"type": "remove", "time_s": 1, "bodies": [")" + body + R"("]}])";
  };
  EXPECT_EQ(model_of(event("c/1")).events.size(), 1U);
  EXPECT_EQ(failure(event("c")), "");
  EXPECT_THAT(failure(event("c/3")), HasSubstr(R"(is "c/3", but "c" has 3 bodies)"));
  EXPECT_THAT(failure(event("d/1")), HasSubstr("no body, emitter or chain"));
}

TEST(ModelChains, NamesAreOnesOfTheirOwn) {
  const auto chain = [](const std::string& keys) {
    return R"({"shape": "s", "material": "m", "count": 3, "from": [0, 4, 0], "to": [0, 3, 0], )" +
           keys + "}";
  };
  const std::string c = chain(R"("name": "c")");
  EXPECT_THAT(failure(R"("chains": [)" + c + ", " + c + "]"),
              HasSubstr(R"(/chains/1/name: is "c" like /chains/0)"));
  EXPECT_THAT(failure(R"("chains": [)" + chain(R"("name": "a")") + "]"),
              HasSubstr(R"(/bodies/1/name: is "a" like /chains/0)"));
  EXPECT_THAT(failure(R"("emitters": [{"name": "c", "type": "grid", "shape": "s", "material": "m",
    "count": [1, 1, 1], "spacing": [1, 1, 1], "centre": [0, 9, 0]}], "chains": [)" +
                      c + "]"),
              HasSubstr(R"(/chains/0/name: is "c" like /emitters/0)"));
}

// Keys of a hinge on its own, and omitted keys that have no meaning.
TEST(ModelJoints, KeysWithoutMeaningAreRefused) {
  const auto joint = [](const std::string& keys) {
    return R"("joints": [{"a": "a", "point": [0, 0, 0], )" + keys + "}]";
  };
  EXPECT_THAT(failure(joint(R"("type": "ball", "axis": [0, 1, 0])")), HasSubstr("is no hinge"));
  EXPECT_THAT(failure(joint(R"("type": "hinge")")), HasSubstr(R"(a hinge without "axis")"));
  EXPECT_THAT(failure(joint(R"("type": "ball", "collide": false)")),
              HasSubstr("a joint with the world"));
  EXPECT_EQ(failure(joint(R"("type": "hinge", "axis": [0, 1, 0])")), "");
}

}  // namespace
}  // namespace pilesim
