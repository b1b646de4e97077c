#include "simulate/mixed/cost_model.h"

#include "simulate/mixed/mixed_constants.h"

namespace pilesim {

using namespace mixed_constants;

StepWork& StepWork::operator+=(const StepWork& more) {
  spheres += more.spheres;
  sphere_contacts += more.sphere_contacts;
  blocks += more.blocks;
  pieces += more.pieces;
  solved += more.solved;
  solved_pieces += more.solved_pieces;
  return *this;
}

StepWork operator*(double times, const StepWork& work) {
  return {times * work.spheres, times * work.sphere_contacts, times * work.blocks,
          times * work.pieces,  times * work.solved,          times * work.solved_pieces};
}

StepWork usual_work(const ModelShape& shape, bool near, PairMethod method, double sphere_contacts) {
  StepWork work;
  work.spheres = 1;
  if (near) work.pieces = static_cast<double>(shape.pieces.size());
  if (near && method == PairMethod::impulse) {
    work.solved = 1;
    work.solved_pieces = work.pieces;
  } else {
    work.sphere_contacts = sphere_contacts;
  }
  return work;
}

double cost_us(const StepWork& work) {
  return kSphereUs * work.spheres + kSphereContactUs * work.sphere_contacts +
         kBlockUs * work.blocks + kPieceUs * work.pieces + kSolvedUs * work.solved +
         kSolvedPieceUs * work.solved_pieces;
}

}  // namespace pilesim
