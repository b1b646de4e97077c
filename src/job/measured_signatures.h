// Signatures of the objects whose shapes name none, measured where a scene needs them and kept in
// the user's cache directory.
#pragma once

#include <functional>
#include <string>

#include "core/progress.h"
#include "geometry/mesh.h"
#include "model/model.h"
#include "scene/scene.h"
#include "signature/signature.h"

namespace pilesim {

// A shape in its own size, with a material.
struct MeasuredObject {
  const ModelShape& shape;
  const MeshShape* mesh;  // null: the shape is no mesh
  TriangleMesh solid;     // the surface of what has mass, m, body frame
  ContactMaterial material;
};

// With fewer trials than `pilesim sample-signature` by default. The same for any number of threads.
// Throws Error(input) where the object cannot be measured, Error(interrupted) after Ctrl-C.
Signature measure_object(const MeasuredObject& object, ProgressMode progress);

using MeasureObject = std::function<Signature(const MeasuredObject&, ProgressMode)>;

// Puts the signatures into `model` that its bodies collide by in the scene's mode and that no shape
// names: from the cache, else measured, with the object's own geometry and material. A cached one
// is that of this very program, so the result does not depend on the cache; a damaged file is
// replaced. `model` is ready to be simulated, its guide filled. Returns the wall time that was
// spent on measuring, s; 0: there was nothing to measure.
// Throws Error(input) naming the shape's JSON pointer where an object cannot be measured, and for
// what the mode refuses; Error(io) if the cache cannot be written; Error(interrupted) after Ctrl-C.
double measure_signatures(const Scene& scene, Model& model, ProgressMode progress,
                          const MeasureObject& measure = measure_object);

// The same without measuring: what is not in the cache is null in `model`, with which a simulator
// can be made but not stepped.
void find_signatures(const Scene& scene, Model& model);

// For people, where signatures are measured for each run because no cache can be written; else
// empty.
std::string describe_unkept_signatures(const Scene& scene, const Model& model);

}  // namespace pilesim
