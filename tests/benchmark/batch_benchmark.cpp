// Cost of a batch itself: jobs whose steps only write the files of a small picture, through the
// code that runs and collects real ones. Time and peak memory of each part.
//
//   batch_benchmark [JOBS] [DIRECTORY]
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>

#include "batch/batch.h"
#include "batch/steps.h"

namespace {

namespace fs = std::filesystem;
using namespace pilesim;

void write(const fs::path& file, const std::string& text) {
  fs::create_directories(file.parent_path());
  std::ofstream(file) << text;
}

// Output of `simulate` and `render --annotations coco,bop` for ten bodies, with empty masks.
StepResult leave_files(const StepCommand& command) {
  const fs::path run = command.directory / "run";
  if (command.words[0] == "simulate") {
    write(run / "report.json", command.words.back());
    return {};
  }
  std::string annotations, poses, infos;
  for (int body = 1; body <= 10; ++body) {
    const std::string comma = body == 1 ? "" : ", ";
    annotations += comma + R"({"id": )" + std::to_string(body) +
                   R"(, "image_id": 0, "category_id": 1, "bbox": [1, 2, 3, 4], "area": 12, )"
                   R"("segmentation": {"size": [480, 640], "counts": "0123456789"}, "iscrowd": 0})";
    poses += comma +
             R"({"cam_R_m2c": [1, 0, 0, 0, 1, 0, 0, 0, 1], "cam_t_m2c": [1, 2, 3], "obj_id": 1})";
    infos += comma + R"({"bbox_obj": [1, 2, 3, 4], "px_count_all": 12})";
  }
  write(run / "frames/frame.0000.png", std::string(1000, 'p'));
  write(run / "cameras.json", R"({"width": 640, "height": 480, "frames": [{"frame": 0, "K": 1}]})");
  write(run / "coco.json", R"({"info": {}, "categories": [{"id": 1, "name": "box"}],
    "images": [{"id": 0, "file_name": "frames/frame.0000.png"}], "annotations": [)" +
                               annotations + "]}");
  write(run / "bop/models/obj_000001.ply", "ply");
  write(run / "bop/models/models_info.json", R"({"1": {"diameter": 1}})");
  const fs::path scene = run / "bop/train_pbr/000000";
  for (const char* name : {"rgb/000000.png", "depth/000000.png", "mask/000000_000000.png",
                           "mask_visib/000000_000000.png"}) {
    write(scene / name, std::string(500, 'p'));
  }
  write(scene / "scene_camera.json", R"({"0": {"depth_scale": 1}})");
  write(scene / "scene_gt.json", R"({"0": [)" + poses + "]}");
  write(scene / "scene_gt_info.json", R"({"0": [)" + infos + "]}");
  return {};
}

double megabytes_at_most() {
  std::ifstream stream("/proc/self/status");
  for (std::string key; stream >> key;) {
    double kilobytes = 0;
    if (key == "VmHWM:" && stream >> kilobytes) return kilobytes / 1024;
  }
  return 0;
}

void tell(const char* what, uint64_t jobs, const std::function<void()>& work) {
  std::ofstream("/proc/self/clear_refs") << 5;  // resets the peak memory
  const auto start = std::chrono::steady_clock::now();
  work();
  const double s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  std::printf("| %s | %.2f s | %.1f us | %.0f MB |\n", what, s, 1e6 * s / static_cast<double>(jobs),
              megabytes_at_most());
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  const uint64_t jobs = argc > 1 ? std::stoull(argv[1]) : 100'000;
  const fs::path directory = argc > 2 ? argv[2] : "batch_benchmark_out";
  fs::remove_all(directory);
  fs::create_directories(directory);
  std::ofstream(directory / "scene.json") << R"({"version": 1})";
  const auto write_plan = [&](const std::string& collect) {
    std::ofstream(directory / "plan.json")
        << R"({"version": 1, "scene": "scene.json", "count": )" << jobs
        << R"(, "vary": [{"set": "/duration_s", "uniform": [1, 2]}], "collect": [)" << collect
        << R"(], "steps": [["simulate"], ["render", "--annotations", "coco,bop"]]})";
  };
  write_plan("");
  BatchRequest request{.plan_file = directory / "plan.json",
                       .output = directory / "out",
                       .progress = ProgressMode::none};
  std::printf("| %llu jobs | all | each | memory |\n|---|---|---|---|\n",
              static_cast<unsigned long long>(jobs));
  tell("values, commands and keys of all", jobs, [&] {
    const BatchPlan plan = load_batch_plan(request.plan_file);
    const JobKeys keys(plan);
    size_t bytes = 0;
    for (uint64_t i = 0; i < jobs; ++i) {
      const BatchJob job = batch_job(plan, i);
      bytes += keys.key(job).size() + step_words(plan, job, 0, scene_seed(plan, job, 0), 1).size();
    }
    if (bytes == 0) std::abort();
  });
  tell("run", jobs, [&] { run_batch(request, leave_files); });
  tell("run again: nothing to do", jobs, [&] { run_batch(request, leave_files); });
  tell("tables, of a file a job", jobs, [&] { collect_batch(request); });
  for (uint64_t i = 0; i < 40; ++i) {
    BatchRequest shard = request;
    shard.shard = Shard{.index = i, .count = 40};
    run_batch(shard, leave_files);
  }
  tell("tables, of a file a shard of 40", jobs, [&] { collect_batch(request); });
  for (const char* what : {"coco", "bop", "tar"}) {
    write_plan('"' + std::string(what) + '"');
    tell((std::string("tables and ") + what).c_str(), jobs, [&] { collect_batch(request); });
    tell((std::string("tables and ") + what + " again").c_str(), jobs,
         [&] { collect_batch(request); });
  }
  uint64_t files = 0;
  for (const auto& entry : fs::recursive_directory_iterator(directory / "out" / "jobs")) {
    files += entry.is_regular_file() ? 1 : 0;
  }
  std::printf("%.1f files a job\n", static_cast<double>(files) / static_cast<double>(jobs));
  tell("all removed", jobs, [&] { fs::remove_all(directory); });
}
