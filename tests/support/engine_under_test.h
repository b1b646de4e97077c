// The exact engine that tests try.
#pragma once

#include <cstdlib>
#include <string>

#include "scene/scene.h"

namespace pilesim {

// That of the environment variable, so that the same tests try each engine.
inline EngineKind engine_under_test() {
  const char* name = std::getenv("PILESIM_ENGINE_UNDER_TEST");
  return name != nullptr && std::string(name) == "bullet" ? EngineKind::bullet : EngineKind::exact;
}

}  // namespace pilesim
