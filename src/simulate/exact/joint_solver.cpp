// The part of the contact solver that holds joints.
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

// 1 / kg m^2, world. Of what has hardly turned, as the step began.
Mat3 inertia_as_turned(const SolverBody& body, const Quat& turn) {
  if (4 * turn.vec().squaredNorm() < kLeastTurn * kLeastTurn) return body.inverse_inertia;
  const Mat3 turned = turn.toRotationMatrix();
  return turned * body.inverse_inertia * turned.transpose();
}

}  // namespace

// The middle between the points that it joins, where they are now, from the centres of both. What
// it gives them it gives there: at two places that are apart a force and its answer would turn
// them.
typename ContactSolver::Middle ContactSolver::middle_of(const SolverJoint& joint) const {
  const Vec3 arm_a = turn_of(joint.a) * joint.arm_a, arm_b = turn_of(joint.b) * joint.arm_b;
  const Vec3 apart = joint.apart + way_of(joint.b) - way_of(joint.a) + (arm_b - joint.arm_b) -
                     (arm_a - joint.arm_a);
  return {arm_a + apart / 2, arm_b - apart / 2, apart};
}

// To b, and against it to a: N s and N m s, where they are now.
void ContactSolver::give(SolverJoint& joint, const std::vector<SolverBody>& bodies,
                         const Vec3& push, const Vec3& twist) {
  const auto change = [&](uint32_t body, double side, const Vec3& arm, SolverJoint::Given& given) {
    if (body >= moving_) return;
    const Vec3 linear = side * bodies[body].inverse_mass * push;
    const Vec3 angular =
        side * (inertia_as_turned(bodies[body], turn_of(body)) * (arm.cross(push) + twist));
    add_velocity(body, linear, angular);
    given.linear += linear;
    given.angular += angular;
  };
  const Middle middle = middle_of(joint);
  change(joint.a, -1, middle.from_a, joint.given_a);
  change(joint.b, 1, middle.from_b, joint.given_b);
}

// What the step before gave in a substep.
void ContactSolver::apply_forces(SolverJoint& joint, const std::vector<SolverBody>& bodies,
                                 double substep_s) {
  give(joint, bodies, substep_s * joint.force_n, substep_s * joint.torque_nm);
}

// What a substep gave is given in the next, too, as contacts' forces are: to where the two are now,
// and turned as they turn. As it was it would drive them. Glue's is turned ahead, up to as they
// would turn without it: found once in a substep its force comes late, and what is late feeds the
// swings of what hangs by much glue.
void ContactSolver::turn_forces(SolverJoint& joint, const std::vector<SolverBody>& bodies,
                                double step) {
  const auto turned = [&] {
    return joint.b < moving_ ? Vec3(step / 2 * (spin(joint.a) + spin(joint.b)))
                             : Vec3(step * spin(joint.a));
  };
  const Vec3 as_they_turn = turned();
  const auto take_back = [&](uint32_t body, const SolverJoint::Given& given) {
    if (body < moving_) add_velocity(body, -given.linear, -given.angular);
  };
  take_back(joint.a, joint.given_a);
  take_back(joint.b, joint.given_b);
  joint.given_a = joint.given_b = {};
  Vec3 angle = as_they_turn;
  if (joint.is_glue) angle += change_within(Vec3::Zero(), turned() - as_they_turn, kMostLead);
  if (!angle.isZero(0)) {
    const Quat turn(Eigen::AngleAxisd(angle.norm(), angle.normalized()));
    joint.force_n = turn * joint.force_n;
    joint.torque_nm = turn * joint.torque_nm;
  }
  apply_forces(joint, bodies, step);
}

// As a nail that lets nothing turn, with no more than its strength.
void ContactSolver::hold_glue(SolverJoint& joint, const std::vector<SolverBody>& bodies,
                              double step, const Softness& s) {
  const SolverBody &a = bodies[joint.a], &b = bodies[joint.b];
  const Quat turn_a = turn_of(joint.a), turn_b = turn_of(joint.b);
  const Mat3 inertia_a = inertia_as_turned(a, turn_a), inertia_b = inertia_as_turned(b, turn_b);
  const Quat bent = turn_b * joint.bent * turn_a.conjugate();
  const Vec3 angle = std::copysign(2.0, bent.w()) * bent.vec();
  const Mat3 answer = inertia_a + inertia_b;
  const Vec3 rate = spin(joint.b) - spin(joint.a);
  const Vec3 old_twist = joint.torque_nm * step;
  const Vec3 twist = change_within(
      old_twist,
      -s.mass_scale * (answer.inverse() * (rate + s.rate * angle)) - s.force_scale * old_twist,
      joint.strength_nm * step);
  joint.torque_nm += twist / step;
  give(joint, bodies, Vec3::Zero(), twist);

  const auto& [arm_a, arm_b, apart] = middle_of(joint);
  const Mat3 ca = cross_matrix(arm_a), cb = cross_matrix(arm_b);
  const Mat3 k3 = (a.inverse_mass + b.inverse_mass) * Mat3::Identity() - ca * inertia_a * ca -
                  cb * inertia_b * cb;
  const Vec3 parting = velocity(joint.b) + spin(joint.b).cross(arm_b) - velocity(joint.a) -
                       spin(joint.a).cross(arm_a);
  const Vec3 old_push = joint.force_n * step;
  const Vec3 push = change_within(
      old_push,
      -s.mass_scale * (k3.inverse() * (parting + s.rate * apart)) - s.force_scale * old_push,
      joint.strength_n * step);
  joint.force_n += push / step;
  give(joint, bodies, push, Vec3::Zero());
}

void ContactSolver::hold(SolverJoint& joint, const std::vector<SolverBody>& bodies, T h,
                         bool soft) {
  const double step = static_cast<double>(h);
  const double damping = joint.is_glue ? kGlueDamping : kJointDamping;
  const Softness s = soft ? softness(kJointRate / step, damping, step) : Softness{0, 1, 0};
  if (joint.is_glue) return hold_glue(joint, bodies, step, s);
  const Quat turn_a = turn_of(joint.a), turn_b = turn_of(joint.b);
  const SolverBody &a = bodies[joint.a], &b = bodies[joint.b];
  const Mat3 inertia_a = inertia_as_turned(a, turn_a), inertia_b = inertia_as_turned(b, turn_b);
  // About the axis they are free, across it not.
  const Vec3 axis_a = turn_a * joint.axis_a, axis_b = turn_b * joint.axis_b;
  const Vec3 u = axis_a.unitOrthogonal(), v = axis_a.cross(u);
  const Mat3 answer = inertia_a + inertia_b;
  Eigen::Matrix<double, 3, 2> across;
  across << u, v;
  const Eigen::Matrix2d k2 = across.transpose() * answer * across;
  const Vec3 bent = axis_a.cross(axis_b);  // b is turned by it against a
  const Eigen::Vector2d rate = across.transpose() * (spin(joint.b) - spin(joint.a));
  const Eigen::Vector2d old2 = across.transpose() * joint.torque_nm * step;
  const Eigen::Vector2d more2 =
      -s.mass_scale * (k2.inverse() * (rate + s.rate * (across.transpose() * bent))) -
      s.force_scale * old2;
  const Vec3 twist = across * more2;
  joint.torque_nm += twist / step;
  give(joint, bodies, Vec3::Zero(), twist);

  const auto& [arm_a, arm_b, apart] = middle_of(joint);
  const Mat3 ca = cross_matrix(arm_a), cb = cross_matrix(arm_b);
  const Mat3 k3 = (a.inverse_mass + b.inverse_mass) * Mat3::Identity() - ca * inertia_a * ca -
                  cb * inertia_b * cb;
  const Vec3 parting = velocity(joint.b) + spin(joint.b).cross(arm_b) - velocity(joint.a) -
                       spin(joint.a).cross(arm_a);
  const Vec3 push = -s.mass_scale * (k3.inverse() * (parting + s.rate * apart)) -
                    s.force_scale * (joint.force_n * step);
  joint.force_n += push / step;
  give(joint, bodies, push, Vec3::Zero());
}

}  // namespace pilesim::exact
