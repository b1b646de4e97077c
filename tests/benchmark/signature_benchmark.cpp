// Time, accuracy and size of signatures, both layouts, micro and macro:
//   signature_benchmark [--threads N] [MESH ...]
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <string>
#include <vector>

#include "core/parallel_for.h"
#include "geometry/mesh_import.h"
#include "report/machine_info.h"
#include "report_errors.h"
#include "signature/signature_file.h"
#include "signature/signature_sampling.h"
#include "signature/signature_summary.h"

namespace pilesim {
namespace {

double now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}
double cpu_s() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

void time_tables(const ContactBody& body) {
  for (const TableLayout layout : {TableLayout::dissertation, TableLayout::scale_free}) {
    for (const TrialKind kind : {TrialKind::micro, TrialKind::macro}) {
      const TrialSetup setup{&body, {}, kind};
      TableSampler sampler(setup, make_table(layout, body.gyration_m), default_sampling(layout));
      const double wall = now_s(), cpu = cpu_s();
      sampler.run([](uint64_t, uint64_t) { return true; });
      const double wall_taken = now_s() - wall, cpu_taken = cpu_s() - cpu;
      const double trials = static_cast<double>(sampler.state().responses.first.size());
      std::printf("%-13s %s  %8.0f trials  %6.2f s wall  %6.2f s CPU  %8.0f trials/s\n",
                  layout_name(layout).c_str(), kind == TrialKind::micro ? "micro" : "macro", trials,
                  wall_taken, cpu_taken, trials / wall_taken);
      std::fflush(stdout);
    }
  }
}

// Whole signatures with the defaults of `pilesim sample-signature`.
void measure_signatures(const std::string& mesh) {
  const std::filesystem::path file =
      std::filesystem::temp_directory_path() / ("signature_benchmark." + std::to_string(getpid()));
  for (const TableLayout layout : {TableLayout::dissertation, TableLayout::scale_free}) {
    SignatureOptions options{.mesh = mesh, .layout = layout, .progress = ProgressMode::none};
    options.sampling = default_sampling(layout);
    const SignatureRun run = sample_signature(options);
    write_signature(run.signature, file);
    std::printf("%s, macro: tables and rest poses in %.2f s, accuracy in %.2f s, file of %.2f MB\n",
                layout_name(layout).c_str(), run.sampling_s, run.accuracy_s,
                static_cast<double>(std::filesystem::file_size(file)) / 1e6);
    std::filesystem::remove(file);
    std::fputs(accuracy_text(*run.signature.accuracy).c_str(), stdout);
    std::fflush(stdout);
  }
}

void run(int argc, char** argv) {
  std::vector<std::string> meshes;
  for (int i = 1; i < argc; ++i) {
    if (std::string(argv[i]) == "--threads" && i + 1 < argc) {
      set_thread_count(std::max(1, std::atoi(argv[++i])));
    } else {
      meshes.emplace_back(argv[i]);
    }
  }
  if (meshes.empty()) meshes.emplace_back(PILESIM_SOURCE_DIR "/assets/rabbit.obj");
  const MachineInfo machine = machine_info();
  std::printf("%s, %s, %d threads\n", machine.cpu.c_str(), machine.system.c_str(), thread_count());
  for (const std::string& mesh : meshes) {
    const ContactBody body = make_contact_body(import_mesh(mesh), mesh);
    std::printf("\n%s, hull of %zu vertices\n", std::filesystem::path(mesh).filename().c_str(),
                body.vertex_count());
    time_tables(body);
    measure_signatures(mesh);
  }
}

}  // namespace
}  // namespace pilesim

int main(int argc, char** argv) {
  return pilesim::report_errors([&] { pilesim::run(argc, argv); });
}
