#include "render/gl_objects.h"

#include <algorithm>
#include <array>
#include <vector>

#include "core/error.h"

namespace pilesim {

GLuint GlTextureTraits::create() {
  GLuint name = 0;
  glGenTextures(1, &name);
  return name;
}
void GlTextureTraits::destroy(GLuint name) { glDeleteTextures(1, &name); }

GLuint GlBufferTraits::create() {
  GLuint name = 0;
  glGenBuffers(1, &name);
  return name;
}
void GlBufferTraits::destroy(GLuint name) { glDeleteBuffers(1, &name); }

GLuint GlFramebufferTraits::create() {
  GLuint name = 0;
  glGenFramebuffers(1, &name);
  return name;
}
void GlFramebufferTraits::destroy(GLuint name) { glDeleteFramebuffers(1, &name); }

GLuint GlVertexArrayTraits::create() {
  GLuint name = 0;
  glGenVertexArrays(1, &name);
  return name;
}
void GlVertexArrayTraits::destroy(GLuint name) { glDeleteVertexArrays(1, &name); }

namespace {

struct PixelFormat {
  GLenum format, type;
};

// Format that glTexImage2D wants even without data.
PixelFormat transfer_format(GLenum internal_format) {
  switch (internal_format) {
    case GL_DEPTH_COMPONENT16:
    case GL_DEPTH_COMPONENT32F:
      return {GL_DEPTH_COMPONENT, GL_FLOAT};
    case GL_R32F:
      return {GL_RED, GL_FLOAT};
    default:
      return {GL_RGBA, GL_UNSIGNED_BYTE};
  }
}

// After the driver was asked for memory.
void check_memory(int width, int height) {
  if (glGetError() != GL_OUT_OF_MEMORY) return;
  throw Error(ErrorKind::usage,
              Problem{.found = "there is no memory for pictures of " + std::to_string(width) + "x" +
                               std::to_string(height) + " pixels",
                      .remedy = "Ask for a smaller --size or fewer --samples"});
}

GLuint compile(std::string_view program, GLenum stage, std::string_view source) {
  const GLuint shader = glCreateShader(stage);
  constexpr std::string_view kVersion = "#version 330 core\n";
  const std::array<const char*, 2> text = {kVersion.data(), source.data()};
  const std::array<GLint, 2> length = {static_cast<GLint>(kVersion.size()),
                                       static_cast<GLint>(source.size())};
  glShaderSource(shader, 2, text.data(), length.data());
  glCompileShader(shader);
  GLint compiled = 0;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &compiled);
  if (compiled == GL_TRUE) return shader;
  std::string log(4096, '\0');
  GLsizei log_length = 0;
  glGetShaderInfoLog(shader, static_cast<GLsizei>(log.size()), &log_length, log.data());
  log.resize(static_cast<size_t>(log_length));
  glDeleteShader(shader);
  throw Error(ErrorKind::internal,
              Problem{.file = std::string(program), .found = "shader does not compile: " + log});
}

}  // namespace

void check_limits(int width, int height, int samples) {
  GLint side = 0, colour_samples = 0, depth_samples = 0;
  std::array<GLint, 2> viewport{};
  glGetIntegerv(GL_MAX_TEXTURE_SIZE, &side);
  glGetIntegerv(GL_MAX_VIEWPORT_DIMS, viewport.data());
  glGetIntegerv(GL_MAX_COLOR_TEXTURE_SAMPLES, &colour_samples);
  glGetIntegerv(GL_MAX_DEPTH_TEXTURE_SAMPLES, &depth_samples);
  const int most_samples = std::min(colour_samples, depth_samples);
  const std::array<int, 2> most = {std::min(side, viewport[0]), std::min(side, viewport[1])};
  if (width > most[0] || height > most[1]) {
    throw Error(ErrorKind::usage,
                Problem{.pointer = "/render/size",
                        .found = "is " + std::to_string(width) + "x" + std::to_string(height),
                        .expected = "at most " + std::to_string(most[0]) + "x" +
                                    std::to_string(most[1]) + ", which this OSMesa can draw"});
  }
  if (samples > most_samples) {
    throw Error(ErrorKind::usage,
                Problem{.pointer = "/render/samples",
                        .found = "needs " + std::to_string(samples) + " samples at once",
                        .expected = "at most " + std::to_string(most_samples) +
                                    ", which this OSMesa can draw",
                        .remedy = "Ask for 1 sample"});
  }
}

GlTexture make_target(GLenum internal_format, int width, int height, int samples, GLint filter) {
  GlTexture texture;
  if (samples > 0) {
    glBindTexture(GL_TEXTURE_2D_MULTISAMPLE, texture.name());
    glTexImage2DMultisample(GL_TEXTURE_2D_MULTISAMPLE, samples, internal_format, width, height,
                            GL_TRUE);
    check_memory(width, height);
    return texture;
  }
  const PixelFormat transfer = transfer_format(internal_format);
  glBindTexture(GL_TEXTURE_2D, texture.name());
  glTexImage2D(GL_TEXTURE_2D, 0, static_cast<GLint>(internal_format), width, height, 0,
               transfer.format, transfer.type, nullptr);
  check_memory(width, height);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAX_LEVEL, 0);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, filter);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, filter);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  return texture;
}

GlFramebuffer make_framebuffer(std::initializer_list<GLuint> colours, GLuint depth, int samples) {
  const GLenum target = samples > 0 ? GL_TEXTURE_2D_MULTISAMPLE : GL_TEXTURE_2D;
  GlFramebuffer framebuffer;
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer.name());
  std::vector<GLenum> outputs;
  for (const GLuint colour : colours) {
    outputs.push_back(GL_COLOR_ATTACHMENT0 + static_cast<GLenum>(outputs.size()));
    glFramebufferTexture2D(GL_FRAMEBUFFER, outputs.back(), target, colour, 0);
  }
  glDrawBuffers(static_cast<GLsizei>(outputs.size()), outputs.data());
  glReadBuffer(outputs.empty() ? GL_NONE : outputs.front());
  if (depth != 0) glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, target, depth, 0);
  if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
    throw Error(ErrorKind::internal, Problem{.found = "OSMesa cannot draw into a framebuffer "
                                                      "that the renderer needs",
                                             .remedy = "Use Debian's libosmesa6 22.3 or later"});
  }
  return framebuffer;
}

GlProgram::GlProgram(std::string_view name, std::string_view vertex_source,
                     std::string_view fragment_source) {
  const GLuint vertex = compile(name, GL_VERTEX_SHADER, vertex_source);
  const GLuint fragment = compile(name, GL_FRAGMENT_SHADER, fragment_source);
  name_ = glCreateProgram();
  glAttachShader(name_, vertex);
  glAttachShader(name_, fragment);
  glLinkProgram(name_);
  glDeleteShader(vertex);
  glDeleteShader(fragment);
  GLint linked = 0;
  glGetProgramiv(name_, GL_LINK_STATUS, &linked);
  if (linked == GL_TRUE) return;
  std::string log(4096, '\0');
  GLsizei log_length = 0;
  glGetProgramInfoLog(name_, static_cast<GLsizei>(log.size()), &log_length, log.data());
  log.resize(static_cast<size_t>(log_length));
  glDeleteProgram(name_);
  throw Error(ErrorKind::internal,
              Problem{.file = std::string(name), .found = "shaders do not link: " + log});
}

GlProgram::~GlProgram() { glDeleteProgram(name_); }

void GlProgram::use() const { glUseProgram(name_); }

GLint GlProgram::uniform(const char* name) const { return glGetUniformLocation(name_, name); }

}  // namespace pilesim
