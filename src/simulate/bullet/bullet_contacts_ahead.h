// Contacts of fast bodies with what they would pass through in the coming step.
#pragma once

#include <vector>

#include "simulate/bullet/bullet_facing_points.h"

namespace pilesim {

// A body that moves by a good part of its thickness in a step may skip the depth at which contacts
// are found. So before the solver runs, each pair of which one moves so fast against the other is
// looked at: where points of the smaller body would cross the plane through the closest point of
// the other's surface before the step ends, contacts that are still open keep them from doing so.
// The plane stands for the surface beyond its edges too: a fast body may be deflected by an edge
// that it would have passed at less than a step's way.
class ContactsAhead {
 public:
  explicit ContactsAhead(btDispatcher& dispatcher) : dispatcher_(dispatcher) {}
  ~ContactsAhead() { clear(); }
  ContactsAhead(const ContactsAhead&) = delete;
  ContactsAhead& operator=(const ContactsAhead&) = delete;

  // For pairs whose boxes meet somewhere on the coming step's way.
  void add(const btBroadphasePairArray& pairs, double step_s);
  void clear();

 private:
  class Pair;

  btDispatcher& dispatcher_;
  std::vector<btPersistentManifold*> manifolds_;
  std::vector<FacingPoint> points_;  // of the piece at hand
};

// The way that any point of the body can make in a step, by its velocities alone.
double farthest_way(const btRigidBody& body, double step_s);

}  // namespace pilesim
