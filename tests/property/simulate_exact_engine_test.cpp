// Parts of the exact engine against slower methods, and its conservation laws.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <set>
#include <utility>
#include <vector>

#include "core/hash.h"
#include "core/parallel_for.h"
#include "core/philox.h"
#include "geometry/convex_distance.h"
#include "geometry/convex_hull.h"
#include "inspect/pile_inspection.h"
#include "model/placed_piece.h"
#include "simulate/exact/engine.h"
#include "simulate/exact/exact_constants.h"
#include "simulate/exact/manifold.h"
#include "simulate/exact/pair_list.h"
#include "simulate/exact/separation.h"
#include "simulate/impulse_simulator.h"
#include "simulate/modes/make_simulator.h"
#include "support/random_vectors.h"
#include "support/small_model.h"
#include "support/small_simulation.h"

namespace pilesim::exact {
namespace {

Vec3 random_direction(Philox& random) {
  Vec3 v;
  do {
    for (int k = 0; k < 3; ++k) v[k] = 2 * random.uniform() - 1;
  } while (v.squaredNorm() > 1 || v.squaredNorm() < 0.01);
  return v.normalized();
}

Quat random_turn(Philox& random) {
  const double angle = 2 * kPi * random.uniform();
  return Quat(Eigen::AngleAxisd(angle, random_direction(random)));
}

CollisionPiece random_piece(Philox& random) {
  CollisionPiece piece;
  switch (random.bits() % 7) {
    case 0:
      piece.kind = CollisionPiece::Kind::box;
      piece.size = {0.2 + random.uniform(), 0.2 + random.uniform(), 0.2 + random.uniform()};
      break;
    case 1:
      piece.kind = CollisionPiece::Kind::sphere;
      piece.size = Vec3::Constant(0.2 + 0.5 * random.uniform());
      break;
    case 2:
      piece.kind = CollisionPiece::Kind::round;
      piece.round = RoundSector::cylinder(0.2 + 0.5 * random.uniform(), 0.2 + random.uniform());
      break;
    case 3:  // a cone, or a part of one
      piece.kind = CollisionPiece::Kind::round;
      piece.round =
          RoundSector::frustum(0.2 + 0.5 * random.uniform(), std::max(0.0, random.uniform() - 0.5),
                               0.2 + random.uniform());
      break;
    case 4:  // of a tube
      piece.kind = CollisionPiece::Kind::round;
      piece.round = RoundSector::cylinder(0.4 + 0.5 * random.uniform(), 0.2 + random.uniform());
      piece.round = piece.round.part(0.1 + random.uniform());
      piece.round.hole = (0.3 + 0.5 * random.uniform()) * piece.round.bottom;
      piece.pose.position.x() = -0.9 * piece.round.bottom;
      break;
    case 5: {  // of a torus
      const double ring = 0.4 + 0.5 * random.uniform();
      piece.kind = CollisionPiece::Kind::round;
      piece.round = RoundSector{.bottom = ring, .top = ring}.part(0.1 + random.uniform());
      piece.round.margin = 0.1 + 0.2 * random.uniform();
      piece.pose.position.x() = -ring;
      break;
    }
    default:
      piece.kind = CollisionPiece::Kind::hull;
      std::vector<Vec3> points;
      for (int i = 0; i < 20; ++i) points.push_back(0.6 * random_direction(random));
      piece.hull = convex_hull(points);
  }
  return piece;
}

// The judge's distance of two pieces in these poses.
double judged(const CollisionPiece& a, const CollisionPiece& b, const Pose& b_in_a) {
  const PieceCore core_a(a), core_b(b);
  return convex_distance(PlacedPiece(core_a, {}), PlacedPiece(core_b, b_in_a), 100);
}

Relative relative(const Pose& pose) { return {pose.orientation.toRotationMatrix(), pose.position}; }

// Separate and slightly overlapping pieces, tested first from scratch and again after each small
// motion: equal to the judge's distance to a thousandth of the pieces' sizes.
TEST(ExactEngine, SeparationsAreTheJudges) {
  Philox random(1, Stream::test, 0);
  int overlapping = 0;
  for (int i = 0; i < 200; ++i) {
    const CollisionPiece a = random_piece(random), b = random_piece(random);
    const ConvexPiece piece_a(a), piece_b(b);
    Pose pose{{}, random_turn(random)};
    const Vec3 direction = random_direction(random);
    // Bisect to the contact with the judge.
    double low = 0, high = 5;
    for (int k = 0; k < 40; ++k) {
      const double middle = (low + high) / 2;
      pose.position = middle * direction;
      (judged(a, b, pose) > 0 ? high : low) = middle;
    }
    KnownVertices known;
    Vec3 guess = Vec3::Zero();
    // From 0.2 m apart until they overlap by 2 mm along that direction.
    for (const double gap : {0.2, 0.1, 0.03, 0.01, 0.003, 0.0, -0.001, -0.002}) {
      pose.position = (high + gap) * direction;
      pose.orientation = (pose.orientation * Quat(Eigen::AngleAxisd(1e-4, direction))).normalized();
      const double expected = judged(a, b, pose);
      const Separation found = find_separation(piece_a, piece_b, relative(pose), guess, 10, known);
      guess = found.normal;
      ASSERT_TRUE(found.is_exact);
      EXPECT_NEAR(found.normal.norm(), 1, 1e-9);
      EXPECT_NEAR(found.distance_m, expected, 1e-3) << i << " at " << gap;
      EXPECT_NEAR(separation_along(piece_a, piece_b, relative(pose), found.normal),
                  found.distance_m, 1e-4);
      overlapping += expected < 0 ? 1 : 0;
    }
  }
  EXPECT_GT(overlapping, 150);
}

// Beyond the reach a bound is sufficient, and it must be a bound.
TEST(ExactEngine, BoundsOfFarPiecesAreBounds) {
  Philox random(2, Stream::test, 0);
  for (int i = 0; i < 2000; ++i) {
    const CollisionPiece a = random_piece(random), b = random_piece(random);
    const double far = 3 * random.uniform();
    const Pose pose{far * random_direction(random), random_turn(random)};
    KnownVertices known;
    const Separation found =
        find_separation(ConvexPiece(a), ConvexPiece(b), relative(pose), Vec3::Zero(), 0.1, known);
    if (found.is_exact) continue;
    EXPECT_GT(found.distance_m, 0.1);
    EXPECT_LE(found.distance_m, judged(a, b, pose) + 1e-5);
  }
}

// Contact points lie between the pieces, and no corner penetrates deeper than the deepest one.
TEST(ExactEngine, ManifoldsHoldTheDeepestPoint) {
  Philox random(3, Stream::test, 0);
  ManifoldScratch scratch;
  for (int i = 0; i < 300; ++i) {
    const CollisionPiece a = random_piece(random), b = random_piece(random);
    const ConvexPiece piece_a(a), piece_b(b);
    Pose pose{{}, random_turn(random)};
    const Vec3 direction = random_direction(random);
    double low = 0, high = 5;
    for (int k = 0; k < 30; ++k) {
      const double middle = (low + high) / 2;
      pose.position = middle * direction;
      (judged(a, b, pose) > 0 ? high : low) = middle;
    }
    KnownVertices known;
    const Separation found =
        find_separation(piece_a, piece_b, relative(pose), Vec3::Zero(), 1, known);
    std::vector<SurfacePoint> points;
    add_manifold(piece_a, piece_b, relative(pose), found, 0.02, scratch, points);
    ASSERT_FALSE(points.empty()) << i;
    ASSERT_LE(points.size(), kMostOfPlane + 1);
    double deepest = std::numeric_limits<double>::infinity();
    for (const SurfacePoint& point : points) {
      deepest = std::min(deepest, point.distance_m);
      EXPECT_GT(point.normal.dot(found.normal), 0.9);
    }
    // Clipping treats rims as polygons.
    const bool has_rim =
        a.kind == CollisionPiece::Kind::round || b.kind == CollisionPiece::Kind::round;
    EXPECT_NEAR(deepest, found.distance_m, has_rim ? 0.01 : 1e-3) << i;
  }
}

// At this distance according to the judge, with random rotation and offset.
void expect_deepest_point(const CollisionPiece& of_a, const CollisionPiece& of_b, double distance_m,
                          Philox& random) {
  const Vec3 direction = random_direction(random);
  Pose pose{{}, random_turn(random)};
  double low = 0, high = 5;
  for (int k = 0; k < 30; ++k) {
    const double middle = (low + high) / 2;
    pose.position = middle * direction;
    (judged(of_a, of_b, pose) > distance_m ? high : low) = middle;
  }
  const ConvexPiece a(of_a), b(of_b);
  KnownVertices known;
  const Separation found = find_separation(a, b, relative(pose), Vec3::Zero(), 1, known);
  ManifoldScratch scratch;
  std::vector<SurfacePoint> points;
  add_manifold(a, b, relative(pose), found, 0.1, scratch, points);
  ASSERT_FALSE(points.empty());
  const auto deepest = std::ranges::min_element(points, {}, &SurfacePoint::distance_m);
  EXPECT_NEAR(deepest->distance_m, found.distance_m, 1e-3);
}

// Blunt corners have faces nearly parallel to the reference face, with corners beside them.
TEST(ExactEngine, ManifoldsOfManyFacesHoldTheDeepestPoint) {
  Philox random(9, Stream::test, 0);
  const auto pebble = [&] {
    CollisionPiece piece;
    piece.kind = CollisionPiece::Kind::hull;
    std::vector<Vec3> points;
    for (int k = 0; k < 12; ++k) {
      const Vec3 corner = random_direction(random);
      for (int m = 0; m < 3; ++m) points.push_back(corner + 0.03 * random_direction(random));
    }
    piece.hull = convex_hull(points);
    return piece;
  };
  for (int i = 0; i < 2000; ++i) {
    const CollisionPiece of_a = pebble(), of_b = pebble();
    SCOPED_TRACE(i);
    expect_deepest_point(of_a, of_b, random.uniform(-0.01, 0.01), random);
  }
}

// Where two faces face each other all but exactly, an edge beside both may go deepest.
TEST(ExactEngine, ManifoldsOfStonesHoldTheDeepestPoint) {
  Philox random(19, Stream::test, 0);
  const auto stone = [&] {
    CollisionPiece piece;
    piece.kind = CollisionPiece::Kind::hull;
    std::vector<Vec3> points;
    for (int k = 0; k < 40; ++k) points.push_back(random_direction(random));
    piece.hull = convex_hull(points);
    return piece;
  };
  for (int i = 0; i < 3000; ++i) {
    const CollisionPiece of_a = stone(), of_b = stone();
    SCOPED_TRACE(i);
    expect_deepest_point(of_a, of_b, random.uniform(-0.02, 0), random);
  }
}

// Clipping may leave coincident corners, up to rounding; the side between them is degenerate.
TEST(ExactEngine, DoubledCornersCutNothingOff) {
  Philox random(17, Stream::test, 0);
  int doubled = 0;
  const auto plate = [&] {
    CollisionPiece piece;
    piece.kind = CollisionPiece::Kind::hull;
    std::vector<Vec3> points;
    for (int k = 0; k < 8; ++k) {
      const Vec3 corner((k & 1) != 0 ? 0.5 : -0.5, (k & 2) != 0 ? 0.06 : -0.06,
                        (k & 4) != 0 ? 0.5 : -0.5);
      for (int m = 0; m < 2; ++m) points.push_back(corner + 1e-7 * random_direction(random));
    }
    piece.hull = convex_hull(points);
    doubled += piece.hull.vertices.size() > 8 ? 1 : 0;
    return piece;
  };
  for (int i = 0; i < 500; ++i) {
    const CollisionPiece of_a = plate(), of_b = plate();
    SCOPED_TRACE(i);
    const ConvexPiece a(of_a);
    EXPECT_EQ(a.vertices().size(), 8);
    EXPECT_EQ(a.faces().size(), 6);
    expect_deepest_point(of_a, of_b, random.uniform(-0.1, 0), random);
  }
  EXPECT_GT(doubled, 500);
}

// For any joined corners: of any size, in clusters, on edges and on faces.
TEST(ExactEngine, PiecesReachAsFarAsTheirHulls) {
  Philox random(18, Stream::test, 0);
  for (int i = 0; i < 300; ++i) {
    const double size = std::pow(10.0, random.uniform(-6, 3)), close = random.uniform(-8, -1);
    const Vec3 shape(1, random.uniform(0.02, 1), random.uniform(0.02, 1));
    std::vector<Vec3> points;
    for (int k = 0; k < 10; ++k) {
      const Vec3 corner = random_direction(random);
      for (int m = 0; m < 4; ++m) {
        const Vec3 beside = corner + std::pow(10.0, close) * random_direction(random);
        points.push_back(size * beside.cwiseProduct(shape));
      }
      if (k > 0) points.push_back(points[5 * k - 5] + 0.3 * (points[5 * k] - points[5 * k - 5]));
    }
    CollisionPiece piece;
    piece.kind = CollisionPiece::Kind::hull;
    piece.hull = convex_hull(points);
    const ConvexPiece made(piece);
    const double extent = piece.hull.bounds().diagonal().norm();
    EXPECT_GE(made.faces().size(), 4);
    for (int k = 0; k < 100; ++k) {
      const Vec3 way = random_direction(random);
      double most = -std::numeric_limits<double>::infinity();
      for (const Vec3& vertex : piece.hull.vertices) most = std::max(most, way.dot(vertex));
      EXPECT_NEAR(way.dot(made.farthest(way)), most, 2e-5 * extent) << i;
    }
  }
}

// Parallel logs touch from the first common end to the last.
TEST(ExactEngine, LogsTouchAllAlongEachOther) {
  CollisionPiece log;
  log.kind = CollisionPiece::Kind::round;
  log.round = RoundSector::cylinder(0.1, 1);
  const ConvexPiece piece(log);
  for (const double shift : {-0.7, -0.2, 0.0, 0.3}) {
    const Pose pose{{0.1999, shift, 0}, Quat::Identity()};
    KnownVertices known;
    const Separation separation =
        find_separation(piece, piece, relative(pose), Vec3::Zero(), 1, known);
    std::vector<SurfacePoint> points;
    ManifoldScratch scratch;
    add_manifold(piece, piece, relative(pose), separation, 1e-3, scratch, points);
    ASSERT_EQ(points.size(), 2);
    const auto [low, high] = std::minmax(points[0].place.y(), points[1].place.y());
    EXPECT_NEAR(low, std::max(-0.5, shift - 0.5), 1e-6);
    EXPECT_NEAR(high, std::min(0.5, shift + 0.5), 1e-6);
  }
}

// If one is tilted a little, they touch at both ends at the distances there: with a single point,
// the other end would be free.
TEST(ExactEngine, LogsThatAreTiltedTouchAtBothEnds) {
  CollisionPiece log;
  log.kind = CollisionPiece::Kind::round;
  log.round = RoundSector::cylinder(0.1, 1);
  const ConvexPiece piece(log);
  constexpr double kAway = 0.19, kTilt = 0.02;  // m, rad
  const auto points_of = [&](const Vec3& about, double angle) {
    const Pose pose{{kAway, 0, 0}, Quat(Eigen::AngleAxisd(angle, about))};
    KnownVertices known;
    const Separation separation =
        find_separation(piece, piece, relative(pose), Vec3::Zero(), 1, known);
    std::vector<SurfacePoint> points;
    ManifoldScratch scratch;
    add_manifold(piece, piece, relative(pose), separation, 0.02, scratch, points);
    std::ranges::sort(points, {}, &SurfacePoint::distance_m);
    EXPECT_NEAR(points[0].distance_m, separation.distance_m, 1e-4);
    return points;
  };
  for (const double tilt : {-kTilt, kTilt}) {
    const std::vector<SurfacePoint> points = points_of(Vec3::UnitZ(), tilt);
    ASSERT_EQ(points.size(), 2);
    EXPECT_NEAR(points[1].distance_m - points[0].distance_m, kTilt, 1e-3);
    EXPECT_NEAR(points[1].place.y() * points[0].place.y(), -0.25, 0.01);
  }
  // Crosswise: nearest in the middle.
  const std::vector<SurfacePoint> points = points_of(Vec3::UnitX(), 0.05);
  ASSERT_EQ(points.size(), 3);
  EXPECT_NEAR(points[0].place.y(), 0, 1e-3);
  for (const size_t end : {1, 2}) {
    EXPECT_NEAR(points[end].distance_m, std::hypot(kAway, 0.05 / 2) - 0.2, 1e-4);
    EXPECT_NEAR(std::abs(points[end].place.y()), 0.5, 1e-3);
  }
}

// Crossed sticks touch by their faces if one is tilted imperceptibly: its far end is then below the
// other's face, beside it.
TEST(ExactEngine, CrossedSticksTouchWithTheirFaces) {
  CollisionPiece stick;
  stick.kind = CollisionPiece::Kind::box;
  stick.size = {1, 0.02, 0.02};
  const ConvexPiece piece(stick);
  Philox random(7, Stream::test, 0);
  for (int i = 0; i < 100; ++i) {
    const double across = random.uniform(0.8, kPi / 2);
    const double tilt = random.uniform(-1e-4, 1e-4), roll = random.uniform(-1e-4, 1e-4);
    const Vec3 shift(random.uniform(-0.15, 0.15), 0.01999, random.uniform(-0.15, 0.15));
    const Pose pose{shift, Quat(Eigen::AngleAxisd(tilt, Vec3::UnitX())) *
                               Quat(Eigen::AngleAxisd(roll, Vec3::UnitZ())) *
                               Quat(Eigen::AngleAxisd(across, Vec3::UnitY()))};
    KnownVertices known;
    const Separation separation =
        find_separation(piece, piece, relative(pose), Vec3::UnitY(), 1, known);
    std::vector<SurfacePoint> points;
    ManifoldScratch scratch;
    add_manifold(piece, piece, relative(pose), separation, 2e-4, scratch, points);
    EXPECT_EQ(points.size(), 4) << i << ": tilted by " << tilt << ", " << roll;
  }
}

// All pairs with overlapping boxes and bounding spheres are listed, however bodies move, appear and
// vanish.
TEST(ExactEngine, AllPairsThatMayMeetAreListed) {
  Philox random(4, Stream::test, 0);
  SmallModel m;
  const uint32_t shape = m.box({0.4, 0.6, 0.8});
  std::vector<CollisionShape> shapes;
  for (const ModelShape& source : m.model.shapes) shapes.emplace_back(source);
  EngineState state;
  state.bodies.resize(200);
  std::vector<uint32_t> active;
  PairList list(m.model, shapes, state, active);
  for (uint32_t i = 0; i < state.bodies.size(); ++i) {
    Body& body = state.bodies[i];
    body.shape = shape;
    body.moves = i % 10 == 0 ? Moves::never : Moves::by_contacts;
    body.position = test::random_in_box(random, 0, 3);
    body.orientation = random_turn(random);
    body.velocity = i % 10 == 0 ? Vec3(Vec3::Zero()) : Vec3(5 * random_direction(random));
    list.add(i);
  }
  constexpr double kStep = 0.01;
  for (int step = 0; step < 60; ++step) {
    if (step == 30) {
      list.remove(5);
      state.bodies[5].moves = Moves::not_there;
    }
    if (step == 40) {
      state.bodies[5].moves = Moves::by_contacts;
      list.add(5);
    }
    list_active(state, active);
    list.update(kStep, 9.81);
    std::set<std::pair<uint32_t, uint32_t>> listed;
    for (const Pair& pair : state.pairs) {
      listed.emplace(std::min(pair.a, pair.b), std::max(pair.a, pair.b));
    }
    EXPECT_EQ(listed.size(), state.pairs.size());
    EXPECT_TRUE(std::ranges::is_sorted(state.pairs, {}, &Pair::key));
    const auto reached = [&](const Body& body) {  // in the coming step
      const Mat3 turn = body.orientation.toRotationMatrix();
      const Vec3 half = turn.cwiseAbs() * Vec3(0.2, 0.3, 0.4);
      Bounds box(Vec3(body.position - half), Vec3(body.position + half));
      box.extend(
          Bounds(Vec3(box.min() + kStep * body.velocity), Vec3(box.max() + kStep * body.velocity)));
      return box;
    };
    const auto balls_meet = [&](const Body& a, const Body& b) {
      const Vec3 between = b.position - a.position, way = kStep * (b.velocity - a.velocity);
      const double nearest =
          way.isZero(0) ? 0 : std::clamp(-between.dot(way) / way.squaredNorm(), 0.0, 1.0);
      return (between + nearest * way).norm() <= 2 * Vec3(0.2, 0.3, 0.4).norm();
    };
    for (uint32_t i = 0; i < state.bodies.size(); ++i) {
      for (uint32_t j = i + 1; j < state.bodies.size(); ++j) {
        const Body &a = state.bodies[i], &b = state.bodies[j];
        if (a.moves == Moves::not_there || b.moves == Moves::not_there) continue;
        if (a.moves == Moves::never && b.moves == Moves::never) continue;
        if (!reached(a).intersects(reached(b)) || !balls_meet(a, b)) continue;
        EXPECT_TRUE(listed.contains({i, j})) << i << ' ' << j;
      }
    }
    for (Body& body : state.bodies) {
      body.position += kStep * body.velocity;
      body.moved = kStep * body.velocity;
    }
  }
}

// Pairs of sleeping bodies are stored and restored with their contacts as bodies fall asleep and
// wake. Each pair exists once, and is visible to a step if one of its bodies moves.
TEST(ExactEngine, PairsThatRestComeBack) {
  Philox random(5, Stream::test, 0);
  SmallModel m;
  const uint32_t shape = m.box({0.4, 0.6, 0.8});
  std::vector<CollisionShape> shapes;
  for (const ModelShape& source : m.model.shapes) shapes.emplace_back(source);
  EngineState state;
  state.bodies.resize(120);
  std::vector<uint32_t> active;
  PairList list(m.model, shapes, state, active);
  for (uint32_t i = 0; i < state.bodies.size(); ++i) {
    Body& body = state.bodies[i];
    body.shape = shape;
    body.moves = i % 10 == 0 ? Moves::never : Moves::by_contacts;
    body.position = test::random_in_box(random, 0, 2);
    list.add(i);
  }
  const auto all = [&] {
    std::map<uint64_t, std::vector<float>> found;
    const auto add = [&](const Pair& pair, std::span<const Contact> contacts) {
      std::vector<float>& depths = found[pair.key()];
      EXPECT_TRUE(depths.empty()) << "twice";
      for (const Contact& contact : contacts) depths.push_back(contact.distance_m);
    };
    for (const Pair& pair : state.pairs) add(pair, state.contacts_of(pair));
    for (const Pair& pair : state.resting.pairs) add(pair, state.resting.contacts_of(pair));
    EXPECT_EQ(found.size(), state.pairs.size() + state.resting.pairs.size());
    return found;
  };
  list_active(state, active);
  list.update(0.01, 9.81);
  for (Pair& pair : state.pairs) {
    pair.first_contact = static_cast<uint32_t>(state.contacts.size());
    pair.contact_count = static_cast<uint32_t>(1 + pair.key() % 3);
    for (uint32_t k = 0; k < pair.contact_count; ++k) {
      const Vec3f none = Vec3f::Zero();
      const auto depth = static_cast<float>(state.contacts.size());
      state.contacts.push_back(
          {.arm_a = none, .arm_b = none, .normal = none, .distance_m = -depth});
    }
  }
  const auto expected = all();
  ASSERT_GT(expected.size(), 500);
  const auto stand_still = [&](const Pair& pair) {
    return state.bodies[pair.a].stands_still() && state.bodies[pair.b].stands_still();
  };
  size_t most_resting = 0;
  for (int step = 0; step < 200; ++step) {
    for (Body& body : state.bodies) {
      if (random.uniform() < 0.1) body.asleep = body.put_to_sleep = false;
      if (random.uniform() < 0.1 + 0.3 * (step % 50 / 49)) body.asleep = true;
    }
    if (step % 40 == 39) {
      for (Body& body : state.bodies) body.asleep = step % 80 == 79;
    }
    list_active(state, active);
    list.bring_back();
    EXPECT_TRUE(std::ranges::all_of(state.resting.pairs, stand_still));
    EXPECT_TRUE(std::ranges::is_sorted(state.pairs, {}, &Pair::key));
    list.set_aside(static_cast<size_t>(std::ranges::count_if(state.pairs, stand_still)));
    EXPECT_TRUE(std::ranges::is_sorted(state.resting.pairs, {}, &Pair::key));
    EXPECT_EQ(all(), expected);
    EXPECT_LE(static_cast<double>(std::ranges::count_if(state.pairs, stand_still)),
              exact_constants::kShareToRest * static_cast<double>(state.pairs.size()));
    most_resting = std::max(most_resting, state.resting.pairs.size());
  }
  EXPECT_EQ(most_resting, expected.size());
  // A removed body takes its pairs and their contacts with it.
  for (Body& body : state.bodies) body.asleep = true;
  list.set_aside(state.pairs.size());
  ASSERT_TRUE(state.pairs.empty());
  list.remove(7);
  size_t contacts = 0;
  for (const Pair& pair : state.resting.pairs) {
    EXPECT_TRUE(pair.a != 7 && pair.b != 7);
    contacts += pair.contact_count;
  }
  EXPECT_TRUE(state.pairs.empty());
  EXPECT_LT(state.resting.pairs.size(), expected.size());
  EXPECT_EQ(contacts, state.resting.contacts.size());
  EXPECT_EQ(contacts, list.resting_contacts().count);
}

TEST(ExactEngine, BallsWhoseBoxesMeetAtACornerAreNoPair) {
  for (const double apart : {0.95, 1.2}) {  // of their diameter; boxes overlap up to 1.7
    SmallModel m;
    m.sphere(0.5);
    std::vector<CollisionShape> shapes;
    shapes.emplace_back(m.model.shapes.back());
    EngineState state;
    state.bodies.resize(2);
    std::vector<uint32_t> active;
    PairList list(m.model, shapes, state, active);
    for (uint32_t i = 0; i < 2; ++i) {
      state.bodies[i].moves = Moves::by_contacts;
      state.bodies[i].position = i * apart * Vec3::Ones().normalized();
      list.add(i);
    }
    list_active(state, active);
    list.update(0.01, 9.81);
    EXPECT_EQ(state.pairs.size(), apart < 1 ? 1U : 0U) << apart;
  }
}

SmallModel crowd(const Vec3& gravity, int bodies, double restitution) {
  SmallModel m;
  m.scene.gravity = gravity;
  const uint32_t material = m.material(restitution, 0.5);
  Philox random(5, Stream::test, 0);
  std::vector<Vec3> points;
  for (int i = 0; i < 24; ++i) points.push_back(0.15 * random_direction(random));
  const std::vector<uint32_t> shapes = {m.box({0.2, 0.25, 0.3}), m.sphere(0.12),
                                        m.cylinder(0.1, 0.25), m.hull(points)};
  if (!gravity.isZero()) m.body(m.plane(), material, Vec3::Zero(), Role::fixed);
  const int side = static_cast<int>(std::ceil(std::cbrt(bodies)));
  for (int i = 0; i < bodies; ++i) {
    const Vec3 cell(i % side, i / (side * side), i / side % side);
    ModelBody& body = m.body(shapes[static_cast<size_t>(i) % shapes.size()], material,
                             0.42 * cell + Vec3(0, 0.3, 0));
    body.pose.orientation = random_turn(random);
    const Vec3 middle = Vec3::Constant(0.21 * (side - 1));
    body.linear_velocity = gravity.isZero() ? Vec3(middle - 0.42 * cell) : Vec3(Vec3::Zero());
    body.angular_velocity = 3 * random_direction(random);
  }
  return m;
}

std::unique_ptr<Simulator> simulate(const SmallModel& m) {
  return make_impulse_simulator(m.scene, m.model, make_exact_engine(m.scene, m.model));
}

// Contact springs scale with the lighter body: a load is not an overlap to be removed slowly.
TEST(ExactEngine, AThousandTimesItsMassSinksLessThanAHundredthOfItsHeight) {
  for (const double edge : {0.1, 1.0}) {
    SmallModel m;
    const uint32_t light = m.material(0.1, 0.5, 1000), heavy = m.material(0.1, 0.5, 1e6);
    const uint32_t box = m.box(Vec3::Constant(edge));
    m.body(m.plane(), light, Vec3::Zero(), Role::fixed);
    m.body(box, light, {0, edge / 2, 0});
    m.body(box, heavy, {0, 1.5 * edge, 0});
    const auto simulator = simulate(m);
    for (int i = 0; i < 180; ++i) simulator->step_frame();
    EXPECT_NEAR(simulator->states().position[2].y(), 1.5 * edge, 0.01 * edge) << edge;
    EXPECT_NEAR(simulator->states().position[1].y(), 0.5 * edge, 0.005 * edge) << edge;
  }
}

// The same among many bodies, which have fewer substeps: four skew stones under a slab.
TEST(ExactEngine, AThousandTimesItsMassLiesAmongMany) {
  SmallModel m;
  const uint32_t light = m.material(0.1, 0.7, 1000), heavy = m.material(0.1, 0.7, 3e4);
  const uint32_t stone = m.box({0.1, 0.12, 0.1}), slab = m.box({0.6, 0.112, 0.6});
  m.body(m.plane(), light, Vec3::Zero(), Role::fixed);
  for (int i = 0; i < 4; ++i) {
    m.body(stone, light, {i % 2 == 0 ? -0.2 : 0.2, 0.06, i < 2 ? -0.2 : 0.2});
    m.model.bodies.back().pose.orientation = Eigen::AngleAxisd(0.4 + i, Vec3::UnitY());
  }
  m.body(slab, heavy, {0.03, 0.4, -0.02});
  for (int i = 0; i < 120; ++i) m.body(stone, light, {2 + 0.3 * (i % 10), 0.06, 0.3 * (i / 10)});
  const auto simulator = simulate(m);
  for (int i = 0; i < 180; ++i) simulator->step_frame();
  EXPECT_NEAR(simulator->states().position[5].y(), 0.176, 0.001);
  EXPECT_LT(std::ranges::max(overlap_depths(m.model, simulator->states())), 0.001);
}

// A light ball between a heavy one and a sleeping one hits the latter with the momentum of the
// heavy one. Balls that fly beside it, or away from it, add nothing.
TEST(ExactEngine, AHitHasTheMomentumOfWhatComesBehind) {
  SmallModel m;
  m.scene.gravity = Vec3::Zero();
  const uint32_t light = m.material(0.1, 0.5, 100), heavy = m.material(0.1, 0.5, 10000);
  const uint32_t ball = m.sphere(0.1);
  m.body(ball, light, Vec3::Zero());
  m.body(ball, light, {-0.201, 0, 0}).linear_velocity = {5, 0, 0};
  m.body(ball, heavy, {-0.402, 0, 0}).linear_velocity = {5, 0, 0};
  m.body(ball, heavy, {-0.201, 0.201, 0}).linear_velocity = {5, 0, 0};
  m.body(ball, heavy, {-0.201, -0.201, 0}).linear_velocity = {-5, 0, 0};
  const auto engine = make_exact_engine(m.scene, m.model);
  for (uint32_t i = 0; i < m.model.bodies.size(); ++i) {
    const ModelBody& body = m.model.bodies[i];
    engine->add(i, {body.pose.position, body.pose.orientation, body.linear_velocity, Vec3::Zero()},
                false, false);
  }
  engine->put_to_sleep(0);
  std::vector<Hit> hits;
  StageTimer timer;
  engine->step(timer, [&] { engine->find_hits(hits); });
  ASSERT_EQ(hits.size(), 1u);
  EXPECT_EQ(hits[0].sleeper, 0u);
  EXPECT_EQ(hits[0].other, 1u);
  const double mass_kg = m.model.bodies[1].mass_kg + m.model.bodies[2].mass_kg;
  EXPECT_NEAR(hits[0].momentum_ns, 5 * mass_kg, 1e-3 * 5 * mass_kg);
}

// Bodies that collide conserve momentum and gain no energy, within float precision.
TEST(ExactEngine, ACrowdKeepsItsMomentum) {
  struct Crowd {
    int bodies;
    double restitution, tolerance;
  };
  for (const auto& [bodies, restitution, tolerance] :
       {Crowd{64, 0, 5e-6}, Crowd{64, 0.5, 5e-6}, Crowd{125, 0.5, 5e-6}}) {
    const SmallModel m = crowd(Vec3::Zero(), bodies, restitution);
    const auto simulator = simulate(m);
    const auto momentum = [&] {
      Vec3 sum = Vec3::Zero();
      for (size_t i = 0; i < m.model.bodies.size(); ++i) {
        sum += m.model.bodies[i].mass_kg * simulator->states().linear_velocity[i];
      }
      return sum;
    };
    double scale = 0;
    for (const ModelBody& body : m.model.bodies)
      scale += body.mass_kg * body.linear_velocity.norm();
    const Vec3 before = momentum();
    const double start = simulator->statistics().kinetic_energy_j;
    double energy = start;
    for (int i = 0; i < 60; ++i) {
      const double now = simulator->step_frame().kinetic_energy_j;
      EXPECT_LE(now, energy * 1.001) << i;
      energy = now;
      EXPECT_LT((momentum() - before).norm(), tolerance * scale) << i;
    }
    EXPECT_LT(energy, 0.9 * start) << "they meet";
  }
}

// Wider than the gap between two walls, as if forced in: it may be lifted out, but two fixed sides
// must exert a bounded force.
TEST(ExactEngine, ASqueezedBodyIsNotShotOut) {
  Philox random(5, Stream::test, 0);
  for (int trial = 0; trial < 20; ++trial) {
    SmallModel m;
    const uint32_t wood = m.material(0.2, 0.5);
    const uint32_t wall = m.box({1, 1, 1});
    const double gap = 0.15 + 0.03 * random.uniform();
    m.body(wall, wood, {0.5 + gap / 2, 0, 0}, Role::fixed);
    m.body(wall, wood, {-0.5 - gap / 2, 0, 0}, Role::fixed);
    m.body(wall, wood, {0, -0.7, 0}, Role::fixed);
    const uint32_t cube = m.box(Vec3::Constant(0.2));
    const double angle = 0.2 * random.uniform();
    const Vec3 axis = random_direction(random);
    m.body(cube, wood, {0, 0.1, 0}).pose.orientation = Quat(Eigen::AngleAxisd(angle, axis));
    const auto simulator = make_simulator(m.scene, m.model);
    double fastest = 0;
    for (int frame = 0; frame < 120; ++frame) {
      simulator->step_frame();
      fastest = std::max(fastest, simulator->states().linear_velocity[3].norm());
    }
    EXPECT_LT(fastest, 1.5) << trial;  // a fall through half its height
  }
}

// Scaling lengths by s and times by sqrt(s): bodies that start inside others separate at the same
// pace. Bodies of metres have substeps of at most 1/960 s.
TEST(ExactEngine, PenetratingBodiesSeparateAlikeAtAnySize) {
  const auto distances_at = [](double scale) {
    SmallModel m;
    m.scene.frame_rate = 60 / std::sqrt(scale);
    m.scene.step_s = 1 / (240 / std::sqrt(scale));
    const uint32_t material = m.material(0, 0.5);
    const uint32_t ball = m.sphere(0.1 * scale);
    m.body(ball, material, {0, 0, 0});
    m.body(ball, material, {0.1 * scale, 0, 0});
    const auto simulator = make_simulator(m.scene, m.model);
    std::vector<double> distances;  // in radii
    for (int frame = 0; frame < 30; ++frame) {
      simulator->step_frame();
      const std::vector<Vec3>& position = simulator->states().position;
      distances.push_back((position[1] - position[0]).norm() / (0.1 * scale));
    }
    return distances;
  };
  const std::vector<double> reference = distances_at(1);
  EXPECT_GT(reference.back(), 1.3) << "they part";
  for (const double scale : {1.0 / 256, 1.0 / 4}) {
    const std::vector<double> found = distances_at(scale);
    for (size_t i = 0; i < found.size(); ++i) EXPECT_NEAR(found[i], reference[i], 1e-3) << scale;
  }
}

// Bodies of crossing bars, placed into each other at random. Each pair of bars has a direction in
// which it separates soonest, and these directions contradict each other.
TEST(ExactEngine, BodiesOfManyPiecesPartWhateverTheirPiecesWant) {
  SmallModel m;
  m.scene.gravity = Vec3::Zero();
  const uint32_t wood = m.material(0, 0.3);
  const uint32_t jack = m.box(Vec3::Constant(0.3));
  ModelShape& shape = m.model.shapes[jack];
  shape.pieces.clear();
  for (int k = 0; k < 3; ++k) {
    for (const double side : {0.085, -0.085}) {
      Vec3 size = Vec3::Constant(0.06);
      size[k] = 0.17;
      shape.pieces.push_back(
          {CollisionPiece::Kind::box, {side * Vec3::Unit(k), Quat::Identity()}, size, {}});
    }
  }
  Philox random(6, Stream::test, 0);
  constexpr int kPairs = 20;
  for (int i = 0; i < kPairs; ++i) {
    const Vec3 place(2 * (i % 10), 0, 2 * (i / 10));
    m.body(jack, wood, place).pose.orientation = random_turn(random);
    const Vec3 shift = test::random_arrow(random, 0, 0.1);
    m.body(jack, wood, place + shift).pose.orientation = random_turn(random);
  }
  const auto simulator = make_simulator(m.scene, m.model);
  run(*simulator, 480);
  EXPECT_LT(inspect_pile(m.model, m.scene.gravity, simulator->states()).deepest_penetration_m,
            1e-3);
  for (const Vec3& velocity : simulator->states().linear_velocity) EXPECT_LT(velocity.norm(), 0.2);
}

// At any number of threads, for few bodies, solved in doubles, and many, solved in floats.
TEST(ExactEngine, TheSameBytesAtAnyNumberOfThreads) {
  for (const int bodies : {60, 512}) {
    const SmallModel m = crowd(Vec3(0, -9.81, 0), bodies, 0.2);
    std::vector<std::string> hashes;
    for (const int threads : {1, 2, 4}) {
      set_thread_count(threads);
      const auto simulator = simulate(m);
      run(*simulator, 60);
      Hasher hasher;
      hasher.add_values(std::span<const Vec3>(simulator->states().position));
      hasher.add_values(std::span<const Vec3>(simulator->states().angular_velocity));
      hashes.push_back(hasher.digest());
    }
    EXPECT_EQ(hashes[0], hashes[1]) << bodies;
    EXPECT_EQ(hashes[0], hashes[2]) << bodies;
  }
  set_thread_count(available_threads());
}

// Friction also acts in the impact: a ball thrown at a low angle leaves the ground spinning.
TEST(ExactEngine, ABallThatBouncesTakesUpSpin) {
  SmallModel m;
  m.scene.gravity = Vec3::Zero();
  // The impact occurs at the ball's position at the start of the step.
  m.scene.step_s = Scene::kFixedStep;
  const uint32_t material = m.material(0.5, 0.2);
  m.body(m.plane(), material, Vec3::Zero(), Role::fixed);
  m.body(m.sphere(0.1), material, {0, 0.3, 0}).linear_velocity = {3, -2, 0};
  const auto simulator = simulate(m);
  run(*simulator, 30);
  // It slides all the time: the impact's friction is 0.2 of it.
  const double impulse = 2 * (1 + 0.5);
  const Vec3& velocity = simulator->states().linear_velocity[1];
  EXPECT_NEAR(velocity.y(), 1, 1e-5);
  EXPECT_NEAR(velocity.x(), 3 - 0.2 * impulse, 1e-5);
  // The impact acts at the ball's position at the start of the step, so its lever is longer by half
  // the gap.
  const double spin = -0.2 * impulse * 2.5 / 0.1;
  EXPECT_NEAR(simulator->states().angular_velocity[1].z(), spin, 0.05 * std::abs(spin));
}

// A falling body bounces in the step in which it arrives, and not before.
TEST(ExactEngine, ABodyThatDoesNotArriveInAStepDoesNotBounce) {
  SmallModel m;
  m.scene.gravity = Vec3(0, -9.81, 0);
  m.scene.frame_rate = 240;
  const uint32_t material = m.material(0.8, 0.2);
  const uint32_t ball = m.sphere(0.1);
  m.body(m.plane(), material, Vec3::Zero(), Role::fixed);
  constexpr double kStep = 1.0 / 240, kSpeed = 0.5, kFall = 9.81 * kStep * kStep / 2;
  Philox random(7, Stream::test, 0);
  std::vector<double> left;  // remaining way to the ground at the end of the step, in falls
  for (int i = 0; i < 60; ++i) {
    left.push_back(random.uniform(-1, 2));
    const double gap = kSpeed * kStep + (1 + left.back()) * kFall;
    m.body(ball, material, {0.5 * i, 0.1 + gap, 0}).linear_velocity = {0, -kSpeed, 0};
  }
  const auto simulator = simulate(m);
  run(*simulator, 1);
  for (size_t i = 0; i < left.size(); ++i) {
    const double rise = simulator->states().linear_velocity[i + 1].y();
    SCOPED_TRACE(left[i]);
    if (left[i] < 0) {
      EXPECT_GT(rise, 0.7 * kSpeed);
    }
    // A hundredth of the step's way, a quarter of a fall, counts as none.
    if (left[i] > 0.3) {
      EXPECT_LT(rise, 0);
    }
  }
}

// Two bodies in equal fall collide as if without gravity.
TEST(ExactEngine, BodiesInEqualFallDoNotSeparateBeforeContact) {
  SmallModel m;
  m.scene.gravity = Vec3(0, -9.81, 0);
  m.scene.frame_rate = 240;
  const uint32_t material = m.material(0.8, 0.2);
  const uint32_t ball = m.sphere(0.1);
  constexpr double kStep = 1.0 / 240, kSpeed = 0.5, kFall = 9.81 * kStep * kStep / 2;
  Philox random(8, Stream::test, 0);
  std::vector<double> left;  // remaining distance at the end of the step, in falls
  for (int i = 0; i < 60; ++i) {
    left.push_back(random.uniform(-2, 2));
    const double gap = kSpeed * kStep + left.back() * kFall;
    m.body(ball, material, {0.5 * i, 10, 0});
    m.body(ball, material, {0.5 * i, 10.2 + gap, 0}).linear_velocity = {0, -kSpeed, 0};
  }
  const auto simulator = simulate(m);
  run(*simulator, 1);
  const std::vector<Vec3>& velocity = simulator->states().linear_velocity;
  for (size_t i = 0; i < left.size(); ++i) {
    const double parting = velocity[2 * i + 1].y() - velocity[2 * i].y();
    SCOPED_TRACE(left[i]);
    if (left[i] < 0) {
      EXPECT_GT(parting, 0.7 * kSpeed);
    }
    if (left[i] > 0.3) {
      EXPECT_LT(parting, 0);
    }
  }
}

}  // namespace
}  // namespace pilesim::exact
