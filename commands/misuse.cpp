#include "misuse.h"

#include <algorithm>
#include <vector>

#include "json/problem_log.h"

namespace pilesim {
namespace {

// "Did you mean "simulate"?" behind a space, or nothing.
std::string meant(const std::string& word, const std::vector<std::string>& names) {
  const std::string question = did_you_mean(word, names);
  return question.empty() ? question : " " + question;
}

std::vector<std::string> command_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command :
       app.get_subcommands([](const CLI::App* one) { return !one->get_group().empty(); })) {
    names.push_back(command->get_name());
  }
  return names;
}

std::string no_command(const CLI::App& app, int argc, const char* const* argv) {
  const std::vector<std::string> names = command_names(app);
  std::string text = "expected a command:";
  for (const std::string& name : names) text += (name == names.front() ? " " : ", ") + name;
  if (argc < 2) return text;
  const std::string word = argv[1];
  return "'" + word + "' is no command; " + text + '.' + meant(word, names);
}

std::string no_option(const CLI::App& command, std::vector<std::string> words) {
  const auto is_option = [](const std::string& word) { return word.starts_with('-'); };
  // The first option, or else the first word: the words behind an option belong to it.
  const auto found = std::ranges::find_if(words, is_option);
  if (found == words.end()) return "'" + words.front() + "' is one word too many";
  std::vector<std::string> names;
  for (const CLI::Option* option : command.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  const std::string word = found->substr(0, found->find('='));
  return "'" + word + "' is no option of " + command.get_name() + '.' + meant(word, names);
}

}  // namespace

std::string misuse_text(const CLI::App& app, const CLI::ParseError& error, int argc,
                        const char* const* argv) {
  const std::vector<CLI::App*> chosen = app.get_subcommands();
  if (chosen.empty()) {
    const bool begins_with_option = argc > 1 && argv[1][0] == '-';
    return begins_with_option ? error.what() : no_command(app, argc, argv);
  }
  const bool is_extra = error.get_exit_code() == static_cast<int>(CLI::ExitCodes::ExtrasError);
  std::vector<std::string> words = chosen.front()->remaining();
  if (!is_extra || words.empty()) return error.what();
  return no_option(*chosen.front(), std::move(words));
}

}  // namespace pilesim
