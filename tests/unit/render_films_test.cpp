// Films on disk: work continues from them to the same bytes, and only from those of the same
// picture.
#include <gmock/gmock.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <functional>
#include <thread>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/hash.h"
#include "render/rays/rays_renderer.h"
#include "render/render_job.h"
#include "support/render_fixture.h"

namespace pilesim {
namespace {

namespace fs = std::filesystem;
using test::DrawnScene;
using ::testing::HasSubstr;

DrawnScene some_bodies() {
  DrawnScene scene;
  scene.add(1, {-0.4f, 0.5f, 0}, test::kRed, true);
  scene.add(2, {0.4f, 0.2f, 0.3f}, test::kGrey, true);
  return scene;
}

class FilmStores : public test::ScratchTest {
 protected:
  FilmStores() {
    fs::create_directories(output_ / "films");
    settings_.size = {40, 30};
    settings_.rays.shutter = 0.5;
  }

  DrawnFrame drawn() const {
    const CameraKey camera = test::front_camera({0, 0.5, 0}, 4);
    return {.index = 3,
            .frame = &scene_.frame,
            .camera = camera,
            .before = &before_,
            .camera_before = camera};
  }
  // With the existing film, or without any.
  Image draw(int samples, bool with_films = true) {
    settings_.rays.samples = samples;
    std::optional<FilmPlace> place;
    if (with_films) place = FilmPlace{.output = output_, .go_on = true};
    return RaysRenderer(scene_.header, settings_, {}, BodyColours::own, place).draw(drawn());
  }
  std::string refusal(int samples) {
    try {
      draw(samples);
      return "";
    } catch (const Error& error) {
      return error.what();
    }
  }

  DrawnScene scene_ = some_bodies();
  TrajectoryFrame before_ = scene_.frame;
  RenderSettings settings_;
  fs::path output_ = directory_.path();
  fs::path file_ = film_file(output_, 3);
};

TEST_F(FilmStores, GoOnToTheSameBytes) {
  const Image at_once = draw(6, false);
  const Image few = draw(2);
  EXPECT_EQ(few.rgb, draw(2, false).rgb);
  ASSERT_TRUE(fs::exists(file_));
  EXPECT_EQ(draw(6).rgb, at_once.rgb);
  // A complete picture is not traced again.
  const auto written = fs::last_write_time(file_);
  EXPECT_EQ(draw(6).rgb, at_once.rgb);
  EXPECT_EQ(fs::last_write_time(file_), written);
}

// Draws from the film, or its bytes would not matter: with the sums of another picture in it, the
// result is that picture.
TEST_F(FilmStores, AreWhatThePictureIsMadeOf) {
  draw(2);
  const Checkpoint film(file_);
  std::vector<std::byte> state(film.state().begin(), film.state().end());
  const uint32_t samples = 4;
  // As for twice as many samples: half as bright.
  std::memcpy(state.data(), &samples, sizeof samples);
  write_checkpoint(file_, film.key(), state);
  const Image dark = draw(4), right = draw(4, false);
  EXPECT_LT(test::pixel(dark, 20, 4).y(), 0.9f * test::pixel(right, 20, 4).y());
}

TEST_F(FilmStores, OfOtherPicturesAreRefused) {
  draw(2);
  const std::string kept = content_hash(read_file(file_));
  const auto changed = [&](const std::function<void()>& change) {
    const DrawnScene scene = scene_;
    const TrajectoryFrame before = before_;
    const RenderSettings settings = settings_;
    change();
    const std::string words = refusal(4);
    scene_ = scene;
    before_ = before;
    settings_ = settings;
    return words;
  };
  for (const auto& change : std::initializer_list<std::function<void()>>{
           [&] {
             settings_.size = {41, 30};
           },
           [&] { settings_.light.sky = 0.5; },
           [&] { settings_.rays.bounces = 1; },
           [&] { settings_.rays.sun_angle = 0.1; },
           [&] { scene_.frame.position[1].x() += 0.001; },
           [&] { before_.position[2].y() += 0.001; },
           [&] { scene_.header.scene_hash = "of another scene"; },
       }) {
    EXPECT_THAT(changed(change), HasSubstr("is of another scene or of other options"));
  }
  EXPECT_EQ(content_hash(read_file(file_)), kept);
  EXPECT_EQ(changed([] {}), "");
}

TEST_F(FilmStores, OfMoreSamplesAreRefused) {
  draw(5);
  EXPECT_THAT(refusal(4), AllOf(HasSubstr("frame.0003.film: holds 5 samples a pixel"),
                                HasSubstr("at most 4"), HasSubstr("--samples 5 or more")));
}

TEST_F(FilmStores, AreRefusedIfTorn) {
  draw(2);
  const std::string whole = read_file(file_);
  for (const size_t size : {size_t{0}, size_t{30}, whole.size() / 2, whole.size() - 1}) {
    std::ofstream(file_, std::ios::binary) << whole.substr(0, size);
    EXPECT_THAT(refusal(4), HasSubstr("frame.0003.film")) << size;
  }
  std::string changed = whole;
  changed[whole.size() / 2] ^= 1;
  std::ofstream(file_, std::ios::binary) << changed;
  EXPECT_THAT(refusal(4), HasSubstr("is damaged"));
}

// A film with a valid checksum but wrong planes, as a faulty program might write.
TEST_F(FilmStores, OfTooFewNumbersAreRefused) {
  draw(2);
  const Checkpoint film(file_);
  StateWriter state;
  state(uint32_t{2});
  for (int i = 0; i < 12; ++i) state(std::vector<std::byte>(17));
  write_checkpoint(file_, film.key(), state.bytes());
  EXPECT_THAT(refusal(4), HasSubstr("a number for each pixel"));
}

TEST_F(FilmStores, AreKeptWhileAPictureIsUnderWay) {
  settings_.rays.samples = 4000;
  std::atomic<bool> stop = false;
  std::string early;
  std::thread watcher([&] {
    while (!fs::exists(file_) && !stop) std::this_thread::yield();
    early = read_file(file_);
  });
  RaysRenderer(scene_.header, settings_, {}, BodyColours::own,
               FilmPlace{.output = output_, .go_on = true, .period_s = 0})
      .draw(drawn());
  stop = true;
  watcher.join();
  std::ofstream(directory_.path() / "early", std::ios::binary) << early;
  const Checkpoint film(directory_.path() / "early");
  StateReader reader(film.state());
  uint32_t samples = 0;
  reader(samples);
  EXPECT_GE(samples, 1u);
  EXPECT_LT(samples, 4000u);
}

}  // namespace
}  // namespace pilesim
