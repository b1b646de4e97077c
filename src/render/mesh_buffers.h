// The meshes of a scene as OpenGL has them, and drawing instances of them.
#pragma once

#include <span>
#include <vector>

#include "render/draw_list.h"
#include "render/gl_objects.h"
#include "render/render_mesh.h"

namespace pilesim {

// Vertex attributes: 0 position, 1 normal, 2 to 4 the members of Instance,
// 5 paint.
class MeshBuffers {
 public:
  // Needs its context to be current, as draw() does.
  explicit MeshBuffers(std::span<const RenderMesh> meshes);
  // `list` is of the meshes given above. Culls the back faces of closed ones.
  void draw(const DrawList& list);

 private:
  struct Mesh {
    uint32_t first_vertex = 0;
    uint32_t first_index = 0;
    bool closed = false;
    std::vector<MeshLevel> levels;
  };
  std::vector<Mesh> meshes_;
  // Vertices and indices of all meshes in two buffers.
  GlVertexArray array_;
  GlBuffer vertices_, indices_, instances_;
};

}  // namespace pilesim
