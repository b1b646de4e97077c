// How well a signature stands for the body: responses drawn from it against fresh true ones, at
// collisions that it was not measured at.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "signature/response_draw.h"
#include "signature/table/collision_height.h"
#include "signature/table/response_table.h"
#include "signature/trial/contact_sampler.h"

namespace pilesim {

// Distances are sliced Wasserstein-2 distances between sets of responses (v+, k w+), in units of
// sqrt(v^2 + k^2 w^2) before the collision, averaged over the collisions compared.
struct ModelAccuracy {
  std::string model;    // "particle", "dissertation", "diagonal", ...
  double distance = 0;  // mean over collisions
  double worst = 0;     // of any collision
  // Shares of draws that broke a physical limit before limit_response() moved them onto it.
  double energy_gain = 0;
  double inward = 0;
};

struct AccuracyReport {
  uint32_t collisions = 0;      // compared
  uint32_t trials = 0;          // responses a collision, in the mean
  double noise_floor = 0;       // the distance between two sets of true responses
  double true_energy_gain = 0;  // share of true responses whose v^2 + k^2 w^2 grew: it can while
                                // the energy falls, because k stands for all axes
  // Share of the variance of the mean height between collisions that the table does not explain.
  double height_unexplained = 0;
  std::vector<ModelAccuracy> models;
};

struct AccuracySettings {
  uint32_t collisions = 64;
  uint32_t trials = 512;
  uint32_t slices = 24;
};

// Responses under a name, drawn with one model.
struct ModelUnderTest {
  std::string name;
  ResponseModel responses;
  DrawModel model;
};

// The collisions: velocities as they reach a plane in a stream from all directions (cosine law),
// spins in all directions, alpha uniform up to the tables' last node; at contact.
AccuracyReport measure_accuracy(const TrialSetup& setup, const CollisionHeightTable& heights,
                                const std::vector<ModelUnderTest>& models,
                                const AccuracySettings& settings);

// Mean over `slices` directions of the squared Wasserstein-2 distance of the projections, rooted.
// `a` and `b` are sets of any sizes > 0.
double sliced_wasserstein(const std::vector<Vector6>& a, const std::vector<Vector6>& b,
                          uint32_t slices);

}  // namespace pilesim
