// Signatures of objects whose shapes name none: measured when a scene needs them, and kept in the
// user's cache directory.
#pragma once

#include <functional>
#include <string>

#include "core/progress.h"
#include "geometry/mesh.h"
#include "model/model.h"
#include "scene/scene.h"
#include "signature/signature.h"

namespace pilesim {

// A shape at its own scale, with a material.
struct MeasuredObject {
  const ModelShape& shape;
  const MeshShape* mesh;  // null: the shape is not a mesh
  TriangleMesh solid;     // surface of the solid that carries the mass, m, body frame
  ContactMaterial material;
};

// Uses fewer trials than `pilesim sample-signature` does by default. The result does not depend on
// the number of threads. Throws Error(input) if the object cannot be measured, Error(interrupted)
// after Ctrl-C.
Signature measure_object(const MeasuredObject& object, ProgressMode progress);

struct MeasureSettings {
  ProgressMode progress = ProgressMode::none;
  // Called with a line for people before it waits for another process; empty: nobody is told.
  std::function<void(const std::string&)> say = {};
  std::function<Signature(const MeasuredObject&, ProgressMode)> measure = measure_object;
};

// Puts into `model` the signatures that its bodies need in the scene's mode and that no shape
// names. They come from the cache, or are measured with the object's geometry and material. A
// cached signature was measured by the same program, so the result does not depend on the cache;
// damaged files are replaced. If several processes need the same one, the first measures it
// and the others wait. `model` must be ready to be simulated, with its guide filled. Returns the
// wall time of the measurements, s; 0 if there were none. Throws Error(input) naming the shape's
// JSON pointer if an object cannot be measured, and for scenes that the mode rejects; Error(io) if
// the cache cannot be written; Error(interrupted) after Ctrl-C.
double measure_signatures(const Scene& scene, Model& model, const MeasureSettings& settings);

// The same without measurements: missing signatures are null in `model`. A simulator can then be
// made, but not stepped.
void find_signatures(const Scene& scene, Model& model);

// A line for people if signatures are measured for each run, because no cache can be written; else
// empty.
std::string describe_unkept_signatures(const Scene& scene, const Model& model);

}  // namespace pilesim
