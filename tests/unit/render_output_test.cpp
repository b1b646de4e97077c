#include <gmock/gmock.h>
#include <gtest/gtest.h>

#define STB_IMAGE_STATIC
#define STBI_ONLY_PNG
#define STB_IMAGE_IMPLEMENTATION
#include <stb/stb_image.h>

#include <cstdlib>
#include <set>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/philox.h"
#include "core/subprocess.h"
#include "render/image_output.h"
#include "support/render_fixture.h"
#include "support/small_disk.h"

namespace pilesim {
namespace {

using testing::HasSubstr;

Image plain_image(int width, int height, uint8_t value) {
  return {width, height, std::vector<uint8_t>(static_cast<size_t>(3 * width * height), value)};
}

Image random_image(int width, int height) {
  Image image = plain_image(width, height, 0);
  Philox random(5, Stream::test, 0, 0);
  for (uint8_t& byte : image.rgb) byte = static_cast<uint8_t>(random.index(256));
  return image;
}

Image read_png(const std::filesystem::path& file) {
  const std::string bytes = read_file(file);
  Image image;
  int channels = 0;
  stbi_uc* rgb = stbi_load_from_memory(reinterpret_cast<const stbi_uc*>(bytes.data()),
                                       static_cast<int>(bytes.size()), &image.width, &image.height,
                                       &channels, 0);
  EXPECT_NE(rgb, nullptr) << stbi_failure_reason();
  EXPECT_EQ(channels, 3);
  if (rgb != nullptr) image.rgb.assign(rgb, rgb + 3 * image.width * image.height);
  stbi_image_free(rgb);
  return image;
}

class Png : public test::ScratchTest {};

TEST_F(Png, ReadsBackAsWritten) {
  for (const auto& [width, height] : {std::pair{1, 1}, {7, 5}, {64, 48}, {301, 2}}) {
    const Image image = random_image(width, height);
    write_png(image, directory_ / "a.png");
    const Image back = read_png(directory_ / "a.png");
    EXPECT_EQ(back.width, width);
    EXPECT_EQ(back.height, height);
    EXPECT_EQ(back.rgb, image.rgb);
  }
}

TEST_F(Png, IsCompressed) {
  write_png(plain_image(200, 100, 90), directory_ / "a.png");
  EXPECT_LT(std::filesystem::file_size(directory_ / "a.png"), 2000u);
}

TEST_F(Png, SaysWhereItCannotWrite) {
  try {
    write_png(plain_image(2, 2, 0), directory_ / "missing" / "a.png");
    FAIL() << "no error was thrown";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::io);
    EXPECT_THAT(error.what(), HasSubstr("missing"));
  }
}

TEST(ContactSheet, LaysPicturesOutRowByRow) {
  std::vector<Image> pictures;
  for (int i = 0; i < 5; ++i) pictures.push_back(plain_image(60, 40, static_cast<uint8_t>(40 * i)));
  const Image sheet = contact_sheet(pictures, {"0", "1", "2", "3", "4"}, 3);
  EXPECT_EQ(sheet.width, 3 * 60 + 2 * 4);
  EXPECT_EQ(sheet.height, 2 * 40 + 4);
  for (int i = 0; i < 5; ++i) {
    const int left = i % 3 * 64, top = i / 3 * 44;
    // The corners away from the label.
    for (const auto& [x, y] : {std::pair{left, top}, {left + 59, top}, {left + 59, top + 39}}) {
      EXPECT_NEAR(test::pixel(sheet, x, y).x() * 255, 40 * i, 0.01) << "picture " << i;
    }
  }
  EXPECT_EQ(test::pixel(sheet, 61, 10).x(), 1);   // the gap
  EXPECT_EQ(test::pixel(sheet, 160, 60).x(), 1);  // a place without a picture
}

TEST(ContactSheet, LabelsEachPicture) {
  const std::vector<Image> pictures(2, plain_image(80, 40, 100));
  const Image sheet = contact_sheet(pictures, {"1.25 s", "x"}, 2);
  const auto white = [&](int left) {
    int count = 0;
    for (int y = 20; y < 40; ++y) {
      for (int x = left; x < left + 80; ++x) count += test::pixel(sheet, x, y).x() > 0.7f;
    }
    return count;
  };
  EXPECT_GT(white(0), 2 * white(84));
  EXPECT_GT(white(84), 4);
  // Different texts look different.
  EXPECT_NE(contact_sheet(pictures, {"1.25 s", "y"}, 2).rgb, sheet.rgb);
}

TEST(ContactSheet, LongLabelsAreCutAtTheEdge) {
  const Image sheet = contact_sheet({plain_image(20, 10, 0)}, {std::string(200, 'W')}, 1);
  EXPECT_EQ(sheet.rgb.size(), 600u);
}

TEST(ContactSheet, LabelsEndInTheirPicture) {
  const std::vector<Image> pictures(2, plain_image(120, 60, 100));
  const Image sheet = contact_sheet(pictures, {std::string(200, 'W'), ""}, 2);
  for (int y = 0; y < 60; ++y) {
    for (int x = 124; x < 244; ++x) ASSERT_NEAR(test::pixel(sheet, x, y).x() * 255, 100, 0.01);
  }
}

std::string labelled(const std::string& text) {
  const Image image = contact_sheet({plain_image(160, 60, 100)}, {text}, 1);
  return {image.rgb.begin(), image.rgb.end()};
}

TEST(ContactSheet, LettersOfManyAlphabetsAreThemselves) {
  std::set<std::string> pictures;
  const std::vector<std::string> letters = {"e",      "\u00e9", "\u0159", "\u03a9", "\u03c9",
                                            "\u0416", "\u044f", "\u2026", "\ufffd"};
  for (const std::string& letter : letters) pictures.insert(labelled(letter));
  EXPECT_EQ(pictures.size(), letters.size());
}

TEST(ContactSheet, AnUnknownCharacterIsOneReplacementSign) {
  const std::string sign = labelled("a\ufffdb");
  // Characters outside the font; invalid UTF-8: a lone byte, a truncated character; a control
  // character.
  for (const std::string text : {"a\u6f22b", "a\U0001F407b",
                                 "a\xff"
                                 "b",
                                 "a\xe6\xbc"
                                 "b",
                                 "a\x1b"
                                 "b"}) {
    EXPECT_TRUE(labelled(text) == sign) << text;
  }
}

std::string probe(const std::filesystem::path& file) {
  return run_program(
      {"ffprobe", "-v", "error", "-count_frames", "-select_streams", "v:0", "-show_entries",
       "stream=width,height,r_frame_rate,nb_read_frames,pix_fmt", "-of", "csv=p=0", file.string()},
      "ffmpeg");
}

class Video : public test::ScratchTest {
 protected:
  std::filesystem::path file_ = directory_ / "video.mp4";
};

TEST_F(Video, HasTheFramesAndTheRateItWasGiven) {
  VideoWriter video(file_, 64, 48, 24);
  for (int i = 0; i < 7; ++i) video.append(plain_image(64, 48, static_cast<uint8_t>(30 * i)));
  EXPECT_FALSE(std::filesystem::exists(file_));
  video.finish();
  EXPECT_EQ(probe(file_), "64,48,yuv420p,24/1,7\n");
}

TEST_F(Video, OddSizesLoseARowAndAColumn) {
  VideoWriter video(file_, 33, 17, 30);
  video.append(random_image(33, 17));
  video.finish();
  EXPECT_EQ(probe(file_), "32,16,yuv420p,30/1,1\n");
}

TEST_F(Video, AnUnfinishedOneLeavesNothing) {
  {
    VideoWriter video(file_, 64, 48, 30);
    video.append(plain_image(64, 48, 10));
  }
  EXPECT_TRUE(std::filesystem::is_empty(directory_.path()));
}

// ffmpeg writes its buffer when its input ends, and ignores errors at that point by itself.
TEST_F(Video, AFullDiskAtAnyPointLeavesNoVideo) {
  for (const size_t pages : {1, 4, 16}) {
    test::on_a_small_disk(pages * 4096, [](const test::SmallDisk& disk) {
      const std::filesystem::path file = disk.directory / "video.mp4";
      try {
        VideoWriter video(file, 320, 240, 24);
        for (int i = 0; i < 12; ++i) video.append(random_image(320, 240));  // noise, of 100 kB
        video.finish();
        ADD_FAILURE() << "no error was thrown";
      } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::io);
        EXPECT_THAT(error.what(),
                    testing::StartsWith(file.string() + ": cannot be written: ffmpeg"));
      }
      EXPECT_TRUE(std::filesystem::is_empty(disk.directory));
    });
  }
}

TEST_F(Video, WithoutFfmpegSaysWhatToInstall) {
  const std::string path = std::getenv("PATH");
  ::setenv("PATH", directory_.path().c_str(), 1);
  try {
    VideoWriter video(file_, 64, 48, 30);
    ADD_FAILURE() << "no error was thrown";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::io);
    EXPECT_THAT(error.what(), HasSubstr("ffmpeg"));
    EXPECT_THAT(error.what(), HasSubstr("apt"));
  }
  ::setenv("PATH", path.c_str(), 1);
}

}  // namespace
}  // namespace pilesim
