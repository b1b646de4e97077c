// From a Bullet world to its state.

#include <map>

#include "simulate/bullet/bullet_algorithms.h"
#include "simulate/bullet/bullet_engine.h"
#include "simulate/bullet/bullet_tree.h"

namespace pilesim {
namespace {

std::vector<uint32_t> places_of_manifolds(btCollisionAlgorithm& algorithm) {
  btManifoldArray manifolds;
  algorithm.getAllContactManifolds(manifolds);
  std::vector<uint32_t> places;
  for (int i = 0; i < manifolds.size(); ++i) places.push_back(place_of(manifolds[i]));
  return places;
}

BulletPair pair_state(const btBroadphasePair& pair) {
  BulletPair state{.a = index_of(*pair.m_pProxy0),
                   .b = index_of(*pair.m_pProxy1),
                   .algorithm = kind_of(pair.m_algorithm)};
  switch (state.algorithm) {
    case BulletAlgorithm::none:
      break;
    case BulletAlgorithm::pieces:
    case BulletAlgorithm::plane:
      static_cast<const PairAlgorithm*>(pair.m_algorithm)->save(state);
      break;
    case BulletAlgorithm::compound: {
      auto& children = children_of(*static_cast<btCompoundCollisionAlgorithm*>(pair.m_algorithm));
      for (int i = 0; i < children.size(); ++i) {
        auto& child = state.children.emplace_back();
        if (children[i] != nullptr) child = places_of_manifolds(*children[i]);
      }
      break;
    }
    case BulletAlgorithm::stock:
      state.manifolds = places_of_manifolds(*pair.m_algorithm);
      break;
  }
  return state;
}

BulletContact contact_state(const btManifoldPoint& p) {
  return {.local_a = from_bullet(p.m_localPointA),
          .local_b = from_bullet(p.m_localPointB),
          .on_b = from_bullet(p.m_positionWorldOnB),
          .on_a = from_bullet(p.m_positionWorldOnA),
          .normal = from_bullet(p.m_normalWorldOnB),
          .friction_direction = {from_bullet(p.m_lateralFrictionDir1),
                                 from_bullet(p.m_lateralFrictionDir2)},
          .distance_m = p.m_distance1,
          .friction = p.m_combinedFriction,
          .rolling_friction = p.m_combinedRollingFriction,
          .spinning_friction = p.m_combinedSpinningFriction,
          .restitution = p.m_combinedRestitution,
          .part = {p.m_partId0, p.m_partId1},
          .index = {p.m_index0, p.m_index1},
          .flags = p.m_contactPointFlags,
          .impulse_ns = p.m_appliedImpulse,
          .former_right_side = p.m_prevRHS,
          .friction_impulse_ns = {p.m_appliedImpulseLateral1, p.m_appliedImpulseLateral2},
          .friction_motion_m_s = {p.m_contactMotion1, p.m_contactMotion2},
          .contact_cfm = p.m_contactCFM,
          .contact_erp = p.m_contactERP,
          .friction_cfm = p.m_frictionCFM,
          .age_steps = p.m_lifeTime};
}

std::vector<BulletContact> manifold_state(const btPersistentManifold& manifold) {
  std::vector<BulletContact> contacts;
  for (int i = 0; i < manifold.getNumContacts(); ++i) {
    contacts.push_back(contact_state(manifold.getContactPoint(i)));
  }
  return contacts;
}

}  // namespace

BulletState BulletEngine::state() const {
  BulletState state;
  const btCollisionObjectArray& objects = world_.getCollisionObjectArray();
  for (int i = 0; i < objects.size(); ++i) {
    state.bodies.push_back(body_state(static_cast<const btRigidBody&>(*objects[i])));
  }
  state.movable = world_.order_of_movable();
  state.tree = read_tree(broad_phase_.m_sets[btDbvtBroadphase::DYNAMIC_SET]);
  state.last_proxy_id = broad_phase_.m_gid;
  state.has_parted = broad_phase_.parted();
  const btBroadphasePairArray& pairs = broad_phase_.m_paircache->getOverlappingPairArray();
  for (int i = 0; i < pairs.size(); ++i) state.pairs.push_back(pair_state(pairs[i]));
  for (int i = 0; i < dispatcher_.getNumManifolds(); ++i) {
    state.manifolds.push_back(manifold_state(*dispatcher_.getManifoldByIndexInternal(i)));
  }
  for (const auto& [id, tie] : constraints_) {
    auto& slider = static_cast<btSliderConstraint&>(*tie.constraint);
    state.nails.push_back({.id = id,
                           .a = tie.a,
                           .b = tie.b,
                           .breaking_impulse_ns = slider.getBreakingImpulseThreshold(),
                           .enabled = slider.isEnabled(),
                           .in_a = from_bullet(slider.getFrameOffsetA()),
                           .in_b = from_bullet(slider.getFrameOffsetB())});
  }
  state.next_nail = next_constraint_;
  state.constraints = constraint_order();
  state.friction_changed = friction_changed_;
  return state;
}

BulletBody BulletEngine::body_state(const btRigidBody& body) const {
  const auto index = static_cast<uint32_t>(body.getUserIndex());
  const Record& record = records_[index];
  const btBroadphaseProxy& proxy = *body.getBroadphaseProxy();
  const bool is_dynamic = model_.bodies[index].role == Role::dynamic;
  BulletBody state{.index = index,
                   .held = is_dynamic && body.getUserPointer() == nullptr,
                   .moved = record.moved,
                   .put_to_sleep = record.put_to_sleep,
                   .pose = from_bullet(body.getWorldTransform()),
                   .inverse_inertia = from_bullet(body.getInvInertiaTensorWorld()),
                   .velocity = from_bullet(body.getLinearVelocity()),
                   .spin = from_bullet(body.getAngularVelocity()),
                   .box_low = from_bullet(proxy.m_aabbMin),
                   .box_high = from_bullet(proxy.m_aabbMax),
                   .proxy_id = proxy.m_uniqueId,
                   .root_friction = body.getFriction(),
                   .slow_s = body.getDeactivationTime(),
                   .activation = body.getActivationState(),
                   .rest = dynamic_[index].rest};
  if (record.hinge) {
    auto& hinge = static_cast<btHingeConstraint&>(*record.hinge);
    state.hinge = {from_bullet(hinge.getAFrame()), from_bullet(hinge.getBFrame())};
  }
  return state;
}

std::vector<uint64_t> BulletEngine::constraint_order() const {
  std::map<const btTypedConstraint*, uint64_t> number;
  for (uint32_t i = 0; i < records_.size(); ++i) {
    if (records_[i].hinge) number[records_[i].hinge.get()] = i;
  }
  for (const auto& [id, tie] : constraints_) number[tie.constraint.get()] = records_.size() + id;
  std::vector<uint64_t> order;
  for (int i = 0; i < world_.getNumConstraints(); ++i) {
    order.push_back(number.at(world_.getConstraint(i)));
  }
  return order;
}

}  // namespace pilesim
