// The formats, a file each. All throw Error(io), and Error(usage) for what they cannot hold.
#pragma once

#include <filesystem>

#include "export/export_file.h"
#include "export/export_job.h"
#include "export/export_source.h"

namespace pilesim {

// Pixar's USD as text: https://openusd.org. y up, metres, time codes are frames of the trajectory.
// The first of `files` is the scene; adds value clips where motion takes more than
// job.part_bytes.
void write_usda(ExportSource& source, const ExportJob& job, ExportForm form, ExportFiles& files);

// glTF 2.0: https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html. Seconds from the first frame
// on. The first two of `files` are the document and its buffer; adds more buffers where one would
// have more than job.part_bytes.
void write_gltf(ExportSource& source, const ExportJob& job, ExportForm form, ExportFiles& files);
// Both in one file, of at most 2 GiB.
void write_glb(ExportSource& source, const ExportJob& job, ExportForm form, ExportFile& file);

// A row a body and frame in which it is there.
void write_csv(ExportSource& source, ExportFile& file);

// numpy's archive of arrays: https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html
void write_npz(ExportSource& source, const ExportJob& job, ExportFile& file);

// A script for Blender that builds the scene from the npz of the name `data` beside it.
void write_blender_script(const std::string& data, ExportForm form, ExportFile& file);

}  // namespace pilesim
