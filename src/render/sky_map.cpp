#include "render/sky_map.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace pilesim {
namespace {

constexpr float kFloatPi = static_cast<float>(kPi);
// Pixels around of what lights surfaces: a third of a degree each, less than the sun's size.
constexpr int kLightWidth = 1024;
// Directions that are more times as bright as the mean of all are the rasteriser's sun.
constexpr float kSunTimesMean = 10;
// Where a scene's own sun may be at least.
const float kLowestSun = static_cast<float>(std::sin(radians(5)));

float brightness(const Vec3f& light) {
  return 0.2126f * light.x() + 0.7152f * light.y() + 0.0722f * light.z();
}

SkyImage shrunk_to(const SkyImage& image, int width) {
  if (image.width <= width) return image;
  SkyImage result{.width = width, .height = width / 2, .pixels = {}};
  const auto first = [&](int i, int to, int from) {
    return static_cast<int>(int64_t{i} * from / to);
  };
  for (int row = 0; row < result.height; ++row) {
    const int top = first(row, result.height, image.height);
    const int below = first(row + 1, result.height, image.height);
    for (int column = 0; column < width; ++column) {
      const int left = first(column, width, image.width);
      const int right = first(column + 1, width, image.width);
      Vec3f sum = Vec3f::Zero();
      for (int y = top; y < below; ++y) {
        for (int x = left; x < right; ++x) {
          sum += image.pixels[static_cast<size_t>(y) * image.width + x];
        }
      }
      result.pixels.emplace_back(sum / static_cast<float>((below - top) * (right - left)));
    }
  }
  return result;
}

float cosine_of_row(const SkyImage& image, float row) {
  return std::cos(kFloatPi * row / static_cast<float>(image.height));
}

}  // namespace

SkyImage half_of(const SkyImage& image) {
  if (image.height > 1) return shrunk_to(image, std::max(2, image.width / 2));
  return {.width = 1, .height = 1, .pixels = {0.5f * (image.pixels.front() + image.pixels.back())}};
}

Vec3f irradiance(const SkyHarmonics& h, const Vec3f& n) {
  const Vec3f sum = h[0] + h[1] * n.y() + h[2] * n.z() + h[3] * n.x() + h[4] * (n.x() * n.y()) +
                    h[5] * (n.y() * n.z()) + h[6] * (3 * n.z() * n.z() - 1) +
                    h[7] * (n.x() * n.z()) + h[8] * (n.x() * n.x() - n.y() * n.y());
  return sum.cwiseMax(0.0f);
}

float solid_angle(const SkyImage& image, int row) {
  const float height = cosine_of_row(image, static_cast<float>(row)) -
                       cosine_of_row(image, static_cast<float>(row + 1));
  return 2 * kFloatPi / static_cast<float>(image.width) * height;
}

SkyHarmonics harmonics_of(const SkyMap& map, const SkyImage& light) {
  std::array<Vec3, 9> sums;
  sums.fill(Vec3::Zero());
  for (int row = 0; row < light.height; ++row) {
    const double size = solid_angle(light, row);
    for (int column = 0; column < light.width; ++column) {
      const Vec3 n = map.direction(light, column, row).cast<double>();
      const Vec3 sent =
          size * light.pixels[static_cast<size_t>(row) * light.width + column].cast<double>();
      const std::array<double, 9> parts = {1,
                                           n.y(),
                                           n.z(),
                                           n.x(),
                                           n.x() * n.y(),
                                           n.y() * n.z(),
                                           3 * n.z() * n.z() - 1,
                                           n.x() * n.z(),
                                           n.x() * n.x() - n.y() * n.y()};
      for (size_t i = 0; i < parts.size(); ++i) sums[i] += parts[i] * sent;
    }
  }
  // Squares of the functions' norms, times what a cosine leaves of their order: 1, 2/3, 1/4.
  const double order1 = 3 / (4 * kPi) * 2 / 3, order2 = 15 / (4 * kPi) / 4;
  const std::array<double, 9> weights = {1 / (4 * kPi), order1,      order1, order1,    order2,
                                         order2,        order2 / 12, order2, order2 / 4};
  SkyHarmonics result;
  for (size_t i = 0; i < result.size(); ++i) result[i] = (weights[i] * sums[i]).cast<float>();
  return result;
}

SkyMap::SkyMap(SkyImage image, double turn, const Vec3f& factor)
    : seen_(std::move(image)), turn_(static_cast<float>(turn)) {
  for (Vec3f& pixel : seen_.pixels) pixel = pixel.cwiseProduct(factor);
  light_ = shrunk_to(seen_, kLightWidth);
  harmonics_ = harmonics_of(*this, light_);
  double all = 0;
  for (int row = 0; row < light_.height; ++row) {
    double in_row = 0;
    const auto first = static_cast<size_t>(row) * light_.width;
    for (int column = 0; column < light_.width; ++column) {
      in_row += brightness(light_.pixels[first + column]);
      columns_.push_back(static_cast<float>(in_row));
    }
    for (int column = 0; column < light_.width; ++column) {
      float& share = columns_[first + column];
      share = in_row > 0 ? static_cast<float>(share / in_row)
                         : static_cast<float>(column + 1) / static_cast<float>(light_.width);
    }
    all += in_row * solid_angle(light_, row);
    rows_.push_back(static_cast<float>(all));
  }
  brightness_ = static_cast<float>(all);
  if (all <= 0) return;
  for (float& share : rows_) share = static_cast<float>(share / all);
}

Vec3f SkyMap::direction(float across, float cosine) const {
  const float azimuth = turn_ + (0.5f - across) * 2 * kFloatPi;
  const float level = std::sqrt(std::max(0.0f, 1 - cosine * cosine));
  return {level * std::sin(azimuth), cosine, level * std::cos(azimuth)};
}

Vec3f SkyMap::direction(const SkyImage& image, int column, int row) const {
  return direction((static_cast<float>(column) + 0.5f) / static_cast<float>(image.width),
                   0.5f * (cosine_of_row(image, static_cast<float>(row)) +
                           cosine_of_row(image, static_cast<float>(row + 1))));
}

namespace {

// Place in an image, in pixels from its upper left corner.
Eigen::Vector2f place_in(const SkyImage& image, float turn, const Vec3f& direction) {
  const float across = 0.5f - (std::atan2(direction.x(), direction.z()) - turn) / (2 * kFloatPi);
  const float down = std::acos(std::clamp(direction.y(), -1.0f, 1.0f)) / kFloatPi;
  return {(across - std::floor(across)) * static_cast<float>(image.width),
          down * static_cast<float>(image.height)};
}

}  // namespace

size_t SkyMap::pixel_of(const SkyImage& image, const Vec3f& direction) const {
  const Eigen::Vector2f at = place_in(image, turn_, direction);
  const int column = std::min(static_cast<int>(at.x()), image.width - 1);
  const int row = std::min(static_cast<int>(at.y()), image.height - 1);
  return static_cast<size_t>(row) * image.width + column;
}

Vec3f SkyMap::shown(const Vec3f& direction) const {
  const Eigen::Vector2f at = place_in(seen_, turn_, direction) - Eigen::Vector2f(0.5f, 0.5f);
  const float left = std::floor(at.x()), top = std::floor(at.y());
  const auto pixel = [&](float column, float row) {
    const int x = (static_cast<int>(column) + seen_.width) % seen_.width;
    const int y = std::clamp(static_cast<int>(row), 0, seen_.height - 1);
    return seen_.pixels[static_cast<size_t>(y) * seen_.width + x];
  };
  const auto in_row = [&](float row) {
    const Vec3f first = pixel(left, row);
    return Vec3f(first + (at.x() - left) * (pixel(left + 1, row) - first));
  };
  const Vec3f upper = in_row(top);
  return upper + (at.y() - top) * (in_row(top + 1) - upper);
}

SkyMap::Sample SkyMap::sample(const Eigen::Vector2f& point) const {
  if (brightness_ <= 0) return {Vec3f::UnitY(), Vec3f::Zero(), 0};
  // Which part of a list of growing shares holds a number, and where in it that lies.
  const auto find = [](auto first, auto last, float number, float& within) {
    const auto found = std::min(std::upper_bound(first, last, number), last - 1);
    const float low = found == first ? 0 : *(found - 1);
    within = *found > low ? std::clamp((number - low) / (*found - low), 0.0f, 1.0f) : 0.5f;
    return static_cast<int>(found - first);
  };
  float down = 0, across = 0;
  const int row = find(rows_.begin(), rows_.end(), point.y(), down);
  const auto first = columns_.begin() + static_cast<std::ptrdiff_t>(row) * light_.width;
  const int column = find(first, first + light_.width, point.x(), across);
  const float top = cosine_of_row(light_, static_cast<float>(row));
  const float cosine = top + down * (cosine_of_row(light_, static_cast<float>(row + 1)) - top);
  const Vec3f& light = light_.pixels[static_cast<size_t>(row) * light_.width + column];
  return {
      direction((static_cast<float>(column) + across) / static_cast<float>(light_.width), cosine),
      light, brightness(light) / brightness_};
}

float SkyMap::density(const Vec3f& direction) const {
  return brightness_ > 0 ? brightness(radiance(direction)) / brightness_ : 0;
}

RasterSky raster_sky(const SkyMap& map, const std::optional<Vec3f>& ground, bool has_sun) {
  RasterSky result{.light = map.light(), .harmonics = {}};
  SkyImage& light = result.light;
  const auto for_each = [&](const auto& visit) {
    for (int row = 0; row < light.height; ++row) {
      const float size = solid_angle(light, row);
      for (int column = 0; column < light.width; ++column) {
        visit(map.direction(light, column, row), size,
              light.pixels[static_cast<size_t>(row) * light.width + column]);
      }
    }
  };
  float all = 0;
  for_each([&](const Vec3f&, float size, const Vec3f& sent) { all += size * brightness(sent); });
  const float most = kSunTimesMean * all / (4 * kFloatPi);
  Vec3f towards = Vec3f::Zero();
  for_each([&](const Vec3f& direction, float size, Vec3f& sent) {
    const float bright = brightness(sent);
    if (has_sun || bright <= most || direction.y() < kLowestSun) return;
    const Vec3f excess = (1 - most / bright) * sent;
    result.sun += size / kFloatPi * excess;
    towards += size * brightness(excess) * direction;
    sent -= excess;
  });
  if (towards.squaredNorm() > 0) result.to_sun = towards.normalized();
  if (ground) {
    for_each([](const Vec3f& direction, float, Vec3f& sent) {
      if (direction.y() < 0) sent.setZero();
    });
    const Vec3f from_above = irradiance(harmonics_of(map, light), Vec3f::UnitY());
    const Vec3f from_below =
        ground->cwiseProduct(from_above + std::max(0.0f, result.to_sun.y()) * result.sun);
    for_each([&](const Vec3f& direction, float, Vec3f& sent) {
      if (direction.y() < 0) sent = from_below;
    });
  }
  result.harmonics = harmonics_of(map, light);
  return result;
}

}  // namespace pilesim
