#include "render/dataset/dataset_job.h"

#include <algorithm>
#include <memory>
#include <string_view>

#include "core/error.h"
#include "core/interrupt.h"
#include "core/output_directory.h"
#include "render/dataset/bop.h"
#include "render/dataset/coco.h"
#include "render/dataset/resolve_hits.h"
#include "render/render_job.h"
#include "scene/camera_path.h"

namespace pilesim {
namespace {

namespace fs = std::filesystem;

std::vector<std::unique_ptr<AnnotationWriter>> make_writers(const TrajectoryHeader& header,
                                                            const DatasetJob& job) {
  std::vector<std::unique_ptr<AnnotationWriter>> writers;
  if (job.coco) writers.push_back(make_coco_writer(header, job.output / kCocoFile));
  if (job.bop) writers.push_back(make_bop_writer(header, *job.bop, job.bop_scene));
  return writers;
}

// All that is told of frames, one after another.
class Teller {
 public:
  Teller(TrajectoryReader& trajectory, const DatasetJob& job)
      : trajectory_(trajectory),
        job_(job),
        renderer_(trajectory.header()),
        writers_(make_writers(trajectory.header(), job)) {}

  void tell(uint64_t frame) {
    const TrajectoryHeader& header = trajectory_.header();
    const CameraKey key = camera_of(frame);
    const Pinhole camera = make_pinhole(key, job_.size[0], job_.size[1]);
    trajectory_.read(frame, now_);
    renderer_.look(now_, camera);
    renderer_.find_hits(hits_);
    resolve(frame, camera);
    AnnotatedFrame told{.frame = frame,
                        .picture = frame_file(job_.output, frame),
                        .camera = camera,
                        .poses = now_,
                        .images = images_,
                        .depth = depth_};
    depth_ = depth_image(images_, depth_unit_mm(key));
    if (needs_visibility()) find_bodies(told);
    if (!job_.passes.empty()) {
      write_passes(header, job_.passes, frame, images_, depth_, job_.output / "passes");
    }
    for (const auto& writer : writers_) writer->add(told);
  }

  void finish() {
    for (const auto& writer : writers_) writer->finish();
  }

 private:
  CameraKey camera_of(uint64_t frame) const {
    return camera_at(job_.camera, static_cast<double>(frame) / trajectory_.header().frame_rate);
  }

  bool needs_visibility() const {
    return !writers_.empty() ||
           std::ranges::find(job_.passes, Pass::visibility) != job_.passes.end();
  }

  void resolve(uint64_t frame, const Pinhole& camera) {
    const TrajectoryHeader& header = trajectory_.header();
    const Moment moment{now_, camera};
    if (frame + 1 >= trajectory_.frame_count()) {
      resolve_hits(header, moment, nullptr, hits_, images_);
      return;
    }
    trajectory_.read(frame + 1, next_);
    const Pinhole later = make_pinhole(camera_of(frame + 1), job_.size[0], job_.size[1]);
    const Moment next{next_, later};
    resolve_hits(header, moment, &next, hits_, images_);
  }

  void find_bodies(AnnotatedFrame& told) {
    const TrajectoryHeader& header = trajectory_.header();
    find_visibility(header, now_, renderer_, images_, [&](size_t body, const Silhouette& alone) {
      if (writers_.empty() || header.body_moves[body] == 0) return;
      told.bodies.push_back({body, images_.visibility.back(), job_.bop ? alone : Silhouette{}});
    });
  }

  TrajectoryReader& trajectory_;
  const DatasetJob& job_;
  RayHits renderer_;
  std::vector<std::unique_ptr<AnnotationWriter>> writers_;
  TrajectoryFrame now_, next_;
  SurfaceHits hits_;
  PassImages images_;
  DepthImage depth_;
};

}  // namespace

void claim_dataset(const DatasetJob& job, bool force) {
  std::vector<std::string_view> own;
  if (!job.passes.empty()) own.assign(kPassEntries.begin(), kPassEntries.end());
  if (job.coco) own.push_back(kCocoFile);
  remove_output(claim_output(job.output, own, force));
  // The first camera's job is that of the whole dataset.
  if (job.bop && job.bop_scene == 0) {
    remove_output(claim_output(*job.bop, kBopEntries, force));
  }
}

void run_dataset(TrajectoryReader& trajectory, const DatasetJob& job, ProgressMode mode) {
  const TrajectoryHeader& header = trajectory.header();
  if (!job.passes.empty()) {
    make_output_directory(job.output / "passes");
    write_pass_conventions(header, job.passes, job.output / "passes");
  }
  if (job.bop && job.bop_scene == 0) write_bop_models(header, *job.bop);
  install_interrupt_handler();
  Teller teller(trajectory, job);
  Progress progress(mode, "passes", job.frames.size(), "frames");
  size_t done = 0;
  while (done < job.frames.size() && !interrupted()) {
    teller.tell(job.frames[done]);
    progress.update(++done);
  }
  teller.finish();
  if (done < job.frames.size()) {
    throw Error(ErrorKind::interrupted,
                Problem{.file = job.output.string(),
                        .found = "interrupted; has passes and annotations of the first " +
                                 std::to_string(done) + " of " + std::to_string(job.frames.size()) +
                                 " frames",
                        .remedy = "Draw them again with the same command and --force"});
  }
}

}  // namespace pilesim
