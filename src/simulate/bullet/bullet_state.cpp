// Saving and loading of a Bullet world.

#include "core/error.h"
#include "simulate/bullet/bullet_engine.h"

namespace pilesim {
namespace {

[[noreturn]] void refuse() {
  Problem problem;
  problem.found = "Bullet's state cannot be saved yet";
  throw Error(ErrorKind::usage, problem);
}

}  // namespace

void BulletEngine::save(StateWriter& /*writer*/) const { refuse(); }

void BulletEngine::load(StateReader& /*reader*/) { refuse(); }

}  // namespace pilesim
