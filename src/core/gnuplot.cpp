#include "core/gnuplot.h"

#include "core/atomic_file.h"
#include "core/subprocess.h"
#include "core/text.h"

namespace pilesim {
namespace {

constexpr const char* kStyle =
    "set border 3 lc rgb '#888888'\nset tics nomirror textcolor rgb '#444444'\n"
    "set key textcolor rgb '#444444' samplen 1.5 noenhanced\n";

// gnuplot prints the picture to its stdout.
std::string draw(const std::string& terminal, const std::string& script) {
  return run_program({"gnuplot"}, "gnuplot-nox",
                     "set terminal " + terminal + " background '#ffffff'\n" + kStyle + script);
}

std::string size_of(int width, int height) {
  return " size " + std::to_string(width) + "," + std::to_string(height);
}

}  // namespace

std::string quoted(std::string text) {
  for (char& c : text) c = c == '\'' || c == '\n' ? ' ' : c;
  return "'" + text + "'";
}

std::string draw_svg(const std::string& script, int width, int height) {
  const std::string document =
      draw("svg" + size_of(width, height) + " dynamic font 'sans-serif,12'", script);
  return document.substr(document.find("<svg"));
}

std::string draw_png(const std::string& script, int width, int height, double font_scale) {
  return draw("pngcairo" + size_of(width, height) + " font 'sans,11' fontscale " +
                  with_digits(font_scale, 3),
              script);
}

void write_png_chart(const std::filesystem::path& file, const std::string& script, int width,
                     int height) {
  write_file_atomically(file, draw_png(script, width, height));
}

}  // namespace pilesim
