// Time of signature sampling, both layouts, micro and macro:
//   signature_benchmark [MESH [THREADS]]
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string>

#include "core/error.h"
#include "core/parallel_for.h"
#include "geometry/mesh_import.h"
#include "report/machine_info.h"
#include "signature/signature_sampling.h"

namespace pilesim {
namespace {

double now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}
double cpu_s() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

void run(int argc, char** argv) {
  const std::string mesh = argc > 1 ? argv[1] : PILESIM_SOURCE_DIR "/assets/rabbit.obj";
  if (argc > 2) set_thread_count(std::max(1, std::atoi(argv[2])));
  const ContactBody body = make_contact_body(import_mesh(mesh), mesh);
  const MachineInfo machine = machine_info();
  std::printf("%s, %s, %d threads\n", machine.cpu.c_str(), machine.system.c_str(), thread_count());
  std::printf("%s, hull of %zu vertices\n", mesh.c_str(), body.vertex_count());
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
    }
  }
}

}  // namespace
}  // namespace pilesim

int main(int argc, char** argv) {
  try {
    pilesim::run(argc, argv);
  } catch (const pilesim::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
