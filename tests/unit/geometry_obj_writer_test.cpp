#include "geometry/obj_writer.h"

#include <gtest/gtest.h>

#include "core/atomic_file.h"
#include "core/error.h"

namespace pilesim {
namespace {

TEST(ObjWriter, WritesShortestNumbersAndGroups) {
  const auto path = std::filesystem::temp_directory_path() /
                    ("pilesim_obj_writer_" + std::to_string(getpid()) + ".obj");
  TriangleMesh mesh{.vertices = {{0.1, -0.0, 1.0 / 3}, {1e-7, 123456.789, -2.5}, {1e10, 0, 3}},
                    .triangles = {{0, 1, 2}, {2, 1, 0}},
                    .groups = {{"front", 0, 1}, {"back side", 1, 1}}};
  write_obj(mesh, path);
  EXPECT_EQ(read_file(path),
            "v 0.1 0 0.33333334\nv 1e-07 123456.79 -2.5\nv 1e+10 0 3\n"
            "g front\nf 1 2 3\ng back side\nf 3 2 1\n");
  mesh.groups.clear();
  write_obj(mesh, path);
  EXPECT_EQ(read_file(path).find("g "), std::string::npos);
  std::filesystem::remove(path);
}

TEST(ObjWriter, ReportsADirectoryThatDoesNotExist) {
  try {
    write_obj({}, "/nonexistent/directory/a.obj");
    ADD_FAILURE() << "expected an error";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::io);
  }
}

}  // namespace
}  // namespace pilesim
