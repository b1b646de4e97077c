// From a state to a Bullet world: bodies in their order, the tree of the broad phase, pairs with
// what their algorithms keep, contact points with their impulses, constraints.

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "simulate/bullet/bullet_algorithms.h"
#include "simulate/bullet/bullet_engine.h"
#include "simulate/bullet/bullet_nail.h"
#include "simulate/bullet/bullet_tree.h"

namespace pilesim {
namespace {

void require_finite(const Vec3& v) {
  StateReader::require(v.allFinite(), "numbers that are finite");
}
void require_finite(const BulletFrame& frame) {
  StateReader::require(frame.axes.allFinite(), "numbers that are finite");
  require_finite(frame.origin);
}

// Makes algorithms anew for pairs that had one.
class AlgorithmLoader {
 public:
  AlgorithmLoader(btCollisionDispatcher& dispatcher, const btDispatcherInfo& info,
                  ManifoldPlaces& places)
      : dispatcher_(dispatcher), info_(info), places_(places) {}

  void load(btBroadphasePair& pair, const BulletPair& state) {
    const auto& a = *static_cast<const btCollisionObject*>(pair.m_pProxy0->m_clientObject);
    const auto& b = *static_cast<const btCollisionObject*>(pair.m_pProxy1->m_clientObject);
    if (state.algorithm == BulletAlgorithm::none) return;
    const btCollisionObjectWrapper in_a(nullptr, a.getCollisionShape(), &a, a.getWorldTransform(),
                                        -1, -1);
    const btCollisionObjectWrapper in_b(nullptr, b.getCollisionShape(), &b, b.getWorldTransform(),
                                        -1, -1);
    btCollisionAlgorithm* made =
        dispatcher_.findAlgorithm(&in_a, &in_b, nullptr, BT_CONTACT_POINT_ALGORITHMS);
    pair.m_algorithm = made;
    StateReader::require(kind_of(made) == state.algorithm, "the algorithm of these shapes");
    switch (state.algorithm) {
      case BulletAlgorithm::none:
        break;
      case BulletAlgorithm::pieces:
      case BulletAlgorithm::plane:
        static_cast<PairAlgorithm*>(made)->load(state, places_);
        break;
      case BulletAlgorithm::compound:
        load_children(*static_cast<btCompoundCollisionAlgorithm*>(made), in_a, in_b, state);
        break;
      case BulletAlgorithm::stock:
        load_stock(*made, in_a, in_b, state.manifolds);
        break;
    }
  }

 private:
  // Some make their manifold only when they run for the first time; what they find then is written
  // over.
  void load_stock(btCollisionAlgorithm& made, const btCollisionObjectWrapper& a,
                  const btCollisionObjectWrapper& b, const std::vector<uint32_t>& places) {
    btManifoldArray manifolds;
    made.getAllContactManifolds(manifolds);
    if (static_cast<size_t>(manifolds.size()) < places.size()) {
      btManifoldResult result(&a, &b);
      made.processCollision(&a, &b, info_, &result);
      manifolds.resize(0);
      made.getAllContactManifolds(manifolds);
    }
    StateReader::require(static_cast<size_t>(manifolds.size()) == places.size(),
                         "as many contact manifolds as the shapes have");
    for (int i = 0; i < manifolds.size(); ++i) {
      places_.put(places[static_cast<size_t>(i)], *manifolds[i]);
    }
  }

  void load_children(btCompoundCollisionAlgorithm& made, const btCollisionObjectWrapper& a,
                     const btCollisionObjectWrapper& b, const BulletPair& state) {
    auto& children = children_of(made);
    StateReader::require(state.children.size() == static_cast<size_t>(children.size()),
                         "as many pieces as the shape has");
    const bool is_first = a.getCollisionShape()->isCompound();
    const btCollisionObjectWrapper &body = is_first ? a : b, &other = is_first ? b : a;
    const auto& shape = static_cast<const btCompoundShape&>(*body.getCollisionShape());
    for (int i = 0; i < children.size(); ++i) {
      const auto& places = state.children[static_cast<size_t>(i)];
      if (!places) continue;
      const btTransform pose = body.getWorldTransform() * shape.getChildTransform(i);
      const btCollisionObjectWrapper child(&body, shape.getChildShape(i), body.getCollisionObject(),
                                           pose, -1, i);
      children[i] = dispatcher_.findAlgorithm(&child, &other, nullptr, BT_CONTACT_POINT_ALGORITHMS);
      load_stock(*children[i], child, other, *places);
    }
  }

  btCollisionDispatcher& dispatcher_;
  const btDispatcherInfo& info_;
  ManifoldPlaces& places_;
};

btManifoldPoint contact_of(const BulletContact& state) {
  btManifoldPoint p;
  p.m_localPointA = to_bullet(state.local_a);
  p.m_localPointB = to_bullet(state.local_b);
  p.m_positionWorldOnB = to_bullet(state.on_b);
  p.m_positionWorldOnA = to_bullet(state.on_a);
  p.m_normalWorldOnB = to_bullet(state.normal);
  p.m_lateralFrictionDir1 = to_bullet(state.friction_direction[0]);
  p.m_lateralFrictionDir2 = to_bullet(state.friction_direction[1]);
  p.m_distance1 = state.distance_m;
  p.m_combinedFriction = state.friction;
  p.m_combinedRollingFriction = state.rolling_friction;
  p.m_combinedSpinningFriction = state.spinning_friction;
  p.m_combinedRestitution = state.restitution;
  p.m_partId0 = state.part[0];
  p.m_partId1 = state.part[1];
  p.m_index0 = state.index[0];
  p.m_index1 = state.index[1];
  p.m_contactPointFlags = state.flags;
  p.m_appliedImpulse = state.impulse_ns;
  p.m_prevRHS = state.former_right_side;
  p.m_appliedImpulseLateral1 = state.friction_impulse_ns[0];
  p.m_appliedImpulseLateral2 = state.friction_impulse_ns[1];
  p.m_contactMotion1 = state.friction_motion_m_s[0];
  p.m_contactMotion2 = state.friction_motion_m_s[1];
  p.m_contactCFM = state.contact_cfm;
  p.m_contactERP = state.contact_erp;
  p.m_frictionCFM = state.friction_cfm;
  p.m_lifeTime = state.age_steps;
  return p;
}

void load_manifold(btPersistentManifold& manifold, const std::vector<BulletContact>& contacts) {
  StateReader::require(contacts.size() <= MANIFOLD_CACHE_SIZE, "at most four contact points");
  manifold.clearManifold();
  for (const BulletContact& contact : contacts) manifold.addManifoldPoint(contact_of(contact));
}

// Puts a filter aside: algorithms ask for it when they are made, and it was another one then.
class FilterAside {
 public:
  explicit FilterAside(PairFilter& filter) : filter_(filter), kept_(std::exchange(filter, {})) {}
  ~FilterAside() { filter_ = std::move(kept_); }
  FilterAside(const FilterAside&) = delete;
  FilterAside& operator=(const FilterAside&) = delete;

 private:
  PairFilter& filter_;
  PairFilter kept_;
};

}  // namespace

void BulletEngine::load(StateReader& reader) {
  BulletState state;
  reader(state);
  set_state(state);
}

void BulletEngine::set_state(const BulletState& state) {
  clear();
  const FilterAside aside(dispatcher_.filter);
  add_bodies(state.bodies);
  set_broad_phase(state);
  set_constraints(state);
  set_pairs(state);
  friction_changed_ = state.friction_changed;
  // Last, since sleepers would get no algorithms.
  for (const BulletBody& source : state.bodies) {
    Record& record = records_[source.index];
    btRigidBody& body = *record.body;
    record.moved = source.moved;
    if (source.put_to_sleep) put_to_sleep(source.index);
    body.setLinearVelocity(to_bullet(source.velocity));
    body.setAngularVelocity(to_bullet(source.spin));
    body.setFriction(source.root_friction);
    body.forceActivationState(source.activation);
    body.setDeactivationTime(source.slow_s);
    const_cast<btMatrix3x3&>(body.getInvInertiaTensorWorld()) = to_bullet(source.inverse_inertia);
  }
}

void BulletEngine::add_bodies(const std::vector<BulletBody>& bodies) {
  StateReader::require(bodies.size() <= records_.size(), "bodies of the scene");
  for (const BulletBody& body : bodies) {
    StateReader::require(body.index < records_.size() && !contains(body.index), "each body once");
    const ModelBody& source = model_.bodies[body.index];
    const bool moves = source.role == Role::dynamic && !body.held;
    StateReader::require(
        (source.role == Role::dynamic || !body.held) && (moves || !body.put_to_sleep),
        "only what is dynamic held or asleep");
    StateReader::require(body.activation >= ACTIVE_TAG && body.activation <= DISABLE_SIMULATION,
                         "a state of activation");
    require_finite(body.pose);
    for (const Vec3* v : {&body.velocity, &body.spin, &body.box_low, &body.box_high}) {
      require_finite(*v);
    }
    const btTransform pose = to_bullet(body.pose);
    const Quat& body_from_bullet = shapes_[source.shape].body_from_bullet();
    const BodyMotion start{
        .position = body.pose.origin,
        .orientation = from_bullet(pose.getRotation()) * body_from_bullet.conjugate()};
    add(body.index, start, body.held, false);
    Record& record = records_[body.index];
    record.body->setWorldTransform(pose);
    dynamic_[body.index].rest = body.rest;
    StateReader::require(body.hinge.has_value() == (record.hinge != nullptr), "its hinge");
    if (!body.hinge) continue;
    for (const BulletFrame& frame : *body.hinge) require_finite(frame);
    auto& hinge = static_cast<btHingeConstraint&>(*record.hinge);
    hinge.getAFrame() = to_bullet((*body.hinge)[0]);
    hinge.getBFrame() = to_bullet((*body.hinge)[1]);
  }
}

void BulletEngine::set_broad_phase(const BulletState& state) {
  broad_phase_.m_gid = state.last_proxy_id;
  broad_phase_.set_parted(state.has_parted);
  std::vector<uint32_t> all, ids, may_move = world_.order_of_movable();
  for (const BulletBody& body : state.bodies) {
    all.push_back(body.index);
    ids.push_back(static_cast<uint32_t>(body.proxy_id));
  }
  std::ranges::sort(ids);
  StateReader::require(std::ranges::adjacent_find(ids) == ids.end(), "a number for each box");
  require_tree(state.tree, all);
  std::vector<uint32_t> ordered = state.movable;
  std::ranges::sort(ordered);
  std::ranges::sort(may_move);
  StateReader::require(ordered == may_move, "an order of all bodies that can move");

  broad_phase_.remove_all_pairs(dispatcher_);
  for (const BulletBody& body : state.bodies) {
    btBroadphaseProxy& proxy = *records_[body.index].body->getBroadphaseProxy();
    proxy.m_uniqueId = body.proxy_id;
    proxy.m_aabbMin = to_bullet(body.box_low);
    proxy.m_aabbMax = to_bullet(body.box_high);
  }
  shape_tree(state.tree, broad_phase_.m_sets[btDbvtBroadphase::DYNAMIC_SET], [&](uint32_t body) {
    return static_cast<btDbvtProxy*>(records_[body].body->getBroadphaseProxy())->leaf;
  });
  std::vector<btRigidBody*> order;
  for (const uint32_t body : state.movable) order.push_back(records_[body].body.get());
  world_.set_order_of_movable(order);
}

void BulletEngine::set_constraints(const BulletState& state) {
  for (const BulletNail& source : state.nails) {
    for (const uint32_t body : {source.a, source.b}) {
      StateReader::require(body < records_.size() && contains(body), "nails of bodies");
    }
    StateReader::require(source.a != source.b && !constraints_.contains(source.id),
                         "each nail once");
    for (const BulletFrame* frame : {&source.in_a, &source.in_b}) require_finite(*frame);
    const Nail nail{.a = source.a,
                    .b = source.b,
                    .point = Vec3::Zero(),
                    .axis = Vec3::UnitX(),
                    .breaking_impulse_ns = source.breaking_impulse_ns};
    auto constraint = make_nail(nail, *records_[nail.a].body, *records_[nail.b].body);
    auto& slider = static_cast<btSliderConstraint&>(*constraint);
    slider.getFrameOffsetA() = to_bullet(source.in_a);
    slider.getFrameOffsetB() = to_bullet(source.in_b);
    slider.setEnabled(source.enabled);
    world_.addConstraint(&slider);
    constraints_[source.id] = {std::move(constraint), nail.a, nail.b};
  }
  next_constraint_ = state.next_nail;
  StateReader::require(constraints_.empty() || constraints_.rbegin()->first < next_constraint_,
                       "numbers of nails that are taken");
  std::vector<uint64_t> wanted = state.constraints, there = constraint_order();
  std::ranges::sort(wanted);
  std::ranges::sort(there);
  StateReader::require(wanted == there, "an order of all constraints");
  std::vector<btTypedConstraint*> constraints;
  for (const uint64_t number : state.constraints) {
    const bool is_hinge = number < records_.size();
    constraints.push_back(is_hinge
                              ? records_[number].hinge.get()
                              : constraints_.at(static_cast<ConstraintId>(number - records_.size()))
                                    .constraint.get());
  }
  world_.set_order_of_constraints(constraints);
}

void BulletEngine::set_pairs(const BulletState& state) {
  ManifoldPlaces places(state.manifolds.size());
  AlgorithmLoader algorithms(dispatcher_, world_.getDispatchInfo(), places);
  for (const BulletPair& source : state.pairs) {
    for (const uint32_t body : {source.a, source.b}) {
      StateReader::require(body < records_.size() && contains(body), "pairs of bodies");
    }
    StateReader::require(source.a != source.b, "pairs of two bodies");
    btBroadphasePair* pair =
        broad_phase_.m_paircache->addOverlappingPair(records_[source.a].body->getBroadphaseProxy(),
                                                     records_[source.b].body->getBroadphaseProxy());
    StateReader::require(pair != nullptr && pair->m_algorithm == nullptr, "each pair once");
    algorithms.load(*pair, source);
  }
  StateReader::require(static_cast<size_t>(dispatcher_.getNumManifolds()) == places.all().size() &&
                           std::ranges::find(places.all(), nullptr) == places.all().end(),
                       "a pair for each contact manifold");
  dispatcher_.set_order_of_manifolds(places.all());
  for (size_t i = 0; i < places.all().size(); ++i) {
    load_manifold(*places.all()[i], state.manifolds[i]);
  }
}

}  // namespace pilesim
