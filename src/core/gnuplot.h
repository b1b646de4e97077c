// Charts, all drawn by gnuplot and in one style. Functions throw Error(io) where gnuplot is missing
// or fails.
#pragma once

#include <filesystem>
#include <string>

namespace pilesim {

// A single plot: settings, elements and, after them, an inline block of data for each.
class Plot {
 public:
  explicit Plot(std::string settings) : settings_(std::move(settings)) {}

  // `element`: "with lines title 'a'". `rows`: a line of numbers each.
  void add(const std::string& element, const std::string& rows) {
    elements_ += (elements_.empty() ? "plot '-' " : ", '-' ") + element;
    data_ += rows + "e\n";
  }
  std::string script() const { return settings_ + elements_ + "\n" + data_; }

 private:
  std::string settings_, elements_, data_;
};

// `text` for a script, in quotes; characters that would end it become spaces.
std::string quoted(std::string text);

// The picture of a script as an <svg> element that may stand in a page, px.
std::string draw_svg(const std::string& script, int width, int height);

// The bytes of a PNG file, px.
std::string draw_png(const std::string& script, int width, int height, double font_scale = 1);

// Writes them. Throws Error(io) also where that fails.
void write_png_chart(const std::filesystem::path& file, const std::string& script, int width,
                     int height);

}  // namespace pilesim
