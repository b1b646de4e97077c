#include "signature/collision_file.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>
#include <utility>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/text.h"

namespace pilesim {
namespace {

// A table is estimated from all of them at once, at some 300 bytes each.
constexpr size_t kMostCollisions = 5'000'000;
constexpr size_t kMostProblems = 50;
// Larger values are mistakes; the squares of smaller ones underflow in float.
constexpr double kMost = 1e6, kSlowestApproach = 1e-6;  // m/s, rad/s
constexpr double kUnitTolerance = 1e-3;                 // deviation of a normal's length from 1

struct Column {
  const char* name;
  Vec3 PlaneCollision::*vector;
  Eigen::Index component;
};
constexpr std::array kColumns = {Column{"normal_x", &PlaneCollision::normal, 0},
                                 Column{"normal_y", &PlaneCollision::normal, 1},
                                 Column{"normal_z", &PlaneCollision::normal, 2},
                                 Column{"vx_before_m_s", &PlaneCollision::velocity_before, 0},
                                 Column{"vy_before_m_s", &PlaneCollision::velocity_before, 1},
                                 Column{"vz_before_m_s", &PlaneCollision::velocity_before, 2},
                                 Column{"wx_before_rad_s", &PlaneCollision::spin_before, 0},
                                 Column{"wy_before_rad_s", &PlaneCollision::spin_before, 1},
                                 Column{"wz_before_rad_s", &PlaneCollision::spin_before, 2},
                                 Column{"vx_after_m_s", &PlaneCollision::velocity_after, 0},
                                 Column{"vy_after_m_s", &PlaneCollision::velocity_after, 1},
                                 Column{"vz_after_m_s", &PlaneCollision::velocity_after, 2},
                                 Column{"wx_after_rad_s", &PlaneCollision::spin_after, 0},
                                 Column{"wy_after_rad_s", &PlaneCollision::spin_after, 1},
                                 Column{"wz_after_rad_s", &PlaneCollision::spin_after, 2}};

std::string_view trimmed(std::string_view text) {
  const auto is_blank = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

void split(std::string_view line, std::vector<std::string_view>& fields) {
  fields.clear();
  for (size_t begin = 0; begin <= line.size();) {
    const size_t end = std::min(line.find(',', begin), line.size());
    fields.push_back(trimmed(line.substr(begin, end - begin)));
    begin = end + 1;
  }
}

std::optional<double> number_within_bounds(std::string_view text) {
  double value = 0;
  const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool whole = fault == std::errc() && end == text.data() + text.size();
  return whole && std::abs(value) <= kMost ? std::optional(value) : std::nullopt;
}

class Reader {
 public:
  explicit Reader(const std::filesystem::path& file) : file_(file.string()) {}

  CollisionFile read(std::string_view text) {
    for (size_t begin = 0; begin < text.size() && problems_.size() < kMostProblems;) {
      const size_t end = std::min(text.find('\n', begin), text.size());
      const std::string_view line = trimmed(text.substr(begin, end - begin));
      ++line_;
      begin = end + 1;
      if (line.empty()) continue;
      line_begin_ = line.data();
      split(line, fields_);
      if (columns_ > 0) {
        read_row();
      } else if (!read_header()) {
        break;
      }
    }
    if (columns_ == 0) {
      problems_.push_back(
          {.file = file_, .found = "is empty", .expected = "a line that names the columns"});
    }
    if (!problems_.empty()) throw Error(ErrorKind::input, std::move(problems_));
    return std::move(result_);
  }

 private:
  // Reports one field, or the whole line.
  void say(const std::string& found, const std::string& expected, const std::string& remedy = {},
           std::string_view field = {}) {
    const auto column = field.data() == nullptr ? 1 : field.data() - line_begin_ + 1;
    problems_.push_back({.file = file_,
                         .line = line_,
                         .column = static_cast<int>(column),
                         .found = found,
                         .expected = expected,
                         .remedy = remedy});
  }

  bool read_header() {
    columns_ = fields_.size();
    std::string missing;
    for (size_t i = 0; i < kColumns.size(); ++i) {
      const auto named = std::ranges::find(fields_, kColumns[i].name);
      if (named == fields_.end()) {
        missing += std::string(missing.empty() ? "" : ", ") + kColumns[i].name;
        continue;
      }
      place_[i] = static_cast<size_t>(named - fields_.begin());
      if (std::ranges::count(fields_, kColumns[i].name) > 1) {
        say("two columns " + std::string(kColumns[i].name), "one");
      }
    }
    if (!missing.empty()) {
      say("no column " + missing, "all columns of a collision",
          "docs/signatures.md lists them; pilesim sample-signature --write-collisions writes some");
    }
    for (const std::string_view name : fields_) {
      const auto is_it = [&](const Column& column) { return name == column.name; };
      if (std::ranges::none_of(kColumns, is_it)) result_.ignored.emplace_back(name);
    }
    return problems_.empty();
  }

  void read_row() {
    if (fields_.size() != columns_) {
      return say(std::to_string(fields_.size()) + " values",
                 std::to_string(columns_) + ", as the first line names");
    }
    if (result_.collisions.size() == kMostCollisions) {
      return say("more than " + grouped(kMostCollisions) + " collisions", "fewer",
                 "Leave some out, at random");
    }
    PlaneCollision collision;
    for (size_t i = 0; i < kColumns.size(); ++i) {
      const std::string_view field = fields_[place_[i]];
      const auto value = number_within_bounds(field);
      if (!value) {
        return say(std::string(kColumns[i].name) + " is \"" + std::string(field) + '"',
                   "a number of at most 1e6 in size", {}, field);
      }
      (collision.*kColumns[i].vector)(kColumns[i].component) = *value;
    }
    const double length = collision.normal.norm();
    if (!(std::abs(length - 1) <= kUnitTolerance)) {
      return say("the normal's length is " + with_digits(length, 6), "1");
    }
    collision.normal /= length;
    const double approach = collision.velocity_before.dot(collision.normal);
    if (!(approach <= -kSlowestApproach)) {
      return say("the velocity before is " + with_digits(approach, 6) + " m/s along the normal",
                 "a number below 0: the body approaches the plane",
                 "The normal points from the plane to the body");
    }
    result_.collisions.push_back(collision);
  }

  std::string file_;
  int line_ = 0;
  const char* line_begin_ = nullptr;
  size_t columns_ = 0;
  std::array<size_t, kColumns.size()> place_{};
  std::vector<std::string_view> fields_;
  std::vector<Problem> problems_;
  CollisionFile result_;
};

}  // namespace

CollisionFile read_collisions(const std::filesystem::path& file) {
  const std::string text = read_file(file);
  // Byte order mark that spreadsheets put before UTF-8.
  constexpr std::string_view kMark = "\xEF\xBB\xBF";
  return Reader(file).read(std::string_view(text).substr(text.starts_with(kMark) ? 3 : 0));
}

void write_collisions(const std::vector<PlaneCollision>& collisions,
                      const std::filesystem::path& file) {
  std::string text;
  for (const Column& column : kColumns)
    text += (text.empty() ? "" : ",") + std::string(column.name);
  for (const PlaneCollision& collision : collisions) {
    char before = '\n';
    for (const Column& column : kColumns) {
      text += std::exchange(before, ',');
      text += with_digits((collision.*column.vector)(column.component), 9);
    }
  }
  write_file_atomically(file, text + '\n');
}

}  // namespace pilesim
