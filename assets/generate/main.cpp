// generate_assets OUT_DIR: writes every mesh of assets/. The same bytes on every run.
#include <cstdio>
#include <filesystem>

#include "core/error.h"
#include "generate/guides.h"
#include "generate/polygonise.h"
#include "generate/sculptures.h"
#include "generate/things.h"
#include "geometry/obj_writer.h"

namespace pilesim {
namespace {

// To the micrometre: far below what matters, and files stay short.
void write(TriangleMesh mesh, const std::filesystem::path& file) {
  for (Vec3& vertex : mesh.vertices) {
    for (double& coordinate : vertex) coordinate = std::round(coordinate * 1e6) / 1e6 + 0.0;
  }
  write_obj(mesh, file);
  std::fprintf(stderr, "%s: %zu triangles\n", file.c_str(), mesh.triangles.size());
}

void write_sculpture(Sculpture (*sculpt)(Detail), const std::filesystem::path& directory,
                     const std::string& name) {
  const Sculpture full = sculpt(Detail::full);
  const TriangleMesh fine = polygonise(full.field, full.region, full.cell_m);
  write(simplify(fine, 5000, full.face), directory / (name + ".obj"));
  for (const auto& [detail, count] : {std::pair{Detail::coarse, 500}, {Detail::distant, 50}}) {
    const Sculpture plain = sculpt(detail);
    write(simplify(polygonise(plain.field, plain.region, 2 * plain.cell_m), count),
          directory / (name + "_" + std::to_string(count) + ".obj"));
  }
}

void write_all(const std::filesystem::path& directory) {
  std::filesystem::create_directories(directory / "guides");
  write(box(), directory / "box.obj");
  write(stick(), directory / "stick.obj");
  write(playing_card(), directory / "playing_card.obj");
  write(l_shape(), directory / "l_shape.obj");
  write(cross(), directory / "cross.obj");
  write(pole(), directory / "pole.obj");
  write(book(), directory / "book.obj");
  write(chair(), directory / "chair.obj");
  write(crate(), directory / "crate.obj");
  write(cart(), directory / "cart.obj");
  write(ring(), directory / "ring.obj");
  write(tyre(), directory / "tyre.obj");
  write(banana(), directory / "banana.obj");
  write(column(), directory / "guides" / "column.obj");
  write(cut_sphere(), directory / "guides" / "cut_sphere.obj");
  write(l_guide(), directory / "guides" / "l.obj");
  write(t_guide(), directory / "guides" / "t.obj");
  write(arch(), directory / "guides" / "arch.obj");
  write(torus(), directory / "guides" / "torus.obj");
  write(cone(), directory / "guides" / "cone.obj");
  write(spiral_tower(), directory / "guides" / "spiral_tower.obj");
  write(heart(), directory / "guides" / "heart.obj");
  write(letters(), directory / "guides" / "letters.obj");
  write_sculpture(rabbit, directory, "rabbit");
  write_sculpture(armoured_biped, directory, "biped");
}

}  // namespace
}  // namespace pilesim

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: generate_assets OUT_DIR\n");
    return 2;
  }
  try {
    pilesim::write_all(argv[1]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "generate_assets: %s\n", error.what());
    return 1;
  }
}
