#include "print.h"

#include <cstdarg>
#include <cstdio>

#include "core/printable.h"

namespace pilesim {

void print(const char* format, ...) {
  va_list arguments, again;
  va_start(arguments, format);
  va_copy(again, arguments);
  const int length = std::vsnprintf(nullptr, 0, format, arguments);
  va_end(arguments);
  std::string text(length > 0 ? static_cast<size_t>(length) : 0, '\0');
  std::vsnprintf(text.data(), text.size() + 1, format, again);
  va_end(again);
  std::fputs(printable_lines(text).c_str(), stdout);
}

void print_line(const std::string& text) { print("%s\n", printable(text).c_str()); }

void warn(const std::string& text) {
  std::fprintf(stderr, "pilesim: warning: %s\n", printable(text).c_str());
}

}  // namespace pilesim
