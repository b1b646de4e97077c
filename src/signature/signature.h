// A signature: the measured behaviour of an object in collisions (dissertation, section 3.2).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "geometry/solid.h"
#include "signature/accuracy.h"
#include "signature/packing.h"
#include "signature/rest/known_rest_poses.h"
#include "signature/spline/bspline_fit.h"
#include "signature/table/collision_height.h"
#include "signature/table/response_table.h"
#include "signature/table/table_sampling.h"
#include "signature/trial/contact_sampler.h"

namespace pilesim {

// The object that was measured. All values are per unit of mass.
struct SignatureBody {
  std::string mesh;       // file name, without folders
  std::string mesh_hash;  // of the mesh at `scale`
  double scale = 1;       // metres per unit of the file
  SolidOptions solid;     // how the mesh became a solid
  uint32_t hull_vertices = 0;
  double volume_m3 = 0;
  Vec3 centre_of_mass = Vec3::Zero();      // m, the mesh's frame
  Vec3 inertia_m2 = Vec3::Zero();          // principal moments, ascending
  Quat principal_axes = Quat::Identity();  // principal axes to the mesh's
  double gyration_m = 0;                   // k
  double outer_radius_m = 0;
};

// The source of responses that were not sampled here.
struct CollisionSource {
  std::string file;  // name, without folders
  uint64_t count = 0;
};

struct Signature {
  SignatureBody body;
  ContactMaterial material;
  TrialKind kind = TrialKind::macro;
  uint64_t seed = 1;
  TableSampling sampling;
  std::optional<CollisionSource> collisions;  // if set, `sampling` only gives the exemplars
  CollisionHeightTable heights;  // if fitted: values of the fit, without trials and errors
  // With `fit`: only layout, axes and most_growth, no cells. ResponseModel takes either.
  ResponseTable responses;
  std::optional<ResponseFit> fit;
  SplineField height_fit;  // with `fit`: over (spin, tilt), mean and deviation, m
  std::vector<KnownRestPose> rest_poses;
  uint32_t rest_drops = 0;  // simulated drops that came to rest; 0: poses are by geometry only
  std::optional<Packing> packing;
  std::optional<AccuracyReport> accuracy;
};

}  // namespace pilesim
