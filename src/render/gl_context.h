// An OpenGL core context without a window. OSMesa is behind this interface and nowhere else; the
// gl* functions come from its library.
#pragma once

#include <memory>

namespace pilesim {

class GlContext {
 public:
  // Throws Error(internal) if no OpenGL 3.3 core context can be made.
  GlContext();
  ~GlContext();
  GlContext(const GlContext&) = delete;
  GlContext& operator=(const GlContext&) = delete;

  // Directs the gl* calls of this thread here. A context is current in one thread at a time.
  void make_current();
  // Leaves this thread without a context.
  void release();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace pilesim
