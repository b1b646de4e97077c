// Takes the noise out of a picture of few samples: an edge-avoiding à-trous filter (Dammertz et al.
// 2010) of the light without the surfaces' own colour, guided by normals, depth, albedo and bodies,
// and by how much the samples differ (Schied et al. 2017).
#pragma once

#include <vector>

#include "render/rays/film.h"

namespace pilesim {

// Linear, (height, width).
struct LightPlanes {
  std::vector<float> red, green, blue;
  std::vector<float> variance;  // of the luminance; of the result it says nothing
};

class Denoiser {
 public:
  // Radiance. The result stays valid until the next call. `film` has at least one sample.
  const LightPlanes& filter(const Film& film);

 private:
  void begin(const Film& film);
  void smooth_variance();
  void pass(const Film& film, int step);
  void finish(const Film& film);

  int width_ = 0, height_ = 0;
  LightPlanes light_, other_;    // without the surfaces' own colour: what a pass reads, and makes
  std::vector<float> variance_;  // of light_, smoothed
  std::vector<float> body_;
};

}  // namespace pilesim
