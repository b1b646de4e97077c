#include "export/export_source.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstdio>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include "core/error.h"
#include "core/near_origin.h"
#include "export/export_text.h"
#include "render/view.h"
#include "scene/camera_path.h"
#include "trajectory/named_bodies.h"

namespace pilesim {
namespace {

// Planes extend beyond all bodies, but not as far as one that fell for ever.
constexpr float kPlaneReaches = 2;  // relative to the farthest position of a body
constexpr float kLeastPlane_m = 1, kMostPlane_m = 1000;
// Emitters may sample roughness and clear coat per body, so that each would need its own material:
// more than this many pairs are rounded.
constexpr size_t kMostGlosses = 64;
constexpr float kRoughnessSteps = 10, kCoatSteps = 5;

std::string hex(const Colour& colour) {
  std::array<char, 8> text;
  std::snprintf(text.data(), text.size(), "%02x%02x%02x", colour[0], colour[1], colour[2]);
  return text.data();
}

using Gloss = std::array<float, 2>;      // roughness, clear coat
using Substance = std::array<float, 3>;  // metallic, transmission, emission

Gloss plain_gloss() {
  const Look plain;
  return {static_cast<float>(plain.roughness), static_cast<float>(plain.clear_coat)};
}

// Gloss of each body. Planes are matt, as in pictures.
std::vector<Gloss> glosses_of(const TrajectoryHeader& header) {
  std::vector<Gloss> gloss = header.body_gloss;
  if (gloss.empty()) gloss.assign(header.body_count(), plain_gloss());
  if (std::set(gloss.begin(), gloss.end()).size() > kMostGlosses) {
    for (auto& [roughness, clear_coat] : gloss) {
      roughness = std::round(kRoughnessSteps * roughness) / kRoughnessSteps;
      clear_coat = std::round(kCoatSteps * clear_coat) / kCoatSteps;
    }
  }
  for (size_t body = 0; body < gloss.size(); ++body) {
    if (header.shapes[header.body_shape[body]].is_plane) gloss[body] = {1, 0};
  }
  return gloss;
}

// Suffix of a look's name if its gloss is not the default.
std::string gloss_words(const Gloss& gloss, bool is_plane) {
  if (is_plane || gloss == plain_gloss()) return "";
  std::string text = " roughness ";
  append_rounded(text, gloss[0], 3);
  if (gloss[1] == 0) return text;
  text += " coat ";
  append_rounded(text, gloss[1], 3);
  return text;
}

std::string substance_words(const Substance& substance) {
  constexpr std::array kWords = {" metallic ", " transmission ", " emission "};
  std::string text;
  for (size_t i = 0; i < kWords.size(); ++i) {
    if (substance[i] == 0) continue;
    text += kWords[i];
    append_rounded(text, substance[i], 3);
  }
  return text;
}

bool is_present(uint8_t state) { return (state & kPresent) != 0; }

}  // namespace

ExportSource::ExportSource(TrajectoryReader& trajectory, ExportChoice choice)
    : trajectory_(trajectory), choice_(std::move(choice)) {
  assert(!choice_.frames.empty());
  choose_bodies();
  find_changes();
  float farthest = 0;
  if (!bounds_.isEmpty())
    farthest = std::max(bounds_.min().cwiseAbs().maxCoeff(), bounds_.max().cwiseAbs().maxCoeff());
  for (const TrajectoryShape& shape : header().shapes) {
    shapes_.push_back(
        make_export_mesh(shape, std::clamp(kPlaneReaches * farthest, kLeastPlane_m, kMostPlane_m)));
  }
  float radius = 0;
  for (const ExportBody& body : bodies_) radius = std::max(radius, shapes_[body.shape].radius_m);
  if (!bounds_.isEmpty()) {
    bounds_.min().array() -= radius;
    bounds_.max().array() += radius;
  }
}

void ExportSource::choose_bodies() {
  const TrajectoryHeader& all = header();
  const std::vector<uint8_t> chosen = choice_.only.empty()
                                          ? std::vector<uint8_t>(all.body_count(), 1)
                                          : bodies_named(choice_.only, all.body_name, "--only");
  const std::vector<Gloss> gloss = glosses_of(all);
  std::map<std::tuple<uint32_t, bool, Gloss, Substance, Colour>, uint32_t> look_of;
  for (uint32_t id = 0; id < all.body_count(); ++id) {
    if (chosen[id] == 0) continue;
    const bool is_painted = all.body_painted[id] != 0;
    const bool is_plane = all.shapes[all.body_shape[id]].is_plane;
    const Substance substance =
        all.body_substance.empty() || is_plane ? Substance{} : all.body_substance[id];
    const std::tuple key(all.body_material[id], is_painted, gloss[id], substance,
                         all.body_colour[id]);
    const auto [look, is_new] = look_of.try_emplace(key, static_cast<uint32_t>(looks_.size()));
    if (is_new) {
      const Colour& colour = all.body_colour[id];
      looks_.push_back({all.materials[all.body_material[id]] + ' ' + hex(colour) +
                            (is_painted ? " painted" : "") + gloss_words(gloss[id], is_plane) +
                            substance_words(substance),
                        colour, is_painted, gloss[id][0], gloss[id][1], substance[0], substance[1],
                        substance[2]});
    }
    bodies_.push_back(
        {.name = all.body_name[id], .id = id, .shape = all.body_shape[id], .look = look->second});
  }
}

void ExportSource::find_changes() {
  TrajectoryFrame before, now;
  Bounds bounds, solid;  // of all, and of all but planes; m, world
  std::vector<uint8_t> seen(bodies_.size());
  for (size_t k = 0; k < frame_count(); ++k) {
    std::swap(before, now);
    read(k, now);
    for (size_t i = 0; i < bodies_.size(); ++i) {
      ExportBody& body = bodies_[i];
      const bool present = is_present(now.state[i]);
      if (present) {
        seen[i] = 1;
        bounds.extend(now.position[i]);
        if (!header().shapes[body.shape].is_plane) solid.extend(now.position[i]);
      } else {
        body.ever_absent = true;
      }
      if (k == 0) {
        body.starts_present = present;
      } else if (present != is_present(before.state[i]) || now.position[i] != before.position[i] ||
                 now.orientation[i].coeffs() != before.orientation[i].coeffs()) {
        if (body.last_change == 0) body.first_change = static_cast<uint32_t>(k - 1);
        body.last_change = static_cast<uint32_t>(k);
      }
    }
  }
  if (!solid.isEmpty()) {
    float radius = 0;
    for (const ExportBody& body : bodies_) {
      for (const Vec3f& v : header().shapes[body.shape].vertices)
        radius = std::max(radius, v.norm());
    }
    origin_ = near_origin(solid.center(), solid.diagonal().norm() + static_cast<double>(radius));
  }
  if (!origin_.isZero()) bounds = solid;
  if (!bounds.isEmpty()) {
    bounds_.extend(from_origin(bounds.min()));
    bounds_.extend(from_origin(bounds.max()));
  }
  std::vector<ExportBody> found;
  for (size_t i = 0; i < bodies_.size(); ++i) {
    if (seen[i] != 0) found.push_back(std::move(bodies_[i]));
  }
  bodies_ = std::move(found);
  std::ranges::sort(bodies_, {}, [](const ExportBody& body) {
    return std::tuple(body.shape, body.look, body.id);
  });
}

CameraKey ExportSource::camera(size_t k) const { return camera_at(choice_.camera, time_s(k)); }

void ExportSource::read(size_t k, TrajectoryFrame& poses) {
  trajectory_.read(frame(k), whole_);
  const size_t count = bodies_.size();
  poses.position.resize(count);
  poses.orientation.resize(count);
  poses.state.resize(count);
  if (k == 0) last_.assign(count, Quatf::Identity());
  last_.resize(count, Quatf::Identity());
  for (size_t i = 0; i < count; ++i) {
    const uint32_t id = bodies_[i].id;
    Quatf q = whole_.orientation[id];
    if (q.dot(last_[i]) < 0) q.coeffs() = -q.coeffs();
    last_[i] = q;
    poses.position[i] = whole_.position[id];
    poses.orientation[i] = q;
    poses.state[i] = whole_.state[id];
  }
}

Vec3f ExportSource::place(const TrajectoryFrame& poses, size_t body) const {
  if (origin_.isZero() || !header().shapes[bodies_[body].shape].is_plane) {
    return from_origin(poses.position[body]);
  }
  const Vec3 normal = poses.orientation[body].cast<double>() * Vec3::UnitY();
  return (normal.dot(poses.position[body] - origin_) * normal).cast<float>();
}

std::vector<ExportTrack> read_tracks(ExportSource& source) {
  std::vector<ExportTrack> tracks(source.bodies().size());
  TrajectoryFrame before, now;
  for (size_t k = 0; k < source.frame_count(); ++k) {
    std::swap(before, now);
    source.read(k, now);
    for (size_t i = 0; i < tracks.size(); ++i) {
      ExportTrack& track = tracks[i];
      const auto add = [&](size_t frame, const TrajectoryFrame& poses) {
        track.key.push_back(static_cast<uint32_t>(frame));
        track.position.push_back(source.place(poses, i));
        track.orientation.push_back(poses.orientation[i]);
      };
      if (k == 0) {
        add(0, now);
        continue;
      }
      if (is_present(now.state[i]) != is_present(before.state[i])) {
        track.toggles.push_back(static_cast<uint32_t>(k));
      }
      if (now.position[i] == before.position[i] &&
          now.orientation[i].coeffs() == before.orientation[i].coeffs()) {
        continue;
      }
      if (track.key.back() + 1 != k) add(k - 1, before);
      add(k, now);
    }
  }
  return tracks;
}

Quat camera_orientation(const CameraKey& camera) {
  const View view = make_view(camera, 1, 0.1f, 100);
  Mat3 axes;
  axes.col(0) = view.right.cast<double>();
  axes.col(1) = view.up.cast<double>();
  axes.col(2) = -view.forward.cast<double>();
  return Quat(axes).normalized();
}

}  // namespace pilesim
