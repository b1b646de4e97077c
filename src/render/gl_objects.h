// Owners of OpenGL names. All of them need their context to be current, also when they end.
#pragma once

#define GL_GLEXT_PROTOTYPES
#include <GL/glcorearb.h>

#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>

namespace pilesim {

// `Traits::create()` returns a name, `Traits::destroy(name)` frees it; 0 is no object.
template <typename Traits>
class GlObject {
 public:
  GlObject() : name_(Traits::create()) {}
  ~GlObject() {
    if (name_ != 0) Traits::destroy(name_);
  }
  GlObject(GlObject&& other) noexcept : name_(std::exchange(other.name_, 0)) {}
  GlObject& operator=(GlObject&& other) noexcept {
    std::swap(name_, other.name_);
    return *this;
  }
  GLuint name() const { return name_; }

 private:
  GLuint name_;
};

struct GlTextureTraits {
  static GLuint create();
  static void destroy(GLuint name);
};
struct GlBufferTraits {
  static GLuint create();
  static void destroy(GLuint name);
};
struct GlFramebufferTraits {
  static GLuint create();
  static void destroy(GLuint name);
};
struct GlVertexArrayTraits {
  static GLuint create();
  static void destroy(GLuint name);
};
using GlTexture = GlObject<GlTextureTraits>;
using GlBuffer = GlObject<GlBufferTraits>;
using GlFramebuffer = GlObject<GlFramebufferTraits>;
using GlVertexArray = GlObject<GlVertexArrayTraits>;

// Throws Error(usage) if the driver cannot draw targets of this size with so many samples.
void check_limits(int width, int height, int samples);

// A texture of one level that can be drawn into. `samples` 0: an ordinary 2-D texture, clamped to
// its edge and filtered with `filter`; above: a multisample texture. Throws Error(usage) without
// memory for it.
GlTexture make_target(GLenum internal_format, int width, int height, int samples = 0,
                      GLint filter = GL_NEAREST);

// A framebuffer of these, fragment shader output i into `colours[i]` (`depth` 0: none). Throws
// Error(internal) if the driver cannot draw into it.
GlFramebuffer make_framebuffer(std::initializer_list<GLuint> colours, GLuint depth = 0,
                               int samples = 0);

class GlProgram {
 public:
  // GLSL 3.30 sources without the #version line. Throws Error(internal) with the compiler's words.
  GlProgram(std::string_view name, std::string_view vertex_source,
            std::string_view fragment_source);
  ~GlProgram();
  GlProgram(const GlProgram&) = delete;
  GlProgram& operator=(const GlProgram&) = delete;

  void use() const;
  // -1 (ignored by glUniform*) for a uniform that the compiler has removed.
  GLint uniform(const char* name) const;

 private:
  GLuint name_ = 0;
};

}  // namespace pilesim
