// Saving and loading of a Bullet world: bodies in their order, the tree of the broad phase, pairs
// with what their algorithms keep, contact points with their impulses, constraints. All of it
// decides over the order in which contacts are found and solved, and so over the bits.

#include "simulate/bullet/bullet_state.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "simulate/bullet/bullet_engine.h"
#include "simulate/bullet/bullet_nail.h"

namespace pilesim {

using namespace bullet_state;

namespace {

void require_finite(std::span<const double> values) {
  StateReader::require(std::ranges::all_of(values, [](double v) { return std::isfinite(v); }),
                       "numbers that are finite");
}
void require_finite(const btTransform& pose) {
  for (int row = 0; row < 3; ++row) require_finite({pose.getBasis()[row].m_floats, 3});
  require_finite({pose.getOrigin().m_floats, 3});
}

void dynamic_fields(auto& dynamic, auto& stream) {
  vector_fields(dynamic.rest_place, stream);
  stream(dynamic.supported, dynamic.sunk, dynamic.sticks, dynamic.loads);
}

void point_fields(auto& p, auto& stream) {
  for (auto* v : {&p.m_localPointA, &p.m_localPointB, &p.m_positionWorldOnB, &p.m_positionWorldOnA,
                  &p.m_normalWorldOnB, &p.m_lateralFrictionDir1, &p.m_lateralFrictionDir2}) {
    vector_fields(*v, stream);
  }
  stream(p.m_distance1, p.m_combinedFriction, p.m_combinedRollingFriction,
         p.m_combinedSpinningFriction, p.m_combinedRestitution, p.m_partId0, p.m_partId1,
         p.m_index0, p.m_index1, p.m_contactPointFlags, p.m_appliedImpulse, p.m_prevRHS,
         p.m_appliedImpulseLateral1, p.m_appliedImpulseLateral2, p.m_contactMotion1,
         p.m_contactMotion2, p.m_contactCFM, p.m_contactERP, p.m_frictionCFM, p.m_lifeTime);
}

uint32_t index_of(const btBroadphaseProxy& proxy) {
  const auto* object = static_cast<const btCollisionObject*>(proxy.m_clientObject);
  return static_cast<uint32_t>(object->getUserIndex());
}

// In pre-order: the body of a leaf, or none, and the boxes of all nodes.
struct Tree {
  static constexpr uint32_t kInner = ~0U;
  std::vector<uint32_t> leaf;
  std::vector<std::array<double, 6>> box;

  static void fields(auto& self, auto& stream) { stream(self.leaf, self.box); }
};

Tree read_tree(const btDbvtNode* root) {
  Tree tree;
  std::vector<const btDbvtNode*> left;
  if (root != nullptr) left.push_back(root);
  while (!left.empty()) {
    const btDbvtNode& node = *left.back();
    left.pop_back();
    const btVector3 &low = node.volume.Mins(), &high = node.volume.Maxs();
    tree.box.push_back({low.x(), low.y(), low.z(), high.x(), high.y(), high.z()});
    if (node.isleaf()) {
      tree.leaf.push_back(index_of(*static_cast<const btBroadphaseProxy*>(node.data)));
      continue;
    }
    tree.leaf.push_back(Tree::kInner);
    left.push_back(node.childs[1]);
    left.push_back(node.childs[0]);
  }
  return tree;
}

// Pre-order of a binary tree with a leaf for each of `bodies`.
void require_tree(const Tree& tree, std::vector<uint32_t> bodies) {
  std::vector<uint32_t> leaves;
  size_t open = bodies.empty() ? 0 : 1;  // branches that are yet to come
  StateReader::require(tree.box.size() == tree.leaf.size(), "a box for each node");
  for (const uint32_t leaf : tree.leaf) {
    StateReader::require(open > 0, "a tree with one root");
    if (leaf == Tree::kInner) {
      ++open;
    } else {
      --open;
      leaves.push_back(leaf);
    }
  }
  std::ranges::sort(leaves);
  std::ranges::sort(bodies);
  StateReader::require(open == 0 && leaves == bodies, "a tree of all bodies");
  for (const std::array<double, 6>& box : tree.box) require_finite(box);
}

// Of the nodes that are there: `tree` is one of all their leaves, which `leaf_of` gives.
template <class LeafOf>
void shape_tree(const Tree& tree, btDbvt& into, const LeafOf& leaf_of) {
  std::vector<btDbvtNode*> inner, left;
  if (into.m_root != nullptr) left.push_back(into.m_root);
  while (!left.empty()) {
    btDbvtNode* node = left.back();
    left.pop_back();
    if (node->isleaf()) continue;
    inner.push_back(node);
    left.push_back(node->childs[0]);
    left.push_back(node->childs[1]);
  }
  struct Place {
    btDbvtNode* parent;
    int child;
  };
  std::vector<Place> places = {{nullptr, 0}};
  for (size_t i = 0; i < tree.leaf.size(); ++i) {
    const Place place = places.back();
    places.pop_back();
    btDbvtNode* node = nullptr;
    if (tree.leaf[i] == Tree::kInner) {
      node = inner.back();
      inner.pop_back();
      places.push_back({node, 1});
      places.push_back({node, 0});
    } else {
      node = leaf_of(tree.leaf[i]);
    }
    const std::array<double, 6>& b = tree.box[i];
    node->volume = btDbvtVolume::FromMM(btVector3(b[0], b[1], b[2]), btVector3(b[3], b[4], b[5]));
    node->parent = place.parent;
    (place.parent == nullptr ? into.m_root : place.parent->childs[place.child]) = node;
  }
}

// Bullet's own algorithm for shapes of several pieces, whose children come and go.
struct OpenCompound : btCompoundCollisionAlgorithm {
  static btAlignedObjectArray<btCollisionAlgorithm*>& children(btCompoundCollisionAlgorithm& of) {
    return of.*(&OpenCompound::m_childCollisionAlgorithms);
  }
};

std::vector<uint32_t> places_of_manifolds(btCollisionAlgorithm& algorithm) {
  btManifoldArray manifolds;
  algorithm.getAllContactManifolds(manifolds);
  std::vector<uint32_t> places;
  for (int i = 0; i < manifolds.size(); ++i) places.push_back(place_of(manifolds[i]));
  return places;
}

enum class AlgorithmKind : uint8_t { none, pieces, plane, compound, stock };

AlgorithmKind kind_of(btCollisionAlgorithm* algorithm) {
  if (algorithm == nullptr) return AlgorithmKind::none;
  if (dynamic_cast<PieceCollisionAlgorithm*>(algorithm) != nullptr) return AlgorithmKind::pieces;
  if (dynamic_cast<PlaneCollisionAlgorithm*>(algorithm) != nullptr) return AlgorithmKind::plane;
  if (dynamic_cast<btCompoundCollisionAlgorithm*>(algorithm) != nullptr) {
    return AlgorithmKind::compound;
  }
  return AlgorithmKind::stock;
}

void save_algorithm(btCollisionAlgorithm* algorithm, StateWriter& writer) {
  const AlgorithmKind kind = kind_of(algorithm);
  writer(kind);
  switch (kind) {
    case AlgorithmKind::none:
      return;
    case AlgorithmKind::pieces:
      return static_cast<PieceCollisionAlgorithm*>(algorithm)->save(writer);
    case AlgorithmKind::plane:
      return static_cast<PlaneCollisionAlgorithm*>(algorithm)->save(writer);
    case AlgorithmKind::compound: {
      auto& children =
          OpenCompound::children(*static_cast<btCompoundCollisionAlgorithm*>(algorithm));
      writer(children.size());
      for (int i = 0; i < children.size(); ++i) {
        writer(children[i] != nullptr);
        if (children[i] != nullptr) writer(places_of_manifolds(*children[i]));
      }
      return;
    }
    case AlgorithmKind::stock:
      return writer(places_of_manifolds(*algorithm));
  }
}

// Makes algorithms anew for pairs that had one.
class AlgorithmLoader {
 public:
  AlgorithmLoader(btCollisionDispatcher& dispatcher, const btDispatcherInfo& info,
                  ManifoldPlaces& places)
      : dispatcher_(dispatcher), info_(info), places_(places) {}

  void load(btBroadphasePair& pair, StateReader& reader) {
    const auto& a = *static_cast<const btCollisionObject*>(pair.m_pProxy0->m_clientObject);
    const auto& b = *static_cast<const btCollisionObject*>(pair.m_pProxy1->m_clientObject);
    auto kind = AlgorithmKind::none;
    reader(kind);
    StateReader::require(kind <= AlgorithmKind::stock, "an algorithm");
    if (kind == AlgorithmKind::none) return;
    const btCollisionObjectWrapper in_a(nullptr, a.getCollisionShape(), &a, a.getWorldTransform(),
                                        -1, -1);
    const btCollisionObjectWrapper in_b(nullptr, b.getCollisionShape(), &b, b.getWorldTransform(),
                                        -1, -1);
    btCollisionAlgorithm* made =
        dispatcher_.findAlgorithm(&in_a, &in_b, nullptr, BT_CONTACT_POINT_ALGORITHMS);
    pair.m_algorithm = made;
    StateReader::require(kind_of(made) == kind, "the algorithm of these shapes");
    switch (kind) {
      case AlgorithmKind::none:
        break;
      case AlgorithmKind::pieces:
        static_cast<PieceCollisionAlgorithm*>(made)->load(reader, places_);
        break;
      case AlgorithmKind::plane:
        static_cast<PlaneCollisionAlgorithm*>(made)->load(reader, places_);
        break;
      case AlgorithmKind::compound:
        load_children(*static_cast<btCompoundCollisionAlgorithm*>(made), in_a, in_b, reader);
        break;
      case AlgorithmKind::stock:
        load_stock(*made, in_a, in_b, reader);
        break;
    }
  }

 private:
  // Some make their manifold only when they run for the first time; what they find then is written
  // over.
  void load_stock(btCollisionAlgorithm& made, const btCollisionObjectWrapper& a,
                  const btCollisionObjectWrapper& b, StateReader& reader) {
    std::vector<uint32_t> places;
    reader(places);
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
                     const btCollisionObjectWrapper& b, StateReader& reader) {
    auto& children = OpenCompound::children(made);
    int count = 0;
    reader(count);
    StateReader::require(count == children.size(), "as many pieces as the shape has");
    const bool is_first = a.getCollisionShape()->isCompound();
    const btCollisionObjectWrapper &body = is_first ? a : b, &other = is_first ? b : a;
    const auto& shape = static_cast<const btCompoundShape&>(*body.getCollisionShape());
    for (int i = 0; i < count; ++i) {
      bool has = false;
      reader(has);
      if (!has) continue;
      const btTransform pose = body.getWorldTransform() * shape.getChildTransform(i);
      const btCollisionObjectWrapper child(&body, shape.getChildShape(i), body.getCollisionObject(),
                                           pose, -1, i);
      children[i] = dispatcher_.findAlgorithm(&child, &other, nullptr, BT_CONTACT_POINT_ALGORITHMS);
      load_stock(*children[i], child, other, reader);
    }
  }

  btCollisionDispatcher& dispatcher_;
  const btDispatcherInfo& info_;
  ManifoldPlaces& places_;
};

void save_manifold(const btPersistentManifold& manifold, StateWriter& writer) {
  writer(manifold.getNumContacts());
  for (int i = 0; i < manifold.getNumContacts(); ++i) {
    point_fields(manifold.getContactPoint(i), writer);
  }
}

void load_manifold(btPersistentManifold& manifold, StateReader& reader) {
  int count = 0;
  reader(count);
  StateReader::require(count >= 0 && count <= MANIFOLD_CACHE_SIZE, "at most four contact points");
  manifold.clearManifold();
  for (int i = 0; i < count; ++i) {
    btManifoldPoint point;
    point_fields(point, reader);
    manifold.addManifoldPoint(point);
  }
}

}  // namespace

void PieceCollisionAlgorithm::save(StateWriter& writer) const {
  transform_fields(b_from_a_, writer);
  writer(list_slack_m_, uint64_t{pairs_.size()});
  for (const PiecePair& pair : pairs_) {
    writer(pair.a, pair.b, pair.slack_m, place_of(pair.manifold));
    vector_fields(pair.apart, writer);
  }
}

void PieceCollisionAlgorithm::load(StateReader& reader, ManifoldPlaces& places) {
  transform_fields(b_from_a_, reader);
  uint64_t count = 0;
  reader(list_slack_m_, count);
  StateReader::require(count <= a_.pieces.size() * b_.pieces.size(), "pairs of pieces");
  for (uint64_t i = 0; i < count; ++i) {
    PiecePair pair{0, 0, btVector3(0, 0, 0), 0, nullptr};
    uint32_t place = kNoManifold;
    reader(pair.a, pair.b, pair.slack_m, place);
    vector_fields(pair.apart, reader);
    StateReader::require(pair.a < a_.pieces.size() && pair.b < b_.pieces.size(),
                         "a pair of pieces");
    if (place != kNoManifold) {
      pair.manifold = m_dispatcher->getNewManifold(&body_a_, &body_b_);
      places.put(place, *pair.manifold);
    }
    pairs_.push_back(pair);
  }
}

void PlaneCollisionAlgorithm::save(StateWriter& writer) const { writer(place_of(manifold_)); }

void PlaneCollisionAlgorithm::load(StateReader& reader, ManifoldPlaces& places) {
  uint32_t place = kNoManifold;
  reader(place);
  if (place == kNoManifold) return;
  manifold_ = m_dispatcher->getNewManifold(&body_, &plane_);
  places.put(place, *manifold_);
}

void BulletEngine::save(StateWriter& writer) const {
  auto& self = const_cast<BulletEngine&>(*this);  // Bullet's getters are not const
  const btCollisionObjectArray& objects = world_.getCollisionObjectArray();
  writer(uint64_t{static_cast<size_t>(objects.size())});
  for (int i = 0; i < objects.size(); ++i) {
    BodyNumbers numbers;
    numbers.index = static_cast<uint32_t>(objects[i]->getUserIndex());
    const Record& record = records_[numbers.index];
    const btRigidBody& body = *record.body;
    numbers.held =
        model_.bodies[numbers.index].role == Role::dynamic && body.getUserPointer() == nullptr;
    numbers.moved = record.moved;
    numbers.put_to_sleep = record.put_to_sleep;
    numbers.pose = body.getWorldTransform();
    numbers.inverse_inertia = body.getInvInertiaTensorWorld();
    numbers.velocity = body.getLinearVelocity();
    numbers.spin = body.getAngularVelocity();
    numbers.box_low = body.getBroadphaseProxy()->m_aabbMin;
    numbers.box_high = body.getBroadphaseProxy()->m_aabbMax;
    numbers.proxy_id = body.getBroadphaseProxy()->m_uniqueId;
    numbers.friction = body.getFriction();
    numbers.slow_s = body.getDeactivationTime();
    numbers.activation = body.getActivationState();
    writer(numbers);
    dynamic_fields(dynamic_[numbers.index], writer);
    if (record.hinge) {
      auto& hinge = static_cast<btHingeConstraint&>(*record.hinge);
      transform_fields(hinge.getAFrame(), writer);
      transform_fields(hinge.getBFrame(), writer);
    }
  }
  writer(world_.order_of_movable(), broad_phase_.m_gid, broad_phase_.parted(),
         read_tree(broad_phase_.m_sets[btDbvtBroadphase::DYNAMIC_SET].m_root));

  writer(uint64_t{constraints_.size()});
  for (const auto& [id, tie] : constraints_) {
    auto& slider = static_cast<btSliderConstraint&>(*tie.constraint);
    writer(id, tie.a, tie.b, slider.getBreakingImpulseThreshold(), slider.isEnabled());
    transform_fields(slider.getFrameOffsetA(), writer);
    transform_fields(slider.getFrameOffsetB(), writer);
  }
  writer(next_constraint_, friction_changed_, constraint_order());

  const int manifolds = dispatcher_.getNumManifolds();
  writer(manifolds);
  btBroadphasePairArray& pairs = self.broad_phase_.m_paircache->getOverlappingPairArray();
  writer(uint64_t{static_cast<size_t>(pairs.size())});
  for (int i = 0; i < pairs.size(); ++i) {
    writer(index_of(*pairs[i].m_pProxy0), index_of(*pairs[i].m_pProxy1));
    save_algorithm(pairs[i].m_algorithm, writer);
  }
  for (int i = 0; i < manifolds; ++i) {
    save_manifold(*self.dispatcher_.getManifoldByIndexInternal(i), writer);
  }
}

// Hinges as their bodies, nails as their numbers above those.
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

namespace {

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
  clear();
  const FilterAside aside(dispatcher_.filter);
  const std::vector<BodyNumbers> bodies = load_bodies(reader);
  load_broad_phase(reader, bodies);
  load_constraints(reader);
  load_pairs(reader);
  // Last, since sleepers would get no algorithms.
  for (const BodyNumbers& numbers : bodies) {
    Record& record = records_[numbers.index];
    btRigidBody& body = *record.body;
    record.moved = numbers.moved;
    if (numbers.put_to_sleep) put_to_sleep(numbers.index);
    body.setLinearVelocity(numbers.velocity);
    body.setAngularVelocity(numbers.spin);
    body.setFriction(numbers.friction);
    body.forceActivationState(numbers.activation);
    body.setDeactivationTime(numbers.slow_s);
    const_cast<btMatrix3x3&>(body.getInvInertiaTensorWorld()) = numbers.inverse_inertia;
  }
}

std::vector<BodyNumbers> BulletEngine::load_bodies(StateReader& reader) {
  uint64_t count = 0;
  reader(count);
  StateReader::require(count <= records_.size(), "bodies of the scene");
  std::vector<BodyNumbers> bodies(count);
  for (BodyNumbers& numbers : bodies) {
    reader(numbers);
    StateReader::require(numbers.index < records_.size() && !contains(numbers.index),
                         "each body once");
    const ModelBody& source = model_.bodies[numbers.index];
    const bool moves = source.role == Role::dynamic && !numbers.held;
    StateReader::require(
        (source.role == Role::dynamic || !numbers.held) && (moves || !numbers.put_to_sleep),
        "only what is dynamic held or asleep");
    StateReader::require(
        numbers.activation >= ACTIVE_TAG && numbers.activation <= DISABLE_SIMULATION,
        "a state of activation");
    require_finite(numbers.pose);
    for (const btVector3* v :
         {&numbers.velocity, &numbers.spin, &numbers.box_low, &numbers.box_high}) {
      require_finite({v->m_floats, 3});
    }
    const Quat& body_from_bullet = shapes_[source.shape].body_from_bullet();
    const BodyMotion start{
        .position = from_bullet(numbers.pose.getOrigin()),
        .orientation = from_bullet(numbers.pose.getRotation()) * body_from_bullet.conjugate()};
    add(numbers.index, start, numbers.held, false);
    Record& record = records_[numbers.index];
    record.body->setWorldTransform(numbers.pose);
    dynamic_fields(dynamic_[numbers.index], reader);
    if (!record.hinge) continue;
    auto& hinge = static_cast<btHingeConstraint&>(*record.hinge);
    for (btTransform* frame : {&hinge.getAFrame(), &hinge.getBFrame()}) {
      transform_fields(*frame, reader);
      require_finite(*frame);
    }
  }
  return bodies;
}

void BulletEngine::load_broad_phase(StateReader& reader, std::span<const BodyNumbers> bodies) {
  std::vector<uint32_t> movable;
  Tree tree;
  bool parted = false;
  reader(movable, broad_phase_.m_gid, parted, tree);
  broad_phase_.set_parted(parted);
  std::vector<uint32_t> all, ids, may_move = world_.order_of_movable();
  for (const BodyNumbers& numbers : bodies) {
    all.push_back(numbers.index);
    ids.push_back(static_cast<uint32_t>(numbers.proxy_id));
  }
  std::ranges::sort(ids);
  StateReader::require(std::ranges::adjacent_find(ids) == ids.end(), "a number for each box");
  require_tree(tree, all);
  std::vector<uint32_t> ordered = movable;
  std::ranges::sort(ordered);
  std::ranges::sort(may_move);
  StateReader::require(ordered == may_move, "an order of all bodies that can move");

  broad_phase_.remove_all_pairs(dispatcher_);
  for (const BodyNumbers& numbers : bodies) {
    btBroadphaseProxy& proxy = *records_[numbers.index].body->getBroadphaseProxy();
    proxy.m_uniqueId = numbers.proxy_id;
    proxy.m_aabbMin = numbers.box_low;
    proxy.m_aabbMax = numbers.box_high;
  }
  shape_tree(tree, broad_phase_.m_sets[btDbvtBroadphase::DYNAMIC_SET], [&](uint32_t body) {
    return static_cast<btDbvtProxy*>(records_[body].body->getBroadphaseProxy())->leaf;
  });
  std::vector<btRigidBody*> order;
  for (const uint32_t body : movable) order.push_back(records_[body].body.get());
  world_.set_order_of_movable(order);
}

void BulletEngine::load_constraints(StateReader& reader) {
  uint64_t count = 0;
  reader(count);
  for (; count > 0; --count) {
    ConstraintId id = 0;
    Nail nail;
    bool enabled = false;
    reader(id, nail.a, nail.b, nail.breaking_impulse_ns, enabled);
    for (const uint32_t body : {nail.a, nail.b}) {
      StateReader::require(body < records_.size() && contains(body), "nails of bodies");
    }
    StateReader::require(nail.a != nail.b && !constraints_.contains(id), "each nail once");
    nail.point = Vec3::Zero();
    nail.axis = Vec3::UnitX();
    auto constraint = make_nail(nail, *records_[nail.a].body, *records_[nail.b].body);
    auto& slider = static_cast<btSliderConstraint&>(*constraint);
    for (btTransform* frame : {&slider.getFrameOffsetA(), &slider.getFrameOffsetB()}) {
      transform_fields(*frame, reader);
      require_finite(*frame);
    }
    slider.setEnabled(enabled);
    world_.addConstraint(&slider);
    constraints_[id] = {std::move(constraint), nail.a, nail.b};
  }
  std::vector<uint64_t> order;
  reader(next_constraint_, friction_changed_, order);
  StateReader::require(constraints_.empty() || constraints_.rbegin()->first < next_constraint_,
                       "numbers of nails that are taken");
  std::vector<uint64_t> wanted = order, there = constraint_order();
  std::ranges::sort(wanted);
  std::ranges::sort(there);
  StateReader::require(wanted == there, "an order of all constraints");
  std::vector<btTypedConstraint*> constraints;
  for (const uint64_t number : order) {
    const bool is_hinge = number < records_.size();
    constraints.push_back(is_hinge
                              ? records_[number].hinge.get()
                              : constraints_.at(static_cast<ConstraintId>(number - records_.size()))
                                    .constraint.get());
  }
  world_.set_order_of_constraints(constraints);
}

void BulletEngine::load_pairs(StateReader& reader) {
  int count = 0;
  uint64_t pair_count = 0;
  reader(count, pair_count);
  StateReader::require(count >= 0 && static_cast<size_t>(count) <= reader.left(),
                       "as many contact manifolds as there are bytes for");
  ManifoldPlaces places(static_cast<size_t>(count));
  AlgorithmLoader algorithms(dispatcher_, world_.getDispatchInfo(), places);
  for (; pair_count > 0; --pair_count) {
    uint32_t a = 0, b = 0;
    reader(a, b);
    for (const uint32_t body : {a, b}) {
      StateReader::require(body < records_.size() && contains(body), "pairs of bodies");
    }
    StateReader::require(a != b, "pairs of two bodies");
    btBroadphasePair* pair = broad_phase_.m_paircache->addOverlappingPair(
        records_[a].body->getBroadphaseProxy(), records_[b].body->getBroadphaseProxy());
    StateReader::require(pair != nullptr && pair->m_algorithm == nullptr, "each pair once");
    algorithms.load(*pair, reader);
  }
  StateReader::require(dispatcher_.getNumManifolds() == count &&
                           std::ranges::find(places.all(), nullptr) == places.all().end(),
                       "a pair for each contact manifold");
  dispatcher_.set_order_of_manifolds(places.all());
  for (btPersistentManifold* manifold : places.all()) load_manifold(*manifold, reader);
}

}  // namespace pilesim
