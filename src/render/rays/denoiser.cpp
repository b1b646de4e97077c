#include "render/rays/denoiser.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>

#include "core/parallel_for.h"

namespace pilesim {
namespace {

constexpr size_t kRowsPerTask = 8;
constexpr size_t kPixelsPerTask = 4096;
constexpr int kPasses = 4;
constexpr int kLanes = 8;

// How alike two pixels have to be; docs/lab/rendering.md says what they were tried on.
constexpr float kNormals = 12;      // of 1 - cosine between normals
constexpr float kDepths = 40;       // of the relative difference of depths, beyond the slope's
constexpr float kAlbedos = 8;       // of the difference of albedos
constexpr float kLights = 2.5f;     // standard deviations
constexpr float kOtherBody = 0.4f;  // weight of pixels of another body

// Values of the pixels of a row that a tap compares and adds.
struct Row {
  const float *normal_x, *normal_y, *normal_z, *nearness;
  const float *albedo_red, *albedo_green, *albedo_blue;
  const float *red, *green, *blue, *variance;
  const float* body;
};
struct Tap {
  float kernel;  // weight of what is alike in all
  float reach;   // of differences of depth
  float share;   // 1 / samples: rows of surfaces are sums
};
struct Sums {
  float *red, *green, *blue, *variance, *weights;
  float* tolerance;  // of differences of light
};

}  // namespace

void Denoiser::begin(const Film& film) {
  width_ = film.width;
  height_ = film.height;
  for (LightPlanes* light : {&light_, &other_}) {
    for (auto* plane : {&light->red, &light->green, &light->blue, &light->variance}) {
      plane->resize(film.red.size());
    }
  }
  variance_.resize(film.red.size());
  body_.resize(film.red.size());
  const auto n = static_cast<float>(film.samples);
  const float least = kLeastAlbedo * n;
  parallel_for(film.red.size(), kPixelsPerTask, [&](size_t first, size_t end) {
    for (size_t i = first; i < end; ++i) {
      // Only whether two are the same is asked: more bodies than floats tell apart do no harm.
      body_[i] = static_cast<float>(film.body[i] & 0xFFFFFF);
      light_.red[i] = film.red[i] / std::max(film.albedo_red[i], least);
      light_.green[i] = film.green[i] / std::max(film.albedo_green[i], least);
      light_.blue[i] = film.blue[i] / std::max(film.albedo_blue[i], least);
      const float mean = luminance(light_.red[i], light_.green[i], light_.blue[i]);
      // Variance of the mean of the samples. One sample alone has none: its own size is taken.
      light_.variance[i] = film.samples > 1
                               ? std::max(0.0f, film.squares[i] / n - mean * mean) / (n - 1)
                               : mean * mean + 0.02f;
    }
  });
}

// The variance of few samples is as noisy as they are: take the mean of 3 x 3.
void Denoiser::smooth_variance() {
  const auto width = static_cast<size_t>(width_);
  parallel_for(static_cast<size_t>(height_), kRowsPerTask, [&](size_t first, size_t end) {
    for (size_t row = first; row < end; ++row) {
      const size_t above = row == 0 ? 0 : row - 1;
      const size_t below = std::min(row + 1, static_cast<size_t>(height_) - 1);
      const float* a = &light_.variance[above * width];
      const float* b = &light_.variance[row * width];
      const float* c = &light_.variance[below * width];
      float* out = &variance_[row * width];
      const auto column = [&](size_t x) { return a[x] + 2 * b[x] + c[x]; };
      for (size_t x = 1; x + 1 < width; ++x) {
        out[x] = (column(x - 1) + 2 * column(x) + column(x + 1)) / 16;
      }
      out[0] = (3 * column(0) + column(std::min<size_t>(1, width - 1))) / 16;
      out[width - 1] = (3 * column(width - 1) + column(width >= 2 ? width - 2 : 0)) / 16;
    }
  });
}

namespace {

// Adds a tap to `N` pixels from column x on. `own` and `tap` are of pixels of this row and of those
// that the tap reads, at the same index.
template <int N>
void add_to(const Row& own, const Row& tap, const Tap& how, std::ptrdiff_t x, const Sums& sums) {
  using Lanes = Eigen::Array<float, N, 1>;
  const auto at = [x](const float* row) -> Lanes { return Eigen::Map<const Lanes>(row + x); };
  const auto apart = [&](const float* a, const float* b) -> Lanes { return (at(a) - at(b)).abs(); };
  const Lanes turn =
      1 - how.share * how.share *
              (at(own.normal_x) * at(tap.normal_x) + at(own.normal_y) * at(tap.normal_y) +
               at(own.normal_z) * at(tap.normal_z));
  const Lanes farther =
      apart(own.nearness, tap.nearness) / (at(own.nearness) + at(tap.nearness) + 1e-9f);
  const Lanes colour = apart(own.albedo_red, tap.albedo_red) +
                       apart(own.albedo_green, tap.albedo_green) +
                       apart(own.albedo_blue, tap.albedo_blue);
  const Lanes light = 0.2126f * apart(own.red, tap.red) + 0.7152f * apart(own.green, tap.green) +
                      0.0722f * apart(own.blue, tap.blue);
  const Lanes same =
      kOtherBody + (1 - kOtherBody) * (1 - apart(own.body, tap.body)).max(Lanes::Zero());
  const Lanes unlike = kNormals * turn + how.reach * farther + kAlbedos * how.share * colour +
                       light * at(sums.tolerance);
  // Falls like an exponential, in few multiplications: (1 - x/8)^8 to x = 8.
  const Lanes falling = (1 - 0.125f * unlike).max(Lanes::Zero()).square().square().square();
  const Lanes weight = how.kernel * same * falling;
  const auto add = [x](float* row, const Lanes& value) { Eigen::Map<Lanes>(row + x) += value; };
  add(sums.red, weight * at(tap.red));
  add(sums.green, weight * at(tap.green));
  add(sums.blue, weight * at(tap.blue));
  add(sums.variance, weight.square() * at(tap.variance));
  add(sums.weights, weight);
}

// To columns [first, end).
void add_tap(const Row& own, const Row& tap, const Tap& how, int first, int end, const Sums& sums) {
  int x = first;
  for (; x + kLanes <= end; x += kLanes) add_to<kLanes>(own, tap, how, x, sums);
  for (; x < end; ++x) add_to<1>(own, tap, how, x, sums);
}

}  // namespace

void Denoiser::pass(const Film& film, int step) {
  static constexpr std::array<float, 3> kKernel = {3.0f / 8, 1.0f / 4, 1.0f / 16};
  const auto columns = static_cast<std::ptrdiff_t>(width_);
  const float share = 1 / static_cast<float>(film.samples);
  const auto row_at = [&](std::ptrdiff_t at) {
    return Row{&film.normal_x[0] + at,    &film.normal_y[0] + at,   &film.normal_z[0] + at,
               &film.nearness[0] + at,    &film.albedo_red[0] + at, &film.albedo_green[0] + at,
               &film.albedo_blue[0] + at, &light_.red[0] + at,      &light_.green[0] + at,
               &light_.blue[0] + at,      &light_.variance[0] + at, &body_[0] + at};
  };
  parallel_for(static_cast<size_t>(height_), kRowsPerTask, [&](size_t begin_row, size_t end_row) {
    std::vector<float> scratch(static_cast<size_t>(columns) * 6);
    float* place = scratch.data();
    const Sums sums{place,
                    place + columns,
                    place + 2 * columns,
                    place + 3 * columns,
                    place + 4 * columns,
                    place + 5 * columns};
    for (size_t row = begin_row; row < end_row; ++row) {
      const std::ptrdiff_t here = static_cast<std::ptrdiff_t>(row) * columns;
      const Row own = row_at(here);
      constexpr float kOwn = kKernel[0] * kKernel[0];
      for (std::ptrdiff_t x = 0; x < columns; ++x) {
        sums.red[x] = kOwn * own.red[x];
        sums.green[x] = kOwn * own.green[x];
        sums.blue[x] = kOwn * own.blue[x];
        sums.variance[x] = kOwn * kOwn * own.variance[x];
        sums.weights[x] = kOwn;
        sums.tolerance[x] =
            1 / (kLights * std::sqrt(variance_[static_cast<size_t>(here + x)]) + 1e-3f);
      }
      for (int dy = -2; dy <= 2; ++dy) {
        const int y = static_cast<int>(row) + dy * step;
        if (y < 0 || y >= height_) continue;
        for (int dx = -2; dx <= 2; ++dx) {
          if (dx == 0 && dy == 0) continue;
          const float kernel = kKernel[static_cast<size_t>(std::abs(dx))] *
                               kKernel[static_cast<size_t>(std::abs(dy))];
          const int aside = dx * step;
          add_tap(own, row_at(y * columns + aside),
                  {kernel, kDepths / static_cast<float>(step), share}, std::max(0, -aside),
                  std::min(width_, width_ - aside), sums);
        }
      }
      for (std::ptrdiff_t x = 0; x < columns; ++x) {
        const float one = 1 / sums.weights[x];
        const auto i = static_cast<size_t>(here + x);
        other_.red[i] = one * sums.red[x];
        other_.green[i] = one * sums.green[x];
        other_.blue[i] = one * sums.blue[x];
        other_.variance[i] = one * one * sums.variance[x];
      }
    }
  });
}

void Denoiser::finish(const Film& film) {
  const float share = 1 / static_cast<float>(film.samples);
  parallel_for(film.red.size(), kPixelsPerTask, [&](size_t first, size_t end) {
    for (size_t i = first; i < end; ++i) {
      light_.red[i] *= std::max(share * film.albedo_red[i], kLeastAlbedo);
      light_.green[i] *= std::max(share * film.albedo_green[i], kLeastAlbedo);
      light_.blue[i] *= std::max(share * film.albedo_blue[i], kLeastAlbedo);
    }
  });
}

const LightPlanes& Denoiser::filter(const Film& film) {
  begin(film);
  for (int i = 0; i < kPasses; ++i) {
    smooth_variance();
    pass(film, 1 << i);
    std::swap(light_, other_);
  }
  finish(film);
  return light_;
}

}  // namespace pilesim
