#include "render/raster_hits.h"

#include <algorithm>
#include <cassert>
#include <cstddef>

#include "render/gl_context.h"
#include "render/gl_objects.h"
#include "render/shaders.h"

namespace pilesim {
namespace {

// OpenGL takes offsets into a bound buffer where pointers were once.
// NOLINTNEXTLINE(performance-no-int-to-ptr)
const void* offset(size_t bytes) { return reinterpret_cast<const void*>(bytes); }

template <typename T>
void fill(GLenum target, const std::vector<T>& values, GLenum usage) {
  glBufferData(target, static_cast<GLsizeiptr>(values.size() * sizeof(T)), values.data(), usage);
}

// What hits.vert gets of each body.
struct PlacedBody {
  Vec3f position;                    // m, camera frame
  std::array<float, 4> orientation;  // x y z w, to the camera frame
  uint32_t number = 0;               // body + 1
};

// Triangles of a shape, as in the trajectory.
struct ShapeRange {
  uint32_t first_vertex = 0, first_index = 0, index_count = 0;
  double radius_m = 0;  // about the body's origin
};

}  // namespace

struct RasterHits::State {
  const TrajectoryHeader& header;
  int width, height;
  GlContext context;
  GlProgram hits_program{"hits", shaders::hits_vert, shaders::hits_frag};
  GlProgram outline_program{"outline", shaders::hits_vert, shaders::outline_frag};
  GlTexture hits, depth, covered;
  GlFramebuffer hits_frame, covered_frame;
  GlVertexArray array;
  GlBuffer vertices, indices, instances;
  std::vector<ShapeRange> shapes;
  double near_m;
  Pinhole camera;
  std::vector<PlacedBody> placed;  // those present with a mesh, ordered by body
  std::vector<size_t> place;       // (B) into `placed`, its size: none
  std::vector<uint32_t> texels;    // as they come from OpenGL

  State(const TrajectoryHeader& told, int told_width, int told_height);
  void fill_shapes();
  void set_up(const GlProgram& program, int tile_column, int tile_row) const;
  // `count` bodies of one shape.
  void draw(size_t first, size_t count) const;
  void read(const PixelBox& box, GLenum format, size_t channels);
  void outline_tile(size_t at, int tile_column, int tile_row, Silhouette& silhouette);
};

RasterHits::State::State(const TrajectoryHeader& told, int told_width, int told_height)
    : header(told), width(told_width), height(told_height), near_m(nearest_depth(told)) {
  check_limits(width, height, 0);
  hits = make_target(GL_RG32UI, width, height);
  depth = make_target(GL_DEPTH_COMPONENT32F, width, height);
  covered = make_target(GL_R32UI, width, height);
  hits_frame = make_framebuffer({hits.name()}, depth.name());
  covered_frame = make_framebuffer({covered.name()});
  fill_shapes();
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
}

void RasterHits::State::fill_shapes() {
  std::vector<Vec3f> all_vertices;
  std::vector<std::array<uint32_t, 3>> all_triangles;
  for (const TrajectoryShape& shape : header.shapes) {
    ShapeRange range{.first_vertex = static_cast<uint32_t>(all_vertices.size()),
                     .first_index = static_cast<uint32_t>(3 * all_triangles.size()),
                     .index_count = static_cast<uint32_t>(3 * shape.triangles.size())};
    for (const Vec3f& vertex : shape.vertices) {
      range.radius_m = std::max<double>(range.radius_m, vertex.norm());
    }
    all_vertices.insert(all_vertices.end(), shape.vertices.begin(), shape.vertices.end());
    all_triangles.insert(all_triangles.end(), shape.triangles.begin(), shape.triangles.end());
    shapes.push_back(range);
  }
  glBindVertexArray(array.name());
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, indices.name());
  fill(GL_ELEMENT_ARRAY_BUFFER, all_triangles, GL_STATIC_DRAW);
  glBindBuffer(GL_ARRAY_BUFFER, vertices.name());
  fill(GL_ARRAY_BUFFER, all_vertices, GL_STATIC_DRAW);
  glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, sizeof(Vec3f), nullptr);
  for (GLuint attribute = 0; attribute < 4; ++attribute) {
    glEnableVertexAttribArray(attribute);
    if (attribute > 0) glVertexAttribDivisor(attribute, 1);
  }
}

// The picture is the middle one of nine tiles; rows of tiles count downwards.
void RasterHits::State::set_up(const GlProgram& program, int tile_column, int tile_row) const {
  program.use();
  // OpenGL's rows count upwards, and so do those that are read: what is drawn stands on its head
  // there, and comes out upright.
  const double x = 2 * camera.fx / width, y = 2 * camera.fy / height;
  const double x0 = (2 * camera.cx + 1) / width - 1 - 2 * tile_column;
  const double y0 = (2 * camera.cy + 1) / height - 1 - 2 * tile_row;
  glUniform4f(program.uniform("scale_and_offset"), static_cast<float>(x), static_cast<float>(y),
              static_cast<float>(x0), static_cast<float>(y0));
  glUniform1f(program.uniform("near_m"), static_cast<float>(near_m));
  glViewport(0, 0, width, height);
}

void RasterHits::State::draw(size_t first, size_t count) const {
  const ShapeRange& shape = shapes[header.body_shape[placed[first].number - 1]];
  const size_t base = first * sizeof(PlacedBody);
  glVertexAttribPointer(1, 3, GL_FLOAT, GL_FALSE, sizeof(PlacedBody),
                        offset(base + offsetof(PlacedBody, position)));
  glVertexAttribPointer(2, 4, GL_FLOAT, GL_FALSE, sizeof(PlacedBody),
                        offset(base + offsetof(PlacedBody, orientation)));
  glVertexAttribIPointer(3, 1, GL_UNSIGNED_INT, sizeof(PlacedBody),
                         offset(base + offsetof(PlacedBody, number)));
  glDrawElementsInstancedBaseVertex(GL_TRIANGLES, static_cast<GLsizei>(shape.index_count),
                                    GL_UNSIGNED_INT, offset(shape.first_index * sizeof(uint32_t)),
                                    static_cast<GLsizei>(count),
                                    static_cast<GLint>(shape.first_vertex));
}

void RasterHits::State::read(const PixelBox& box, GLenum format, size_t channels) {
  texels.resize(static_cast<size_t>(box.width) * static_cast<size_t>(box.height) * channels);
  glReadPixels(box.column, box.row, box.width, box.height, format, GL_UNSIGNED_INT, texels.data());
}

void RasterHits::State::outline_tile(size_t at, int tile_column, int tile_row,
                                     Silhouette& silhouette) {
  const PixelBox& box = silhouette.box;
  const int left = std::max(box.column, tile_column * width);
  const int top = std::max(box.row, tile_row * height);
  const int columns = std::min(box.column + box.width, (tile_column + 1) * width) - left;
  const int rows = std::min(box.row + box.height, (tile_row + 1) * height) - top;
  if (columns <= 0 || rows <= 0) return;
  set_up(outline_program, tile_column, tile_row);
  const PixelBox in_tile = {left - tile_column * width, top - tile_row * height, columns, rows};
  glScissor(in_tile.column, in_tile.row, in_tile.width, in_tile.height);
  const std::array<GLuint, 4> nothing{};
  glClearBufferuiv(GL_COLOR, 0, nothing.data());
  draw(at, 1);
  read(in_tile, GL_RED_INTEGER, 1);
  for (int row = 0; row < rows; ++row) {
    const auto from = texels.begin() + static_cast<ptrdiff_t>(row) * columns;
    const auto to = silhouette.covered.begin() +
                    static_cast<ptrdiff_t>(top - box.row + row) * box.width + (left - box.column);
    std::transform(from, from + columns, to, [](uint32_t texel) { return texel != 0 ? 1 : 0; });
  }
}

RasterHits::RasterHits(const TrajectoryHeader& header, int width, int height)
    : state_(std::make_unique<State>(header, width, height)) {}

RasterHits::~RasterHits() { state_->context.make_current(); }

void RasterHits::look(const TrajectoryFrame& frame, const Pinhole& camera) {
  State& state = *state_;
  assert(camera.width == state.width && camera.height == state.height);
  state.context.make_current();
  state.camera = camera;
  state.placed.clear();
  const size_t bodies = state.header.body_count();
  state.place.assign(bodies, bodies);
  const TrajectoryFrame seen = in_camera(frame, camera);
  for (size_t body = 0; body < bodies; ++body) {
    if ((frame.state[body] & kPresent) == 0) continue;
    if (state.shapes[state.header.body_shape[body]].index_count == 0) continue;
    const Quatf& q = seen.orientation[body];
    state.place[body] = state.placed.size();
    state.placed.push_back(
        {seen.position[body], {q.x(), q.y(), q.z(), q.w()}, static_cast<uint32_t>(body + 1)});
  }
  glBindVertexArray(state.array.name());
  glBindBuffer(GL_ARRAY_BUFFER, state.instances.name());
  fill(GL_ARRAY_BUFFER, state.placed, GL_STREAM_DRAW);
}

void RasterHits::find_hits(SurfaceHits& hits) {
  State& state = *state_;
  state.context.make_current();
  glBindFramebuffer(GL_FRAMEBUFFER, state.hits_frame.name());
  state.set_up(state.hits_program, 0, 0);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_GREATER);
  const std::array<GLuint, 4> nothing{};
  const float farthest = 0;
  glClearBufferuiv(GL_COLOR, 0, nothing.data());
  glClearBufferfv(GL_DEPTH, 0, &farthest);
  glBindVertexArray(state.array.name());
  glBindBuffer(GL_ARRAY_BUFFER, state.instances.name());
  const auto shape_at = [&](size_t i) {
    return state.header.body_shape[state.placed[i].number - 1];
  };
  for (size_t first = 0, end = 0; first < state.placed.size(); first = end) {
    while (end < state.placed.size() && shape_at(end) == shape_at(first)) ++end;
    state.draw(first, end - first);
  }
  glDisable(GL_DEPTH_TEST);
  hits.resize(state.width, state.height);
  state.read({0, 0, state.width, state.height}, GL_RG_INTEGER, 2);
  for (size_t i = 0; i < hits.instance.size(); ++i) {
    hits.instance[i] = state.texels[2 * i];
    hits.triangle[i] = state.texels[2 * i + 1];
  }
}

void RasterHits::outline(size_t body, Silhouette& silhouette) {
  State& state = *state_;
  silhouette = {};
  const size_t at = state.place[body];
  if (at >= state.placed.size()) return;
  const PlacedBody& placed = state.placed[at];
  silhouette.box =
      silhouette_box(state.camera, placed.position.cast<double>(),
                     state.shapes[state.header.body_shape[body]].radius_m, state.near_m);
  const PixelBox& box = silhouette.box;
  if (box.width == 0) return;
  silhouette.covered.assign(static_cast<size_t>(box.width) * static_cast<size_t>(box.height), 0);
  state.context.make_current();
  glBindFramebuffer(GL_FRAMEBUFFER, state.covered_frame.name());
  glBindVertexArray(state.array.name());
  glBindBuffer(GL_ARRAY_BUFFER, state.instances.name());
  glEnable(GL_SCISSOR_TEST);
  for (int tile_row = -1; tile_row <= 1; ++tile_row) {
    for (int tile_column = -1; tile_column <= 1; ++tile_column) {
      state.outline_tile(at, tile_column, tile_row, silhouette);
    }
  }
  glDisable(GL_SCISSOR_TEST);
}

}  // namespace pilesim
