// How well a signature stands for the body: sampled responses are compared with new true responses,
// at collisions that were not part of the measurement.
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
  double distance = 0;  // mean over the collisions
  double worst = 0;     // largest over the collisions
  // Shares of samples that broke a physical limit before limit_response() moved them onto it.
  double energy_gain = 0;
  double inward = 0;
};

struct AccuracyReport {
  uint32_t collisions = 0;  // number compared
  uint32_t trials = 0;      // mean number of responses per collision
  double noise_floor = 0;   // distance between two sets of true responses
  // Share of true responses whose v^2 + k^2 w^2 grew; it can grow while the energy falls, because k
  // stands for all axes.
  double true_energy_gain = 0;
  // Share of the variance of the mean height between collisions that the table leaves unexplained.
  double height_unexplained = 0;
  std::vector<ModelAccuracy> models;
};

struct AccuracySettings {
  uint32_t collisions = 64;
  uint32_t trials = 512;
  uint32_t slices = 24;
};

// Responses sampled with one model, and the model's name.
struct ModelUnderTest {
  std::string name;
  ResponseModel responses;
  DrawModel model;
};

// Velocities follow a stream from all directions that reaches a plane (cosine law). Spins point in
// all directions, and alpha is uniform up to the tables' last node, all at contact.
AccuracyReport measure_accuracy(const TrialSetup& setup, const CollisionHeightTable& heights,
                                const std::vector<ModelUnderTest>& models,
                                const AccuracySettings& settings);

// Square root of the mean squared Wasserstein-2 distance of the projections onto `slices`
// directions. `a` and `b` may have any sizes > 0.
double sliced_wasserstein(const std::vector<Vector6>& a, const std::vector<Vector6>& b,
                          uint32_t slices);

}  // namespace pilesim
