// The meshes of a scene as OpenGL has them, and drawing instances of them.
#pragma once

#include <map>
#include <span>
#include <vector>

#include "render/draw_list.h"
#include "render/gl_objects.h"
#include "render/render_mesh.h"

namespace pilesim {

// Vertex attributes: 0 position, 1 normal, 2 to 4 and 7 the members of Instance, 5 paint, 6 place
// in a texture.
class MeshBuffers {
 public:
  // Needs its context to be current, as load() and draw() do.
  explicit MeshBuffers(std::span<const RenderMesh> meshes);
  // Sets what is drawn next. `list` is of the meshes given above, and stays.
  void load(const DrawList& list);
  // Triangles of all kinds; culls the back faces of closed meshes.
  void draw_all();
  // Those without a texture; those with one, which is bound to the first unit.
  void draw_plain();
  void draw_textured();
  // One of the batches of what is loaded.
  void draw_batch(const DrawBatch& batch);
  bool has_textures() const { return !textures_.empty(); }

 private:
  struct Mesh {
    uint32_t first_vertex = 0;
    uint32_t first_index = 0;
    bool closed = false;
    std::vector<MeshLevel> levels;
    std::vector<GLuint> textures;
  };
  GLuint texture_of(const MipMap& texture);
  void bind_instances(const DrawBatch& batch) const;
  void draw_run(const DrawBatch& batch, uint32_t first_index, uint32_t index_count) const;
  template <typename Draw>
  void for_each_batch(const Draw& draw);

  std::vector<Mesh> meshes_;
  std::map<const MipMap*, GlTexture> textures_;  // meshes share them
  const DrawList* list_ = nullptr;
  // Vertices and indices of all meshes in two buffers.
  GlVertexArray array_;
  GlBuffer vertices_, indices_, instances_;
};

}  // namespace pilesim
