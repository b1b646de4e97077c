// Where kinematic bodies and nozzles are, by their motion keys and motors.
#pragma once

#include "model/model.h"

namespace pilesim {

// The pose of the moving object's own frame; `motion` is not empty. Positions go from key to key,
// and so do the angles where all keys have them as rotation_deg, so that they count turns; other
// orientations take the shortest way. Linear: at constant speed, orientations by slerp. Smooth: as
// cubics of continuous speed that pass no key's value before they reach it (Fritsch & Butland
// 1984), orientations as Bezier curves on the sphere (Shoemake 1985). Motors move it on from there:
// a spin by the integral of its rate, the others by sines, while they grow and shrink times 3 s^2 -
// 2 s^3.
Pose pose_at(const Motion& motion, double time_s);
// That of the body frame, whose origin is the centre of mass.
Pose pose_at(const ModelShape& shape, const Motion& motion, double time_s);

// Bounds the acceleration of the body's points by a motor while it runs, in its ramps, too; for
// several motors the sum is about right.
double most_acceleration_m_s2(const ModelShape& shape, const Motion& motion);

// The turn from one orientation to another as an axis times an angle, world frame.
Vec3 turn_between(const Quat& from, const Quat& to);

}  // namespace pilesim
