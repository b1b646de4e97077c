// Texts of options and keys of scenes, for man, shells and docs/reference/.
#include <filesystem>
#include <memory>

#include "core/atomic_file.h"
#include "json/schema_page.h"
#include "options.h"
#include "print.h"
#include "scene/scene_loader.h"

namespace pilesim {
namespace {

namespace fs = std::filesystem;

std::vector<const CLI::App*> shown_commands(const CLI::App& app) {
  std::vector<const CLI::App*> commands;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    if (!command->get_group().empty()) commands.push_back(command);
  }
  return commands;
}

std::vector<const CLI::Option*> shown_options(const CLI::App& command) {
  std::vector<const CLI::Option*> options;
  for (const CLI::Option* option : command.get_options()) {
    if (!option->get_group().empty()) options.push_back(option);
  }
  return options;
}

// Without the checks that CLI11 adds behind a colon.
std::string type_of(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  return type.substr(0, type.find(':'));
}

// "-o, --output FILE", "input"
std::string usage_of(const CLI::Option& option) {
  if (option.get_positional()) return option.get_name(true);
  std::string text;
  for (const std::string& name : option.get_snames()) text += (text.empty() ? "-" : ", -") + name;
  for (const std::string& name : option.get_lnames()) text += (text.empty() ? "--" : ", --") + name;
  if (option.get_expected_max() > 0 && !option.get_type_name().empty()) {
    text += ' ' + type_of(option);
  }
  return text;
}

std::string with(std::string text, const std::string& what, const std::string& by) {
  for (size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + by.size())) {
    text.replace(at, what.size(), by);
  }
  return text;
}

std::string markdown_of(const CLI::App& command, const std::string& name, int level) {
  std::string text = std::string(static_cast<size_t>(level), '#') + " " + name + "\n\n" +
                     command.get_description() + ".\n\n";
  for (const CLI::Option* option : shown_options(command)) {
    if (option == command.get_help_ptr()) continue;
    text += "- `" + usage_of(*option) + "`" + (option->get_required() ? " (required)" : "") + ": " +
            with(with(option->get_description(), "*", "\\*"), "<", "&lt;") + "\n";
  }
  if (!command.get_footer().empty()) text += "\n```text" + command.get_footer() + "\n```\n";
  for (const CLI::App* part : shown_commands(command)) {
    text += "\n" + markdown_of(*part, name + " " + part->get_name(), level + 1);
  }
  return text;
}

std::string markdown(const CLI::App& app) {
  std::string text =
      "# Commands\n\nMade by `pilesim reference markdown` of the options themselves; a test holds "
      "it "
      "to them. `pilesim COMMAND --help` says the same.\n";
  for (const CLI::App* command : shown_commands(app)) {
    text += "\n" + markdown_of(*command, "pilesim " + command->get_name(), 2);
  }
  return text;
}

// Text as troff shows it.
std::string roff(const std::string& text) {
  std::string safe = with(with(text, "\\", "\\e"), "-", "\\-");
  safe = with(safe, "\n.", "\n\\&.");
  return safe.starts_with('.') || safe.starts_with('\'') ? "\\&" + safe : safe;
}

std::string man_of(const CLI::App& command, const std::string& name) {
  std::string text = ".SS \"" + roff(name) + "\"\n" + roff(command.get_description()) + ".\n";
  for (const CLI::Option* option : shown_options(command)) {
    if (option == command.get_help_ptr()) continue;
    text += ".TP\n.B \"" + with(roff(usage_of(*option)), "\"", "\\(dq") + "\"\n" +
            roff(option->get_description()) + "\n";
  }
  if (!command.get_footer().empty()) text += ".PP\n.nf\n" + roff(command.get_footer()) + "\n.fi\n";
  for (const CLI::App* part : shown_commands(command)) {
    text += man_of(*part, name + " " + part->get_name());
  }
  return text;
}

std::string man(const CLI::App& app) {
  std::string text =
      ".TH PILESIM 1\n.SH NAME\npilesim \\- simulates and draws large piles of rigid objects\n"
      ".SH SYNOPSIS\n.B pilesim\nCOMMAND [OPTIONS]\n.SH COMMANDS\n";
  for (const CLI::App* command : shown_commands(app)) {
    text += man_of(*command, "pilesim " + command->get_name());
  }
  return text + ".SH NOTES\n.nf\n" + roff(app.get_footer()) + "\n.fi\n";
}

std::string long_options(const CLI::App& command) {
  std::string words;
  for (const CLI::Option* option : shown_options(command)) {
    for (const std::string& name : option->get_lnames())
      words += (words.empty() ? "--" : " --") + name;
  }
  for (const CLI::App* part : shown_commands(command)) words += ' ' + part->get_name();
  return words;
}

std::string bash(const CLI::App& app) {
  std::string names, cases;
  for (const CLI::App* command : shown_commands(app)) {
    names += (names.empty() ? "" : " ") + command->get_name();
    cases += "    " + command->get_name() + ") words=\"" + long_options(*command) + "\" ;;\n";
  }
  return "# bash completion of pilesim, made by pilesim reference bash\n"
         "_pilesim() {\n"
         "  local word=\"${COMP_WORDS[COMP_CWORD]}\" words\n"
         "  if [ \"$COMP_CWORD\" -eq 1 ]; then\n"
         "    COMPREPLY=($(compgen -W \"" +
         names +
         " --help --version\" -- \"$word\"))\n"
         "    return\n"
         "  fi\n"
         "  case \"${COMP_WORDS[1]}\" in\n" +
         cases +
         "  esac\n"
         "  case \"$word\" in\n"
         "    -*) COMPREPLY=($(compgen -W \"$words\" -- \"$word\")) ;;\n"
         "    *) COMPREPLY=($(compgen -f -- \"$word\")) ;;\n"
         "  esac\n"
         "}\n"
         "complete -o filenames -F _pilesim pilesim\n";
}

// In single quotes, within brackets.
std::string zsh_text(const std::string& text) {
  return with(with(with(with(text, "'", "'\\''"), "[", "\\["), "]", "\\]"), ":", "\\:");
}

std::string zsh(const CLI::App& app) {
  std::string names, cases;
  for (const CLI::App* command : shown_commands(app)) {
    names += "    '" + command->get_name() + ":" + zsh_text(command->get_description()) + "'\n";
    cases += "    " + command->get_name() + ") _arguments";
    for (const CLI::Option* option : shown_options(*command)) {
      for (const std::string& name : option->get_lnames()) {
        const bool takes = option->get_expected_max() > 0;
        cases += " \\\n      '--" + name + "[" + zsh_text(option->get_description()) + "]" +
                 (takes ? ":" + zsh_text(type_of(*option)) + ":_files" : "") + "'";
      }
    }
    cases += " \\\n      '*:file:_files' ;;\n";
  }
  return "#compdef pilesim\n# Made by pilesim reference zsh\n_pilesim() {\n  local -a "
         "commands=(\n" +
         names +
         "  )\n  if (( CURRENT == 2 )); then\n    _describe command commands\n    return\n  fi\n"
         "  local name=$words[2]\n  shift words\n  (( CURRENT-- ))\n  case $name in\n" +
         cases + "  esac\n}\n_pilesim \"$@\"\n";
}

std::string scene_page() {
  return "# The keys of a scene\n\nMade by `pilesim reference scene` of the list that reads "
         "scenes; "
         "a test holds it to that. [scene.md](../scene.md) explains them. Keys in bold must be "
         "given. "
         "In place of any value may stand [a variable](../authoring.md#variables) or "
         "[a draw](../authoring.md#drawn-by-the-seed).\n" +
         schema_page(parse_json(scene_schema(), "schema"), "scene");
}

}  // namespace

void add_reference_command(CLI::App& app) {
  struct Arguments {
    std::string form;
    std::string output;
  };
  auto options = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand(
      "reference", "Print what all options, or all keys of a scene, say of themselves");
  command->group("");
  command->add_option("form", options->form, "man, bash, zsh, markdown or scene")
      ->required()
      ->check(CLI::IsMember({"man", "bash", "zsh", "markdown", "scene"}));
  command->add_option("-o,--output", options->output, "A file instead of standard output")
      ->type_name("FILE");
  command->callback([options, &app] {
    const std::string text = options->form == "man"     ? man(app)
                             : options->form == "bash"  ? bash(app)
                             : options->form == "zsh"   ? zsh(app)
                             : options->form == "scene" ? scene_page()
                                                        : markdown(app);
    if (options->output.empty()) {
      print("%s", text.c_str());
    } else {
      write_file_atomically(options->output, text);
    }
  });
}

}  // namespace pilesim
