// The part of the contact solver that holds joints.
#include <algorithm>
#include <cmath>

#include "simulate/exact/contact_solver.h"
#include "simulate/exact/exact_constants.h"

namespace pilesim::exact {

using namespace exact_constants;

namespace {

Mat3 cross_matrix(const Vec3& v) {
  Mat3 m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

// By how much it changes from `now` when it is to change by `more` and may be `most` long.
Vec3 change_within(const Vec3& now, const Vec3& more, double most) {
  const Vec3 then = now + more;
  const double size = then.norm();
  return size > most ? Vec3(most / size * then - now) : more;
}

// 1 / kg m^2, world. A body that has hardly turned keeps that of the step's begin.
Mat3 inertia_as_turned(const SolverBody& body, const Quat& turn) {
  if (4 * turn.vec().squaredNorm() < kLeastTurn * kLeastTurn) return body.inverse_inertia;
  const Mat3 turned = turn.toRotationMatrix();
  return turned * body.inverse_inertia * turned.transpose();
}

}  // namespace

// Forces act at the middle between the two points: at two places that are apart a force and its
// answer would turn the bodies.
void ContactSolver::place(SolverJoint& joint, const std::vector<SolverBody>& bodies) const {
  const SolverBody &a = bodies[joint.a], &b = bodies[joint.b];
  const Quat turn_a = turn_of(joint.a), turn_b = turn_of(joint.b);
  const Vec3 arm_a = turn_a * joint.arm_a, arm_b = turn_b * joint.arm_b;
  joint.gap = joint.apart + displacement_of(joint.b) - displacement_of(joint.a) +
              (arm_b - joint.arm_b) - (arm_a - joint.arm_a);
  joint.from_a = arm_a + joint.gap / 2;
  joint.from_b = arm_b - joint.gap / 2;
  joint.inertia_a = inertia_as_turned(a, turn_a);
  joint.inertia_b = inertia_as_turned(b, turn_b);
  const Mat3 by_torque = joint.inertia_a + joint.inertia_b;
  const Quat bent = turn_b * joint.bent * turn_a.conjugate();
  if (joint.holds == Holds::all) {
    joint.angle = std::copysign(2.0, bent.w()) * bent.vec();
    joint.moment = by_torque.inverse();
  } else if (joint.holds == Holds::axis) {  // about the axis they are free, across it not
    const Vec3 axis_a = turn_a * joint.axis_a, axis_b = turn_b * joint.axis_b;
    const Vec3 u = axis_a.unitOrthogonal();
    Eigen::Matrix<double, 3, 2> across;
    across << u, axis_a.cross(u);
    const Eigen::Matrix2d by_torque_across = across.transpose() * by_torque * across;
    joint.angle = axis_a.cross(axis_b);
    joint.moment = across * by_torque_across.inverse() * across.transpose();
    joint.axis = axis_a;
    // A stop may stand at half a turn: the turn nearest to the one before is the right one.
    const double turn = 2 * std::atan2(bent.vec().dot(axis_a), bent.w());
    joint.turn += std::remainder(turn - joint.turn, 2 * kPi);
  }
  const Mat3 ca = cross_matrix(joint.from_a), cb = cross_matrix(joint.from_b);
  const Mat3 by_force = (a.inverse_mass + b.inverse_mass) * Mat3::Identity() -
                        ca * joint.inertia_a * ca - cb * joint.inertia_b * cb;
  joint.mass = by_force.inverse();
}

// To b, and against it to a: N s and N m s.
void ContactSolver::give(SolverJoint& joint, const Vec3& push, const Vec3& twist) {
  const auto change = [&](uint32_t body, double side, const Mat3& inertia, const Vec3& arm,
                          SolverJoint::Given& given) {
    if (body >= moving_) return;
    const Vec3 linear = side * static_cast<double>(inverse_[body].v[6]) * push;
    const Vec3 angular = side * (inertia * (arm.cross(push) + twist));
    add_velocity(body, linear, angular);
    given.linear += linear;
    given.angular += angular;
  };
  change(joint.a, -1, joint.inertia_a, joint.from_a, joint.given_a);
  change(joint.b, 1, joint.inertia_b, joint.from_b, joint.given_b);
}

// Starts a substep with the force of the substep before, as contacts do. The force acts where the
// bodies are now and has turned with them; a force that does not turn would drive them.
void ContactSolver::give_again(SolverJoint& joint, double substep_s, bool is_first) {
  if (!is_first) {
    const Vec3 angle = joint.b < moving_ ? Vec3(substep_s / 2 * (spin(joint.a) + spin(joint.b)))
                                         : Vec3(substep_s * spin(joint.a));
    const auto take_back = [&](uint32_t body, const SolverJoint::Given& given) {
      if (body < moving_) add_velocity(body, -given.linear, -given.angular);
    };
    take_back(joint.a, joint.given_a);
    take_back(joint.b, joint.given_b);
    joint.given_a = joint.given_b = {};
    if (!angle.isZero(0)) {
      const Quat turn(Eigen::AngleAxisd(angle.norm(), angle.normalized()));
      joint.force_n = turn * joint.force_n;
      joint.torque_nm = turn * joint.torque_nm;
    }
  }
  give(joint, substep_s * joint.force_n, substep_s * joint.torque_on_b_nm());
}

// N m s, on b about the axis of a hinge, where b turns at `spin` against a: by its motor, up to its
// torque, and by its limits, which only push back.
double ContactSolver::axial_change(SolverJoint& joint, double spin, const Softness& soft,
                                   double step_s) {
  const double moment = 1 / joint.axis.dot((joint.inertia_a + joint.inertia_b) * joint.axis);
  double all = 0;
  const auto add = [&](double& torque_nm, double change, double least, double most) {
    const double given = step_s * torque_nm, now = std::clamp(given + change, least, most);
    torque_nm = now / step_s;
    spin += (now - given) / moment;
    all += now - given;
  };
  if (joint.motor_most_nm > 0) {
    const double most = step_s * joint.motor_most_nm;
    add(joint.motor_nm, moment * (joint.motor_rad_s - spin), -most, most);
  }
  constexpr double kNone = std::numeric_limits<double>::infinity();
  const bool is_low = joint.turn - joint.least_turn < joint.most_turn - joint.turn;
  const double side = is_low ? 1 : -1;
  const double left = is_low ? joint.turn - joint.least_turn : joint.most_turn - joint.turn;
  if (left < kNone) {
    const bool is_beyond = left < 0;
    const double bias = is_beyond ? soft.rate * left : left / step_s;
    const double scale = is_beyond ? soft.mass_scale : 1;
    const double give = is_beyond ? soft.force_scale : 0;
    const double given = step_s * joint.limit_nm;
    const double change = -scale * moment * (spin + side * bias) - give * given;
    add(joint.limit_nm, change, is_low ? 0 : -kNone, is_low ? kNone : 0);
  }
  return all;
}

// One after the other. Glue gives no more than its strength.
void ContactSolver::hold(std::span<SolverJoint> joints, T h, bool soft) {
  const double step = static_cast<double>(h);
  const Softness s = soft ? softness(kJointRate / step, kContactDamping, step) : Softness{0, 1, 0};
  // The change of an impulse that the substep has given.
  const auto change = [&](const Mat3& inertia, const Vec3& rate, const Vec3& distance,
                          const Vec3& given) -> Vec3 {
    return -s.mass_scale * (inertia * (rate + s.rate * distance)) - s.force_scale * given;
  };
  for (SolverJoint& joint : joints) {
    const Vec3 velocity_a = velocity(joint.a), velocity_b = velocity(joint.b);
    Vec3 spin_a = spin(joint.a), spin_b = spin(joint.b);
    const Vec3 given_twist = step * joint.torque_nm, given_push = step * joint.force_n;
    Vec3 twist = Vec3::Zero();
    if (joint.holds != Holds::point) {
      twist = change_within(given_twist,
                            change(joint.moment, spin_b - spin_a, joint.angle, given_twist),
                            joint.strength_nm * step);
    }
    Vec3 axial = Vec3::Zero();
    if (joint.has_axial()) {
      axial = axial_change(joint, joint.axis.dot(spin_b - spin_a), s, step) * joint.axis;
      spin_a -= joint.inertia_a * axial;
      spin_b += joint.inertia_b * axial;
    }
    spin_a -= joint.inertia_a * twist;
    spin_b += joint.inertia_b * twist;
    const Vec3 parting =
        velocity_b + spin_b.cross(joint.from_b) - velocity_a - spin_a.cross(joint.from_a);
    Vec3 push = change(joint.mass, parting, joint.gap, given_push);
    push = change_within(given_push, push, joint.strength_n * step);
    joint.torque_nm += twist / step;
    joint.force_n += push / step;
    give(joint, push, twist + axial);
  }
}

}  // namespace pilesim::exact
