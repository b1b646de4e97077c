// Random collisions, and the laws that each must satisfy.

#include "simulate/sphere/collision_response.h"

#include <gtest/gtest.h>

#include "support/random_vectors.h"
#include "support/statistical_scene.h"

namespace pilesim {
namespace {

class Response : public test::StatisticalScene {
 protected:
  Response() {
    add_shape("box", box_mesh({0.3, 0.2, 0.1}));
    add_shape("needle", box_mesh({1, 0.02, 0.03}));
    add_body("box", Vec3::Zero());
    add_body("needle", Vec3::Zero());
    model_ = build_model(scene_);
    objects_ = load_signatures(model_);
  }
  Collider random_body(Philox& random) {
    const ModelBody& body = model_.bodies[random.index(2)];
    return {&objects_.at({body.shape, body.material}), static_cast<float>(random.uniform(0.01, 10)),
            test::random_arrow(random, 0, 5).cast<float>(),
            test::random_arrow(random, 0, 30).cast<float>()};
  }
  // Sampled and particle collisions, equally often.
  static Collision collision(const Vec3f& normal, Philox& random) {
    return {.normal = normal,
            .method = random.index(2) == 0 ? PairMethod::statistical : PairMethod::particle,
            .restitution = static_cast<float>(random.uniform(0, 1)),
            .friction = static_cast<float>(random.uniform(0, 2)),
            .arm_a = static_cast<float>(random.uniform(0.01, 0.3)),
            .arm_b = static_cast<float>(random.uniform(0.01, 0.3))};
  }
  static double energy(const Collider& body) {
    const double k = body.object->gyration_m;
    return 0.5 * body.mass_kg *
           (body.velocity.cast<double>().squaredNorm() +
            k * k * body.spin.cast<double>().squaredNorm());
  }
  BodySignatures objects_;
};

TEST_F(Response, PairsKeepMomentumLoseEnergyAndSeparate) {
  for (uint64_t i = 0; i < 3000; ++i) {
    Philox random(1, Stream::test, i), random_b(2, Stream::test, i);
    Collider a = random_body(random), b = random_body(random);
    Vec3f normal = random.direction().cast<float>();
    if ((a.velocity - b.velocity).dot(normal) > 0) normal = -normal;
    const auto momentum = [&]() -> Vec3f {
      return a.mass_kg * a.velocity + b.mass_kg * b.velocity;
    };
    const Vec3f before = momentum();
    const double energy_before = energy(a) + energy(b);
    collide(collision(normal, random), random, random_b, a, b);
    const float scale = a.mass_kg * a.velocity.norm() + b.mass_kg * b.velocity.norm() + 1e-3F;
    EXPECT_LT((momentum() - before).norm(), 1e-4F * (scale + before.norm()));
    EXPECT_LE(energy(a) + energy(b), energy_before * (1 + 1e-4));
    EXPECT_GE((a.velocity - b.velocity).dot(normal), -1e-4F);
  }
}

TEST_F(Response, ParticlesKeepAngularMomentumAboutWhereTheyTouchAndBounceByTheirRestitution) {
  for (uint64_t i = 0; i < 3000; ++i) {
    Philox random(3, Stream::test, i), random_b(4, Stream::test, i);
    Collider a = random_body(random), b = random_body(random);
    Vec3f normal = random.direction().cast<float>();
    const float closing_before = (b.velocity - a.velocity).dot(normal);
    if (closing_before < 0) continue;
    Collision bounce = collision(normal, random);
    bounce.method = PairMethod::particle;
    const auto momentum = [&]() -> Vec3 {
      const auto of = [&](const Collider& body, const Vec3f& centre) -> Vec3 {
        const double k = body.object->gyration_m;
        return body.mass_kg *
               (centre.cross(body.velocity).cast<double>() + k * k * body.spin.cast<double>());
      };
      return of(a, bounce.arm_a * normal) + of(b, -bounce.arm_b * normal);
    };
    const Vec3 before = momentum();
    const double scale = a.mass_kg * a.velocity.norm() + b.mass_kg * b.velocity.norm() + 1;
    collide(bounce, random, random_b, a, b);
    EXPECT_LT((momentum() - before).norm(), 1e-4 * (scale + before.norm())) << i;
    EXPECT_NEAR((a.velocity - b.velocity).dot(normal), bounce.restitution * closing_before,
                1e-4 * scale);
  }
}

TEST_F(Response, SurfacesTakeNoEnergyButTheirOwnMotionsAndThrowOff) {
  for (uint64_t i = 0; i < 3000; ++i) {
    Philox random(1, Stream::test, i);
    Collider body = random_body(random);
    const Vec3f normal = random.direction().cast<float>();
    const Vec3f surface = random.direction().cast<float>();
    if ((body.velocity - surface).dot(normal) > 0) continue;
    Collider relative = body;
    relative.velocity -= surface;
    const double before = energy(relative);
    collide_with_surface(collision(normal, random), surface, random, body);
    relative = body;
    relative.velocity -= surface;
    EXPECT_LE(energy(relative), before * (1 + 1e-4));
    EXPECT_GE(relative.velocity.dot(normal), -1e-4F);
  }
}

}  // namespace
}  // namespace pilesim
