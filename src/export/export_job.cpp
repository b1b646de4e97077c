#include "export/export_job.h"

#include <algorithm>
#include <array>
#include <map>

#include "core/clock.h"
#include "core/error.h"
#include "core/output_directory.h"
#include "export/formats.h"
#include "export/vat.h"

namespace pilesim {
namespace fs = std::filesystem;

namespace {

// With more objects, one per body, typical programs become slow.
constexpr size_t kMostObjects = 1000;

constexpr char kVatEnding[] = ".vat.glb";

ExportForm suitable_form(ExportFormat format, const ExportSource& source) {
  if (format == ExportFormat::gltf || format == ExportFormat::glb) {
    return source.frame_count() == 1 ? ExportForm::instances : ExportForm::objects;
  }
  return source.bodies().size() <= kMostObjects ? ExportForm::objects : ExportForm::instances;
}

void check_parts(ExportFormat format, const ExportJob& job) {
  if (!job.part_bytes || format == ExportFormat::usda || format == ExportFormat::gltf) return;
  throw Error(ErrorKind::usage,
              Problem{.file = "--part-bytes",
                      .found = job.output.filename().string() + " is not written in parts",
                      .expected = "a .usda or a .gltf"});
}

void check_form(ExportFormat format, const ExportSource& source, const ExportJob& job) {
  const bool is_gltf = format == ExportFormat::gltf || format == ExportFormat::glb;
  if (is_gltf && job.form == ExportForm::instances && source.frame_count() > 1) {
    throw Error(ErrorKind::usage,
                Problem{.file = "--as instances",
                        .found = "glTF cannot move instances",
                        .expected = "one frame of them, or objects",
                        .remedy = "Choose a frame with --frame, or export .usda"});
  }
}

}  // namespace

ExportFormat format_of(const fs::path& output) {
  if (output.string().ends_with(kVatEnding)) return ExportFormat::vat;
  static const std::map<std::string, ExportFormat> kFormats = {
      {".usda", ExportFormat::usda},  {".gltf", ExportFormat::gltf}, {".glb", ExportFormat::glb},
      {".py", ExportFormat::blender}, {".csv", ExportFormat::csv},   {".npz", ExportFormat::npz}};
  const auto found = kFormats.find(output.extension().string());
  if (found != kFormats.end()) return found->second;
  throw Error(
      ErrorKind::usage,
      Problem{
          .file = output.string(),
          .found = output.has_extension() ? "ends in " + output.extension().string()
                                          : "has no ending that names a format",
          .expected = ".usda, .gltf, .glb, .vat.glb (game engines), .py (Blender), .csv or .npz"});
}

std::vector<fs::path> claim_export(const fs::path& output, bool force) {
  const ExportFormat format = format_of(output);
  std::vector<fs::path> files = {output};
  if (format == ExportFormat::gltf) files.push_back(fs::path(output).replace_extension(".bin"));
  if (format == ExportFormat::blender) files.push_back(fs::path(output).replace_extension(".npz"));
  if (format == ExportFormat::vat) {
    std::string stem = output.string();
    stem.resize(stem.size() - std::string(kVatEnding).size());
    for (const char* more : {".vat.position.exr", ".vat.rotation.exr", ".vat.json"}) {
      files.emplace_back(stem + more);
    }
  }
  for (const fs::path& file : files) claim_output_file(file, force);
  return files;
}

ExportSummary run_export(TrajectoryReader& trajectory, const ExportJob& job) {
  const Stopwatch watch;
  const ExportFormat format = format_of(job.output);
  const std::vector<fs::path> names = claim_export(job.output, job.force);
  check_parts(format, job);
  ExportSource source(trajectory, job.choice);
  check_form(format, source, job);
  const ExportForm form = job.form.value_or(suitable_form(format, source));

  ExportFiles files(job.force);
  for (const fs::path& name : names) files.add(name);
  switch (format) {
    case ExportFormat::usda:
      write_usda(source, job, form, files);
      break;
    case ExportFormat::gltf:
      write_gltf(source, job, form, files);
      break;
    case ExportFormat::glb:
      write_glb(source, job, form, files[0]);
      break;
    case ExportFormat::blender:
      write_npz(source, job, files[1]);
      write_blender_script(names[1].filename().string(), form, files[0]);
      break;
    case ExportFormat::csv:
      write_csv(source, files[0]);
      break;
    case ExportFormat::npz:
      write_npz(source, job, files[0]);
      break;
    case ExportFormat::vat: {
      std::vector<std::string> beside;
      for (const fs::path& name : names) beside.push_back(name.filename().string());
      write_vat(source, job, {files[0], files[1], files[2], files[3], beside});
      break;
    }
  }
  ExportSummary summary;
  files.finish();
  summary.files = files.sizes();
  summary.bodies = source.bodies().size();
  summary.moving = static_cast<size_t>(std::ranges::count_if(
      source.bodies(), [](const ExportBody& body) { return body.last_change > 0; }));
  summary.frames = source.frame_count();
  summary.form = form;
  summary.wall_s = watch.seconds();
  return summary;
}

}  // namespace pilesim
