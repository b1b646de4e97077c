#include "render/gl_context.h"

#include <GL/osmesa.h>

#include <array>
#include <cstdint>

#include "core/error.h"

namespace pilesim {

struct GlContext::State {
  OSMesaContext context = nullptr;
  // OSMesa wants a window-like surface; everything is drawn into framebuffer objects instead.
  std::array<uint8_t, 64> surface{};  // 4 x 4 pixels of 4 bytes
};

GlContext::GlContext() : state_(std::make_unique<State>()) {
  const int attributes[] = {OSMESA_FORMAT,
                            OSMESA_RGBA,
                            OSMESA_PROFILE,
                            OSMESA_CORE_PROFILE,
                            OSMESA_CONTEXT_MAJOR_VERSION,
                            3,
                            OSMESA_CONTEXT_MINOR_VERSION,
                            3,
                            0};
  state_->context = OSMesaCreateContextAttribs(attributes, nullptr);
  if (state_->context == nullptr) {
    throw Error(ErrorKind::internal,
                Problem{.found = "OSMesa made no OpenGL 3.3 core context",
                        .remedy = "Install Debian's libosmesa6 22.3 or later, and unset MESA_* and "
                                  "GALLIUM_DRIVER in the environment"});
  }
  make_current();
}

GlContext::~GlContext() {
  // Whoever has it current must not keep a dangling one.
  if (OSMesaGetCurrentContext() == state_->context) release();
  OSMesaDestroyContext(state_->context);
}

void GlContext::make_current() {
  if (OSMesaGetCurrentContext() == state_->context) return;
  if (OSMesaMakeCurrent(state_->context, state_->surface.data(), GL_UNSIGNED_BYTE, 4, 4) == 0) {
    throw Error(ErrorKind::internal, Problem{.found = "OSMesa cannot make its context current"});
  }
}

void GlContext::release() { OSMesaMakeCurrent(nullptr, nullptr, 0, 0, 0); }

}  // namespace pilesim
