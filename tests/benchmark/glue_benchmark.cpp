// The least glue of columns and cubes of skew boxes, by number of bodies.
//
//   glue_benchmark [bodies ...]      default: 300 1000 3000
#include <cstdio>
#include <cstdlib>

#include "core/clock.h"
#include "core/philox.h"
#include "pile/glue/glue.h"

using namespace pilesim;

namespace {

struct Pile {
  std::vector<GlueBody> bodies = {{Vec3::Zero(), 1, 0}};
  std::vector<GlueContact> contacts;
};

// Bodies on a lattice `wide` by `wide`, displaced at random. Each touches its six neighbours at
// four points with skew normals; the sides of the pile are unsupported.
Pile lattice(int count, int wide) {
  constexpr double kFriction = 0.3;
  Pile pile;
  Philox random(5, Stream::test, static_cast<uint64_t>(count));
  std::vector<std::array<int, 3>> place;
  for (int i = 0; i < count; ++i) {
    const std::array<int, 3> at{i % wide, i / (wide * wide), i / wide % wide};
    const double x = random.uniform(-0.1, 0.1), y = random.uniform(-0.1, 0.1),
                 z = random.uniform(-0.1, 0.1);
    pile.bodies.push_back({Vec3(at[0] + x, at[1] + 0.5 + y, at[2] + z), 0.87, 1});
    place.push_back(at);
  }
  const auto touch = [&](uint32_t a, uint32_t b, const Vec3& middle, const Vec3& way) {
    const double x = random.uniform(-0.6, 0.6), y = random.uniform(-0.6, 0.6),
                 z = random.uniform(-0.6, 0.6);
    const Vec3 normal = (way + Vec3(x, y, z)).normalized();
    const Vec3 u = 0.4 * normal.unitOrthogonal(), v = normal.cross(u);
    for (const Vec3& corner : {Vec3(u + v), Vec3(u - v), Vec3(-u + v), Vec3(-u - v)}) {
      pile.contacts.push_back({a, b, middle + corner, normal, kFriction});
    }
  };
  const std::array<int, 3> steps{1, wide * wide, wide};
  for (int i = 0; i < count; ++i) {
    const auto a = static_cast<uint32_t>(i + 1);
    if (place[i][1] == 0) touch(a, 0, pile.bodies[a].centre - 0.5 * Vec3::UnitY(), Vec3::UnitY());
    for (int k = 0; k < 3; ++k) {
      if (place[i][k] == 0) continue;
      const auto b = static_cast<uint32_t>(i + 1 - steps[k]);
      const Vec3 way = pile.bodies[a].centre - pile.bodies[b].centre;
      touch(a, b, pile.bodies[b].centre + way / 2, way.normalized());
    }
  }
  return pile;
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<int> counts;
  for (int i = 1; i < argc; ++i) counts.push_back(std::atoi(argv[i]));
  if (counts.empty()) counts = {300, 1000, 3000};
  std::printf(
      "| Bodies | Wide | Contacts | s | Iterations | Glue, weights | Contacts glued | Left over "
      "|\n");
  for (const int count : counts) {
    for (const int wide : {5, static_cast<int>(std::cbrt(count))}) {
      const Pile pile = lattice(count, wide);
      const Stopwatch watch;
      const GlueSolution solution = least_glue(pile.bodies, pile.contacts, Vec3::UnitY());
      const double took_s = watch.seconds();
      const GlueCertificate proof =
          certify(pile.bodies, pile.contacts, Vec3::UnitY(), solution, GlueSettings().patch);
      const auto glued = std::ranges::count_if(solution.glue_kg, [](double g) { return g > 0; });
      std::printf("| %d | %d | %zu | %.2f | %d%s | %.1f | %td | %.1e, %.1e |\n", count, wide,
                  pile.contacts.size(), took_s, solution.iterations,
                  solution.is_solved ? "" : " (not solved)", solution.total_kg, glued,
                  proof.unbalanced, proof.outside);
      std::fflush(stdout);
    }
  }
}
