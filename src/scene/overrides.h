// Values of a scene that the command line sets: --set /json/pointer=value.
#pragma once

#include <string>

#include "core/error.h"
#include "json/json_text.h"

namespace pilesim {

struct Override {
  std::string text;  // "/seed=3"
  std::string pointer;
  Json value;

  // Stands for the file in messages: "--set /seed=3".
  std::string place() const;
};

// Throws Error(input) where `text` is not /POINTER=VALUE. A VALUE that is no JSON is a string.
Override parse_override(const std::string& text);

// Sets the value. Objects on the way are made where missing; array entries must be there, else
// throws Error(input). A light that is named starts from that light, and a sky from a file without
// a sun, whatever keys a run has stored.
void apply_override(const Override& change, Json& document);

// Whether the values of other overrides, written as `text` is, come after it.
bool stands_for_others(const std::string& text);

// Throws Error(input), with the names there are, where `change` sets something of a material, shape
// or variable that `document`, which is an object, does not have, and that nothing in it names once
// all overrides are in it (`changed`): a misspelling would have no effect.
void check_is_named(const Override& change, const Json& document, const Json& changed);

// Whether the JSON pointer `pointer` is `ancestor` or inside it.
bool is_at_or_below(const std::string& pointer, const std::string& ancestor);

}  // namespace pilesim
