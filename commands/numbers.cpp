#include "numbers.h"

#include <charconv>
#include <utility>

#include "core/text.h"

namespace pilesim {
namespace {

std::string phrase(WholeRange range) {
  return std::to_string(range.least) + " to " + std::to_string(range.most);
}

std::string phrase(RealRange range) {
  const std::string least = with_digits(range.least, 6), most = with_digits(range.most, 6);
  return range.excludes_least ? "above " + least + ", at most " + most : least + " to " + most;
}

CLI::ValidationError refusal(const std::string& option, std::string_view text,
                             const std::string& expected) {
  return CLI::ValidationError(option, "'" + std::string(text) + "' is not " + expected);
}

}  // namespace

std::optional<uint64_t> take_whole_number(std::string_view& text) {
  uint64_t number = 0;
  const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (fault != std::errc()) return std::nullopt;
  text.remove_prefix(static_cast<size_t>(end - text.data()));
  return number;
}

uint64_t parse_whole_number(std::string_view text, WholeRange range, const std::string& option) {
  std::string_view rest = text;
  const std::optional<uint64_t> number = take_whole_number(rest);
  if (number && rest.empty() && *number >= range.least && *number <= range.most) return *number;
  throw refusal(option, text, "an integer from " + phrase(range));
}

double parse_real_number(std::string_view text, RealRange range, const std::string& option) {
  double number = 0;
  const char* const end = text.data() + text.size();
  const auto [rest, fault] = std::from_chars(text.data(), end, number);
  const bool is_within = (range.excludes_least ? number > range.least : number >= range.least) &&
                         number <= range.most;  // both false of what is no number
  if (fault == std::errc() && rest == end && is_within) return number;
  throw refusal(option, text,
                (range.excludes_least ? "a number " : "a number from ") + phrase(range));
}

CLI::Option* add_whole_number(CLI::App& command, const std::string& name, WholeRange range,
                              std::function<void(uint64_t)> take, const std::string& description) {
  const auto read = [name, range, take = std::move(take)](const std::string& text) {
    take(parse_whole_number(text, range, name));
  };
  return command
      .add_option_function<std::string>(name, read, description + " (" + phrase(range) + ")")
      ->type_name("N");
}

CLI::Option* add_real_number(CLI::App& command, const std::string& name, RealRange range,
                             std::function<void(double)> take, const std::string& description) {
  const auto read = [name, range, take = std::move(take)](const std::string& text) {
    take(parse_real_number(text, range, name));
  };
  return command
      .add_option_function<std::string>(name, read, description + " (" + phrase(range) + ")")
      ->type_name("NUMBER");
}

}  // namespace pilesim
