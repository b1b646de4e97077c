#include "signature/contact_search.h"

#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

namespace pilesim {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

// Lengths as parts of the body's outer radius.
constexpr double kMargin = 1e-6;     // covers the rounding of the bounds in float
constexpr double kTouching = 1e-9;   // at or below this a vertex touches
constexpr double kResolved = 1e-11;  // a contact's predicted height is known this well
// Of the speed of the body's fastest point: what is slower does not move.
constexpr double kStill = 1e-12;
constexpr int kRounds = 16;    // of the search for a zero
constexpr size_t kAtOnce = 4;  // polynomials

// --- Bounds in float -----------------------------------------------------------------------------

using TagF = hn::FixedTag<float, ContactBody::kGroup>;
using F = hn::Vec<TagF>;

uint32_t bits_of(const hn::Mask<TagF>& mask) {
  uint8_t bits[8] = {};
  hn::StoreMaskBits(TagF(), mask, bits);
  return bits[0];
}

struct Points {
  F x, y, z;
};
Points load(const std::vector<float>& x, const std::vector<float>& y, const std::vector<float>& z,
            size_t at) {
  const TagF d;
  return {hn::LoadU(d, &x[at]), hn::LoadU(d, &y[at]), hn::LoadU(d, &z[at])};
}

// `least` of the group that starts at `begin`, without these vertices.
F without(F least, const std::vector<uint32_t>& vertices, size_t begin) {
  const TagF d;
  alignas(32) float values[ContactBody::kGroup];
  hn::Store(least, d, values);
  for (const uint32_t v : vertices) {
    if (v >= begin && v < begin + ContactBody::kGroup) {
      values[v - begin] = std::numeric_limits<float>::max();
    }
  }
  return hn::Load(d, values);
}

// --- Polynomials in double -----------------------------------------------------------------------

using Tag = hn::FixedTag<double, kAtOnce>;
using V = hn::Vec<Tag>;
using Mask = hn::Mask<Tag>;

// The heights of a few vertices over a step, sums of c[k] s^k.
struct Polynomials {
  std::array<V, RotationSeries::kOrder + 1> c;
  V power = hn::Zero(Tag());  // of s by which they were divided

  void divide(const Mask& mask) {
    for (size_t k = 0; k + 1 < c.size(); ++k) c[k] = hn::IfThenElse(mask, c[k + 1], c[k]);
    c.back() = hn::IfThenZeroElse(mask, c.back());
    power = hn::Add(power, hn::IfThenElseZero(mask, hn::Set(Tag(), 1.0)));
  }
  // A bound of |the second derivative| up to 1.
  V curvature() const {
    V sum = hn::Zero(Tag());
    for (size_t k = 2; k < c.size(); ++k) {
      sum = hn::MulAdd(hn::Set(Tag(), static_cast<double>(k * (k - 1))), hn::Abs(c[k]), sum);
    }
    return sum;
  }
};

struct Zeros {
  V s;         // before it there is none
  Mask found;  // at it there is one, downwards
};

// The first zeros from `begin` on, but for one at 0 that was divided off, up to `limit`, of the
// lanes `open`: from one s to the next by the first zero of a parabola below the polynomial.
Zeros first_zeros(const Polynomials& p, Mask open, double begin, double limit, double resolved) {
  const Tag d;
  const V zero = hn::Zero(d), one = hn::Set(d, 1.0), curvature = p.curvature();
  const Mask divided = hn::Gt(p.power, zero), twice = hn::Gt(p.power, one);
  Zeros zeros{hn::Set(d, begin), hn::Lt(one, zero)};
  V& s = zeros.s;
  for (int i = 0; i < kRounds; ++i) {
    V f = p.c.back(), slope = zero;
    for (size_t k = p.c.size() - 1; k-- > 0;) {
      slope = hn::MulAdd(slope, s, f);
      f = hn::MulAdd(f, s, p.c[k]);
    }
    const V scale = hn::IfThenElse(divided, hn::IfThenElse(twice, hn::Mul(s, s), s), one);
    Mask low = hn::Le(hn::Mul(hn::Abs(f), scale), hn::Set(d, resolved));
    if (i == 0 && begin == 0) low = hn::AndNot(divided, low);
    // The slope before the division, but for a factor.
    const V undivided = hn::IfThenElse(divided, hn::MulAdd(s, slope, hn::Mul(p.power, f)), slope);
    zeros.found = hn::Or(zeros.found, hn::And(hn::And(open, low), hn::Lt(undivided, zero)));
    open = hn::AndNot(low, open);
    // As long as the vertex goes down, a root in the denominator loses nothing.
    const Mask down = hn::Lt(slope, zero);
    const V twice_height = hn::Mul(hn::Set(d, 2.0), hn::Max(f, zero));
    const V root = hn::Sqrt(hn::MulAdd(slope, slope, hn::Mul(twice_height, curvature)));
    const V above = hn::IfThenElse(down, twice_height, hn::Add(slope, root));
    const V below = hn::IfThenElse(down, hn::Sub(root, slope), curvature);
    const V tiny = hn::Set(d, std::numeric_limits<double>::min());
    s = hn::IfThenElse(open, hn::Add(s, hn::Div(above, hn::Max(below, tiny))), s);
    open = hn::And(open, hn::Lt(s, hn::Set(d, limit)));
    if (hn::AllFalse(d, open)) break;
  }
  return zeros;
}

}  // namespace

// The height of points up to the third order, less the margin, and what the other orders can take
// off a vertex.
struct ContactSearch::Cubic {
  std::array<std::array<F, 3>, 4> n;
  F height, rise, slack;

  Cubic(const SegmentMotion& motion, double size) {
    const TagF d;
    const auto set = [&](double x) { return hn::Set(d, static_cast<float>(x)); };
    for (size_t k = 0; k < n.size(); ++k) {
      const LaneVectors& v = motion.segment->direction[k];
      n[k] = {set(v.x[motion.lane]), set(v.y[motion.lane]), set(v.z[motion.lane])};
    }
    height = set(motion.height + motion.begin * motion.rise - kMargin * size);
    rise = set(DirectionSegment::kLength * motion.rise);
    slack = set(motion.segment->tail[motion.lane] * size);
  }
  F order(size_t k, const Points& p) const {
    return hn::MulAdd(p.z, n[k][2], hn::MulAdd(p.y, n[k][1], hn::Mul(p.x, n[k][0])));
  }
  // The least height up to s, but for the slack: the polynomial is not below a concave one, which
  // is least at an end.
  F least(const Points& p, F s) const {
    const F zero = hn::Zero(TagF());
    const F c0 = hn::Add(order(0, p), height), c1 = hn::Add(order(1, p), rise);
    const F c2 = hn::Min(order(2, p), zero), c3 = hn::Min(order(3, p), zero);
    return hn::Min(c0, hn::MulAdd(hn::MulAdd(hn::MulAdd(c3, s, c2), s, c1), s, c0));
  }
};

ContactSearch::ContactSearch(const ContactBody& body) : body_(body) {
  constexpr size_t kGroup = ContactBody::kGroup;
  const size_t groups = body.lane_x.size() / kGroup, blocks = (groups + kBlock - 1) / kBlock;
  const auto centre_of = [&](size_t g) {
    return Vec3(body.group_x[g], body.group_y[g], body.group_z[g]);
  };
  for (size_t block = 0; block < (blocks + kGroup - 1) / kGroup * kGroup; ++block) {
    const size_t first = std::min(block, blocks - 1) * kBlock;
    const size_t end = std::min(groups, first + kBlock);
    Bounds bounds;
    for (size_t g = first; g < end; ++g) bounds.extend(centre_of(g));
    const Vec3f centre = bounds.center().cast<float>();
    double extent = 0;
    for (size_t g = first; g < end; ++g) {
      const double apart = (centre_of(g) - centre.cast<double>()).norm();
      extent = std::max(extent, apart + body.group_extent[g]);
    }
    block_x_.push_back(centre.x());
    block_y_.push_back(centre.y());
    block_z_.push_back(centre.z());
    block_extent_.push_back(static_cast<float>(extent + kMargin * body.outer_radius_m));
  }
}

ContactSearch::Deepest ContactSearch::find_deepest(const Cubic& cubic, float part) const {
  const TagF d;
  const hn::RebindToSigned<TagF> di;
  constexpr size_t kGroup = ContactBody::kGroup;
  const F s = hn::Set(d, part);
  const size_t groups = body_.lane_x.size() / kGroup;
  F lowest = hn::Set(d, std::numeric_limits<float>::max());
  auto vertex = hn::Zero(di), count = hn::Zero(di);
  // The normal is a unit vector: no point of a ball is lower than its centre by more than its
  // radius.
  const auto may_touch = [&](const Points& centres, const float* extents) {
    const F extent = hn::LoadU(d, extents);
    return bits_of(hn::Le(cubic.least(centres, s), hn::Add(extent, cubic.slack)));
  };
  uint32_t open_blocks = 0;
  for (size_t first = 0; first < groups; first += kBlock) {
    const size_t block = first / kBlock;
    if (block % kGroup == 0) {
      open_blocks = may_touch(load(block_x_, block_y_, block_z_, block), &block_extent_[block]);
    }
    if ((open_blocks >> block % kGroup & 1U) == 0) continue;
    const size_t end = std::min(groups, first + kBlock);
    uint64_t open = 0;
    for (size_t group = first; group < end; group += kGroup) {
      const Points centres = load(body_.group_x, body_.group_y, body_.group_z, group);
      open |= uint64_t{may_touch(centres, &body_.group_extent[group])} << (group - first);
    }
    // The last balls are filled up with copies of the first.
    if (end - first < kBlock) open &= (uint64_t{1} << (end - first)) - 1;
    for (; open != 0; open &= open - 1) {
      const size_t begin = (first + static_cast<size_t>(std::countr_zero(open))) * kGroup;
      F least = cubic.least(load(body_.lane_x, body_.lane_y, body_.lane_z, begin), s);
      if (!solved_.empty()) least = without(least, solved_, begin);
      const auto lower = hn::Lt(least, lowest);
      lowest = hn::Min(lowest, least);
      vertex = hn::IfThenElse(hn::RebindMask(di, lower), hn::Set(di, static_cast<int32_t>(begin)),
                              vertex);
      count = hn::Sub(count, hn::VecFromMask(di, hn::RebindMask(di, hn::Le(least, cubic.slack))));
    }
  }
  // Of each lane the deepest, unless it cannot touch.
  Deepest deepest;
  alignas(32) int32_t begins[kGroup];
  hn::Store(vertex, di, begins);
  for (uint32_t bits = bits_of(hn::Le(lowest, cubic.slack)); bits != 0; bits &= bits - 1) {
    const auto lane = static_cast<uint32_t>(std::countr_zero(bits));
    deepest.vertex[deepest.count++] = static_cast<uint32_t>(begins[lane]) + lane;
  }
  deepest.more = !hn::AllFalse(di, hn::Gt(count, hn::Set(di, 1)));
  return deepest;
}

// Looks at kAtOnce vertices at most, and keeps the earliest end.
void ContactSearch::solve(const SegmentMotion& motion, std::span<const uint32_t> vertices,
                          StepEnd& end) const {
  const Tag d;
  const double size = body_.outer_radius_m;
  const auto number = [&](size_t i) {  // the last group is filled up with copies of the last one
    const uint32_t v = vertices[std::min(i, vertices.size() - 1)];
    return std::min(v, static_cast<uint32_t>(body_.vertices.size() - 1));
  };
  alignas(32) double x[kAtOnce], y[kAtOnce], z[kAtOnce];
  for (size_t i = 0; i < kAtOnce; ++i) {
    const Vec3& r = body_.vertices[number(i)];
    x[i] = r.x(), y[i] = r.y(), z[i] = r.z();
  }
  Polynomials p;
  for (size_t k = 0; k < p.c.size(); ++k) {
    const Vec3 n = motion.series->direction[k].get(motion.lane);
    p.c[k] = hn::MulAdd(
        hn::Set(d, n.z()), hn::Load(d, z),
        hn::MulAdd(hn::Set(d, n.y()), hn::Load(d, y), hn::Mul(hn::Set(d, n.x()), hn::Load(d, x))));
  }
  p.c[0] = hn::Add(p.c[0], hn::Set(d, motion.height));
  p.c[1] = hn::Add(p.c[1], hn::Set(d, motion.rise));

  // A vertex that touches passes through, rests, or leaves: then its polynomial is divided by s (or
  // by s^2), so that it is the next contact that is looked for.
  const Mask touching = hn::Le(p.c[0], hn::Set(d, kTouching * size));
  if (!hn::AllFalse(d, touching)) {
    const double turn = motion.series->turn[0].get(motion.lane).norm();
    const double still = kStill * (std::abs(motion.rise) + turn * size);
    alignas(32) double height[kAtOnce], slope[kAtOnce], bend[kAtOnce];
    hn::Store(p.c[0], d, height);
    hn::Store(p.c[1], d, slope);
    hn::Store(p.c[2], d, bend);
    for (size_t i = 0; i < vertices.size(); ++i) {
      if (height[i] > kTouching * size) continue;
      const bool rests = std::abs(slope[i]) <= still;
      if (rests ? bend[i] > 0 : slope[i] > 0) continue;
      if (end.part == 0 && (rests || end.end == FlightEnd::contact)) continue;
      end = {0, true, rests ? FlightEnd::resting : FlightEnd::contact, number(i)};
    }
    if (end.part == 0) return;
    const Mask rest = hn::And(touching, hn::Le(hn::Abs(p.c[1]), hn::Set(d, still)));
    p.divide(touching);
    p.divide(rest);
  }
  const Zeros zeros =
      first_zeros(p, hn::FirstN(d, vertices.size()), motion.free, end.part, kResolved * size);
  alignas(32) double parts[kAtOnce];
  hn::Store(zeros.s, d, parts);
  uint8_t found[8] = {};
  hn::StoreMaskBits(d, zeros.found, found);
  for (size_t i = 0; i < vertices.size(); ++i) {
    if (parts[i] >= end.part) continue;
    end = {parts[i], (found[0] >> i & 1U) != 0, FlightEnd::contact, number(i)};
  }
}

StepEnd ContactSearch::find(const SegmentMotion& motion, double part) {
  const Cubic cubic(motion, body_.outer_radius_m);
  StepEnd end{.part = part};
  solved_.clear();
  for (;;) {
    const double local = (end.part - motion.begin) / DirectionSegment::kLength;
    const Deepest deepest = find_deepest(cubic, static_cast<float>(local));
    const std::span found = std::span(deepest.vertex).first(deepest.count);
    for (size_t i = 0; i < found.size() && end.part > 0; i += kAtOnce) {
      solve(motion, found.subspan(i, std::min(kAtOnce, found.size() - i)), end);
    }
    if (!deepest.more || end.part == 0) return end;
    solved_.insert(solved_.end(), found.begin(), found.end());
  }
}

}  // namespace pilesim
