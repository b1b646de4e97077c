// The formats, one file each. All throw Error(io), and Error(usage) for content they cannot hold.
#pragma once

#include <filesystem>

#include "export/export_file.h"
#include "export/export_job.h"
#include "export/export_source.h"

namespace pilesim {

// Pixar's USD as text: https://openusd.org. y up, metres; time codes are frames of the trajectory.
// The first of `files` is the scene. Motion beyond job.part_bytes goes to value clips.
void write_usda(ExportSource& source, const ExportJob& job, ExportForm form, ExportFiles& files);

// glTF 2.0: https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html. Seconds since the first
// frame. The first two of `files` are the document and its buffer. Buffers beyond job.part_bytes
// are split.
void write_gltf(ExportSource& source, const ExportJob& job, ExportForm form, ExportFiles& files);
// Document and buffer in one file, of at most 2 GiB.
void write_glb(ExportSource& source, const ExportJob& job, ExportForm form, ExportFile& file);

// One row per body and frame in which it is present.
void write_csv(ExportSource& source, ExportFile& file);

// numpy's archive of arrays: https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html
void write_npz(ExportSource& source, const ExportJob& job, ExportFile& file);

// A script for Blender that builds the scene from the npz file named `data` beside it.
void write_blender_script(const std::string& data, ExportForm form, ExportFile& file);

}  // namespace pilesim
