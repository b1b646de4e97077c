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
    meshes_.push_back({static_cast<uint32_t>(vertices.size()),
                       static_cast<uint32_t>(indices.size()), mesh.closed, mesh.levels});
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
  for (GLuint attribute = 0; attribute < 6; ++attribute) {
    glEnableVertexAttribArray(attribute);
    if (attribute >= 2 && attribute < 5) glVertexAttribDivisor(attribute, 1);
  }
}

void MeshBuffers::draw(const DrawList& list) {
  glBindVertexArray(array_.name());
  glBindBuffer(GL_ARRAY_BUFFER, instances_.name());
  fill(GL_ARRAY_BUFFER, list.instances, GL_STREAM_DRAW);
  for (const DrawBatch& batch : list.batches) {
    const Mesh& mesh = meshes_[batch.shape];
    const MeshLevel& level = mesh.levels[batch.level];
    const size_t base = batch.first_instance * sizeof(Instance);
    glVertexAttribPointer(2, 3, GL_FLOAT, GL_FALSE, sizeof(Instance),
                          offset(base + offsetof(Instance, position)));
    glVertexAttribPointer(3, 4, GL_FLOAT, GL_FALSE, sizeof(Instance),
                          offset(base + offsetof(Instance, orientation)));
    glVertexAttribPointer(4, 4, GL_UNSIGNED_BYTE, GL_TRUE, sizeof(Instance),
                          offset(base + offsetof(Instance, material)));
    if (mesh.closed) {
      glEnable(GL_CULL_FACE);
    } else {
      glDisable(GL_CULL_FACE);
    }
    glDrawElementsInstancedBaseVertex(
        GL_TRIANGLES, static_cast<GLsizei>(level.index_count), GL_UNSIGNED_INT,
        offset((mesh.first_index + level.first_index) * sizeof(uint32_t)),
        static_cast<GLsizei>(batch.instance_count),
        static_cast<GLint>(mesh.first_vertex + level.first_vertex));
  }
  glDisable(GL_CULL_FACE);
}

}  // namespace pilesim
