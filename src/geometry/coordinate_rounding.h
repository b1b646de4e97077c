// How coarsely the coordinates of a file are rounded, told from the coordinates themselves.
#pragma once

namespace pilesim {

// Coordinates in single precision, as importers give them, have seven digits; in double, fifteen. A
// file whose coordinates all have fewer was written with fewer: six by many programs. With less
// than five a mesh is taken for designed in round numbers.
class CoordinateRounding {
 public:
  explicit CoordinateRounding(bool is_double = false) : most_digits_(is_double ? 15 : 7) {}

  void add(double coordinate);

  // The greatest distance by which rounding may have moved a point, in the unit of the coordinates:
  // half a unit in the last digit of the largest of them, along each axis. 0 without any.
  double bound() const;

 private:
  int most_digits_;
  int digits_ = 5;
  double largest_ = 0;
};

}  // namespace pilesim
