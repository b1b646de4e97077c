#include "render/mesh_buffers.h"

#include <cstddef>

namespace pilesim {
namespace {

// OpenGL takes offsets into a bound buffer where pointers were once.
// NOLINTNEXTLINE(performance-no-int-to-ptr)
const void* offset(size_t bytes) { return reinterpret_cast<const void*>(bytes); }

template <typename T>
void fill(GLenum target, const std::vector<T>& values, GLenum usage) {
  glBufferData(target, static_cast<GLsizeiptr>(values.size() * sizeof(T)), values.data(), usage);
}

}  // namespace

MeshBuffers::MeshBuffers(std::span<const RenderMesh> meshes) {
  std::vector<RenderVertex> vertices;
  std::vector<uint32_t> indices;
  for (const RenderMesh& mesh : meshes) {
    meshes_.push_back({.first_vertex = static_cast<uint32_t>(vertices.size()),
                       .first_index = static_cast<uint32_t>(indices.size()),
                       .closed = mesh.closed,
                       .levels = mesh.levels,
                       .textures = {}});
    for (const std::shared_ptr<const MipMap>& texture : mesh.textures) {
      meshes_.back().textures.push_back(texture_of(*texture));
    }
    vertices.insert(vertices.end(), mesh.vertices.begin(), mesh.vertices.end());
    indices.insert(indices.end(), mesh.indices.begin(), mesh.indices.end());
  }
  glBindVertexArray(array_.name());
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, indices_.name());
  fill(GL_ELEMENT_ARRAY_BUFFER, indices, GL_STATIC_DRAW);
  glBindBuffer(GL_ARRAY_BUFFER, vertices_.name());
  fill(GL_ARRAY_BUFFER, vertices, GL_STATIC_DRAW);
  glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, sizeof(RenderVertex),
                        offset(offsetof(RenderVertex, position)));
  glVertexAttribPointer(1, 3, GL_FLOAT, GL_FALSE, sizeof(RenderVertex),
                        offset(offsetof(RenderVertex, normal)));
  glVertexAttribPointer(5, 4, GL_UNSIGNED_BYTE, GL_TRUE, sizeof(RenderVertex),
                        offset(offsetof(RenderVertex, paint)));
  glVertexAttribPointer(6, 2, GL_FLOAT, GL_FALSE, sizeof(RenderVertex),
                        offset(offsetof(RenderVertex, uv)));
  for (GLuint attribute = 0; attribute < 8; ++attribute) {
    glEnableVertexAttribArray(attribute);
    const bool is_of_mesh = attribute < 2 || attribute == 5 || attribute == 6;
    if (!is_of_mesh) glVertexAttribDivisor(attribute, 1);
  }
}

// With all levels as MipMap has them: the same for both renderers.
GLuint MeshBuffers::texture_of(const MipMap& texture) {
  const auto [found, is_new] = textures_.try_emplace(&texture);
  const GLuint name = found->second.name();
  if (!is_new) return name;
  glBindTexture(GL_TEXTURE_2D, name);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  for (size_t level = 0; level < texture.levels().size(); ++level) {
    const Texture& part = *texture.levels()[level];
    glTexImage2D(GL_TEXTURE_2D, static_cast<GLint>(level), GL_SRGB8, part.width, part.height, 0,
                 GL_RGB, GL_UNSIGNED_BYTE, part.pixels.data());
  }
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
  return name;  // they repeat, and are filtered linearly when near
}

void MeshBuffers::load(const DrawList& list) {
  list_ = &list;
  glBindBuffer(GL_ARRAY_BUFFER, instances_.name());
  fill(GL_ARRAY_BUFFER, list.instances, GL_STREAM_DRAW);
}

void MeshBuffers::bind_instances(const DrawBatch& batch) const {
  const size_t base = batch.first_instance * sizeof(Instance);
  glVertexAttribPointer(2, 3, GL_FLOAT, GL_FALSE, sizeof(Instance),
                        offset(base + offsetof(Instance, position)));
  glVertexAttribPointer(3, 4, GL_FLOAT, GL_FALSE, sizeof(Instance),
                        offset(base + offsetof(Instance, orientation)));
  glVertexAttribPointer(4, 4, GL_UNSIGNED_BYTE, GL_TRUE, sizeof(Instance),
                        offset(base + offsetof(Instance, material)));
  glVertexAttribPointer(7, 2, GL_FLOAT, GL_FALSE, sizeof(Instance),
                        offset(base + offsetof(Instance, pattern)));
  if (meshes_[batch.shape].closed) {
    glEnable(GL_CULL_FACE);
  } else {
    glDisable(GL_CULL_FACE);
  }
}

void MeshBuffers::draw_run(const DrawBatch& batch, uint32_t first_index,
                           uint32_t index_count) const {
  const Mesh& mesh = meshes_[batch.shape];
  glDrawElementsInstancedBaseVertex(
      GL_TRIANGLES, static_cast<GLsizei>(index_count), GL_UNSIGNED_INT,
      offset((mesh.first_index + first_index) * sizeof(uint32_t)),
      static_cast<GLsizei>(batch.instance_count),
      static_cast<GLint>(mesh.first_vertex + mesh.levels[batch.level].first_vertex));
}

template <typename Draw>
void MeshBuffers::for_each_batch(const Draw& draw) {
  glBindVertexArray(array_.name());
  glBindBuffer(GL_ARRAY_BUFFER, instances_.name());
  for (const DrawBatch& batch : list_->batches) {
    bind_instances(batch);
    draw(batch, meshes_[batch.shape].levels[batch.level]);
  }
  glDisable(GL_CULL_FACE);
}

void MeshBuffers::draw_all() {
  for_each_batch([&](const DrawBatch& batch, const MeshLevel& level) {
    draw_run(batch, level.first_index, level.index_count);
  });
}

void MeshBuffers::draw_batch(const DrawBatch& batch) {
  glBindVertexArray(array_.name());
  glBindBuffer(GL_ARRAY_BUFFER, instances_.name());
  bind_instances(batch);
  const MeshLevel& level = meshes_[batch.shape].levels[batch.level];
  draw_run(batch, level.first_index, level.index_count);
  glDisable(GL_CULL_FACE);
}

void MeshBuffers::draw_plain() {
  for_each_batch([&](const DrawBatch& batch, const MeshLevel& level) {
    for (const TextureRun& run : level.runs) {
      if (run.texture == 0) draw_run(batch, run.first_index, run.index_count);
    }
  });
}

void MeshBuffers::draw_textured() {
  glActiveTexture(GL_TEXTURE0);
  for_each_batch([&](const DrawBatch& batch, const MeshLevel& level) {
    for (const TextureRun& run : level.runs) {
      if (run.texture == 0) continue;
      glBindTexture(GL_TEXTURE_2D, meshes_[batch.shape].textures[run.texture - 1]);
      draw_run(batch, run.first_index, run.index_count);
    }
  });
}

}  // namespace pilesim
