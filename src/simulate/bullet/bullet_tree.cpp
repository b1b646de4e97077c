#include "simulate/bullet/bullet_tree.h"

#include <algorithm>
#include <cmath>

namespace pilesim {

BulletTree read_tree(const btDbvt& from) {
  BulletTree tree;
  std::vector<const btDbvtNode*> left;
  if (from.m_root != nullptr) left.push_back(from.m_root);
  while (!left.empty()) {
    const btDbvtNode& node = *left.back();
    left.pop_back();
    const btVector3 &low = node.volume.Mins(), &high = node.volume.Maxs();
    tree.box.push_back({low.x(), low.y(), low.z(), high.x(), high.y(), high.z()});
    if (node.isleaf()) {
      tree.leaf.push_back(index_of(*static_cast<const btBroadphaseProxy*>(node.data)));
      continue;
    }
    tree.leaf.push_back(BulletTree::kInner);
    left.push_back(node.childs[1]);
    left.push_back(node.childs[0]);
  }
  return tree;
}

void require_tree(const BulletTree& tree, std::vector<uint32_t> bodies) {
  std::vector<uint32_t> leaves;
  size_t open = bodies.empty() ? 0 : 1;  // branches that are yet to come
  StateReader::require(tree.box.size() == tree.leaf.size(), "a box for each node");
  for (const uint32_t leaf : tree.leaf) {
    StateReader::require(open > 0, "a tree with one root");
    if (leaf == BulletTree::kInner) {
      ++open;
    } else {
      --open;
      leaves.push_back(leaf);
    }
  }
  std::ranges::sort(leaves);
  std::ranges::sort(bodies);
  StateReader::require(open == 0 && leaves == bodies, "a tree of all bodies");
  for (const std::array<double, 6>& box : tree.box) {
    StateReader::require(std::ranges::all_of(box, [](double v) { return std::isfinite(v); }),
                         "boxes that are finite");
  }
}

void shape_tree(const BulletTree& tree, btDbvt& into,
                const std::function<btDbvtNode*(uint32_t body)>& leaf_of) {
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
    if (tree.leaf[i] == BulletTree::kInner) {
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

}  // namespace pilesim
