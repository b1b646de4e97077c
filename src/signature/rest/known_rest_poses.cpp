#include "signature/rest/known_rest_poses.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <optional>

namespace pilesim {
namespace {

// A pose and the drops that ended in it.
struct Counted {
  RestPose pose;
  uint64_t drops = 0;
  Vec3 up_sum = Vec3::Zero();
  double height_sum_m = 0;
};

std::optional<size_t> nearest(const std::vector<RestPose>& poses, const Vec3& up) {
  const auto pose =
      std::ranges::max_element(poses, {}, [&](const RestPose& p) { return p.up.dot(up); });
  if (pose == poses.end() || pose->up.dot(up) < std::cos(kRestPoseAngle)) return std::nullopt;
  return static_cast<size_t>(pose - poses.begin());
}

std::vector<RestPose> poses_of(const std::vector<Counted>& counted) {
  std::vector<RestPose> poses;
  for (const Counted& c : counted) poses.push_back(c.pose);
  return poses;
}

// Clusters of the geometric faces, and of the drops that ended near none of them.
std::vector<Counted> count_drops(const std::vector<RestPose>& faces,
                                 std::span<const ObservedRest> drops) {
  std::vector<Counted> counted;
  for (const RestPose& pose : cluster_rest_poses(faces, kRestPoseAngle, 0)) {
    counted.push_back({.pose = pose});
  }
  const std::vector<RestPose> centres = poses_of(counted);
  uint32_t families = 0;
  for (const RestPose& face : faces) families = std::max(families, face.family + 1);

  std::vector<RestPose> strays;
  for (const ObservedRest& drop : drops) {
    // A cluster reaches farther than a face, so search by face.
    const std::optional<size_t> face = nearest(faces, drop.up);
    if (!face) strays.push_back({.up = drop.up, .height_m = drop.height_m, .probability = 0});
  }
  for (RestPose& stray : strays) stray.family = families++;
  for (const RestPose& pose : cluster_rest_poses(strays, kRestPoseAngle, 0)) {
    counted.push_back({.pose = pose});
  }
  const std::vector<RestPose> all = poses_of(counted);
  for (const ObservedRest& drop : drops) {
    const std::optional<size_t> face = nearest(faces, drop.up);
    const size_t cluster = face ? *nearest(centres, faces[*face].up) : *nearest(all, drop.up);
    Counted& c = counted[cluster];
    ++c.drops;
    c.up_sum += drop.up;
    c.height_sum_m += drop.height_m;
  }
  return counted;
}

KnownRestPose by_geometry(const RestPose& pose) {
  return {.up = pose.up,
          .height_m = pose.height_m,
          .probability = pose.probability,
          .probability_low = pose.probability,
          .probability_high = pose.probability,
          .source = "geometry",
          .family = pose.family};
}

KnownRestPose by_simulation(const Counted& counted, size_t drops) {
  const auto count = static_cast<double>(counted.drops), of = static_cast<double>(drops);
  const ShareInterval interval = wilson_interval(count, of);
  return {.up = counted.up_sum.normalized(),
          .height_m = counted.height_sum_m / count,
          .probability = count / of,
          .probability_low = interval.low,
          .probability_high = interval.high,
          .source = "simulation",
          .family = counted.pose.family};
}

}  // namespace

ShareInterval wilson_interval(double count, double of) {
  constexpr double kDeviations = 1.959964;  // 97.5% quantile of the normal distribution
  const double z2 = kDeviations * kDeviations;
  const double share = count / of;
  const double middle = share + z2 / (2 * of);
  const double half = kDeviations * std::sqrt(share * (1 - share) / of + z2 / (4 * of * of));
  return {std::max(0.0, (middle - half) / (1 + z2 / of)),
          std::min(1.0, (middle + half) / (1 + z2 / of))};
}

std::vector<KnownRestPose> known_rest_poses(const std::vector<RestPose>& faces,
                                            std::span<const ObservedRest> drops) {
  const std::vector<Counted> counted = count_drops(faces, drops);
  struct Family {
    double by_geometry = 0, by_simulation = 0;
  };
  std::map<uint32_t, Family> families;
  for (const Counted& c : counted) {
    Family& family = families[c.pose.family];
    family.by_geometry += c.pose.probability;
    if (!drops.empty()) {
      family.by_simulation += static_cast<double>(c.drops) / static_cast<double>(drops.size());
    }
  }
  std::vector<KnownRestPose> known;
  for (const Counted& c : counted) {
    const Family& family = families[c.pose.family];
    if (std::max(family.by_geometry, family.by_simulation) < kLeastRestProbability) continue;
    if (c.pose.probability > 0) known.push_back(by_geometry(c.pose));
    if (c.drops > 0) known.push_back(by_simulation(c, drops.size()));
  }
  std::ranges::stable_sort(known, std::greater{}, &KnownRestPose::probability);
  std::ranges::stable_sort(known, {}, &KnownRestPose::source);
  return known;
}

std::vector<RestPosePair> pair_rest_poses(std::span<const KnownRestPose> poses) {
  std::vector<RestPosePair> pairs;
  for (const KnownRestPose& p : poses) {
    const bool simulated = p.source == "simulation";
    auto pair = std::ranges::find_if(pairs, [&](const RestPosePair& s) {
      return (simulated ? s.by_simulation : s.by_geometry) == nullptr &&
             s.pose->up.dot(p.up) >= std::cos(kRestPoseAngle);
    });
    if (pair == pairs.end()) pair = pairs.insert(pairs.end(), {.pose = &p});
    (simulated ? pair->by_simulation : pair->by_geometry) = &p;
  }
  return pairs;
}

std::vector<RestPoseComparison> compare_rest_poses(const std::vector<KnownRestPose>& poses,
                                                   uint32_t drops) {
  if (drops == 0) return {};
  std::map<uint32_t, RestPoseComparison> families;
  std::map<uint32_t, std::array<size_t, 2>> entries;
  std::map<uint32_t, double> likeliest;
  for (const KnownRestPose& pose : poses) {
    RestPoseComparison& family = families[pose.family];
    family.family = pose.family;
    const bool simulated = pose.source == "simulation";
    (simulated ? family.by_simulation : family.by_geometry) += pose.probability;
    ++entries[pose.family][simulated ? 1 : 0];
    if (pose.probability > likeliest[pose.family]) {
      likeliest[pose.family] = pose.probability;
      family.up = pose.up;
      family.height_m = pose.height_m;
    }
  }
  const auto count = static_cast<double>(drops);
  std::vector<RestPoseComparison> result;
  for (auto& [number, family] : families) {
    family.poses = std::max(entries[number][0], entries[number][1]);
    const ShareInterval interval = wilson_interval(family.by_simulation * count, count);
    family.simulation_low = interval.low;
    family.simulation_high = interval.high;
    const bool seen_by_geometry = family.by_geometry >= kLeastRestProbability;
    const bool seen_by_simulation = family.simulation_low >= kLeastRestProbability;
    constexpr double kExists = kRestAgreement * kLeastRestProbability;
    family.agrees = (!seen_by_geometry || family.simulation_high >= kExists) &&
                    (!seen_by_simulation || family.by_geometry >= kExists);
    result.push_back(family);
  }
  std::ranges::stable_sort(result, std::greater{}, &RestPoseComparison::by_simulation);
  return result;
}

}  // namespace pilesim
