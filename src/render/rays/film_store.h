// Films on disk, a file a frame: work of few samples is gone on from when more are wanted, and so
// is work that was killed.
#pragma once

#include <filesystem>
#include <string>

#include "core/checkpoint_file.h"
#include "render/body_colours.h"
#include "render/frame_renderer.h"
#include "render/rays/film.h"

namespace pilesim {

struct FilmPlace {
  std::filesystem::path output;  // films are in films/ of it, which is there
  bool go_on = false;            // from those that are there
  double period_s = 5;           // wall time between films of a picture under way, at least
};

class FilmStore {
 public:
  // A store for the pictures of a trajectory, drawn so.
  FilmStore(FilmPlace place, const TrajectoryHeader& header, const RenderSettings& settings,
            BodyColours colours);

  // `film` has begun, and stays so where there is nothing to go on from. Throws Error(input) where
  // the file is damaged, is of another picture, or has more than `samples`.
  void load(const DrawnFrame& drawn, uint32_t samples, Film& film) const;
  // Throws Error(io); what was there before is there then.
  void save(const DrawnFrame& drawn, const Film& film) const;
  std::filesystem::path file_of(const DrawnFrame& drawn) const;
  double period_s() const { return place_.period_s; }

 private:
  CheckpointKey key_of(const DrawnFrame& drawn) const;

  FilmPlace place_;
  std::string program_, work_;  // hashes: of pilesim, of all that the frames have in common
};

}  // namespace pilesim
