// Files of signatures: what is read back, and that only written content is.
#include <gmock/gmock.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "core/atomic_file.h"
#include "core/error.h"
#include "signature/response_model.h"
#include "signature/rest/known_rest_poses.h"
#include "signature/signature_file.h"
#include "signature/signature_fitting.h"

namespace pilesim {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

Axis axis(const std::string& name, std::vector<float> nodes) {
  return {.name = name, .unit = "rad", .nodes = std::move(nodes)};
}

// Responses with two nodes per axis, eight heights, and `poses` rest poses from each source.
Signature small(size_t poses) {
  Signature s;
  s.body = {.mesh = "box.obj",
            .mesh_hash = "0123456789abcdef0123456789abcdef",
            .hull_vertices = 8,
            .volume_m3 = 1,
            .inertia_m2 = Vec3(0.1, 0.2, 0.3),
            .gyration_m = 0.5,
            .outer_radius_m = 0.9};
  s.heights.spin = axis("spin", {0, 1, 2, 3, 4, 5, 6, 7});
  s.heights.tilt = axis("tilt", {0, 1, 2, 3, 4, 5, 6, 7});
  for (auto* values :
       {&s.heights.trials, &s.heights.mean_m, &s.heights.deviation_m, &s.heights.error_m}) {
    for (int i = 0; i < 64; ++i) values->push_back(0.1F + 0.01F * static_cast<float>(i));
  }
  s.responses.axes = {axis("theta", {0, 1}), axis("phi", {0, 1}), axis("psi", {0, 1}),
                      axis("alpha", {0, 1})};
  const size_t cells = s.responses.cell_count();
  s.responses.trials.assign(cells, 10);
  for (size_t i = 0; i < kFactorSize * cells; ++i) {
    const auto value = static_cast<float>(i % 97) / 100;
    s.responses.spread.push_back(value);
    if (i < 6 * cells) s.responses.mean.push_back(0.5F - value);
  }
  s.responses.mean_error.assign(6 * cells, 0.01F);
  const PackingFigures figures{0.5, 5, 0.4, 3, 4, 0.45, 0.55, 0.56, 1.2, 20, 0.7, 6};
  s.packing = {.pours = 3,
               .measured = figures,
               .error = figures,
               .spheres = figures,
               .radius_m = 0.55,
               .rolling = 0.2,
               .turning = 0.05,
               .leaning = 0.1,
               .rebound = 0.7};
  s.rest_drops = 200;
  for (size_t i = 0; i < 2 * poses; ++i) {
    const double angle = static_cast<double>(i % poses);
    KnownRestPose pose{.up = Vec3(std::cos(angle), std::sin(angle), 0),
                       .height_m = 0.25,
                       .probability = 0.125,
                       .probability_low = 0.125,
                       .probability_high = 0.125,
                       .source = i < poses ? "geometry" : "simulation",
                       .family = static_cast<uint32_t>(i % poses)};
    if (i >= poses) {
      const ShareInterval interval = wilson_interval(25, 200);
      pose.probability_low = interval.low;
      pose.probability_high = interval.high;
    }
    s.rest_poses.push_back(pose);
  }
  return s;
}

class SignatureFile : public testing::Test {
 protected:
  ~SignatureFile() override { std::filesystem::remove(file_); }

  std::string bytes_of(const Signature& signature) {
    write_signature(signature, file_);
    return read_file(file_);
  }
  // The reason for rejecting these bytes.
  std::string refusal(const std::string& bytes) {
    write_file_atomically(file_, bytes);
    try {
      read_signature(file_);
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::input);
      EXPECT_THAT(error.what(), AllOf(HasSubstr(file_.string()),
                                      HasSubstr("Measure it again with pilesim sample-signature")));
      return error.what();
    }
    ADD_FAILURE() << "was accepted";
    return {};
  }

  std::filesystem::path file_ =
      std::filesystem::path(testing::TempDir()) /
      (std::string(testing::UnitTest::GetInstance()->current_test_info()->name()) + ".sig");
};

TEST_F(SignatureFile, ComesBack) {
  const Signature signature = small(3);
  write_signature(signature, file_);
  const Signature back = read_signature(file_);
  EXPECT_EQ(encode_signature(back), encode_signature(signature));
  ASSERT_TRUE(back.packing);
  EXPECT_EQ(back.packing->radius_m, 0.55);
  EXPECT_EQ(back.packing->spheres.column_spread, 4);
  EXPECT_EQ(back.packing->measured.time, 20);
  EXPECT_EQ(back.packing->turning, 0.05);
  EXPECT_EQ(back.packing->leaning, 0.1);
  EXPECT_EQ(back.packing->rebound, 0.7);
  EXPECT_EQ(back.packing->measured.large_heap_spread, 6);
  ASSERT_EQ(back.rest_poses.size(), 6u);
  EXPECT_EQ(back.rest_poses[0].source, "geometry");
  EXPECT_EQ(back.rest_poses[0].probability_high, 0.125);
  const KnownRestPose& pose = back.rest_poses[4];
  EXPECT_EQ(pose.source, "simulation");
  EXPECT_EQ(pose.family, 1u);
  EXPECT_TRUE(pose.up.isApprox(signature.rest_poses[4].up, 1e-6));
  EXPECT_EQ(pose.probability_low, signature.rest_poses[4].probability_low);
  EXPECT_EQ(pose.probability_high, signature.rest_poses[4].probability_high);
}

TEST_F(SignatureFile, NoByteIsOtherThanItWasWritten) {
  const std::string whole = bytes_of(small(1));
  for (size_t i = 0; i < whole.size(); ++i) {
    std::string changed = whole;
    changed[i] = static_cast<char>(changed[i] ^ 1 << i % 8);
    refusal(changed);
    refusal(whole.substr(0, i));
    if (HasFailure()) FAIL() << "byte " << i;
  }
  EXPECT_THAT(refusal(whole + '\0'), HasSubstr("no complete CBOR"));
  EXPECT_THAT(refusal(whole + whole), HasSubstr("its checksum is not that of its content"));
  refusal("");
}

TEST_F(SignatureFile, OlderVersionsAreToldFromDamage) {
  nlohmann::json document = {{"format", "pilesim signature"}, {"version", 3}};
  const std::vector<uint8_t> old = nlohmann::json::to_cbor(document);
  EXPECT_THAT(refusal(std::string(old.begin(), old.end())),
              HasSubstr("format version 3; expected version 12"));
  const std::string whole = bytes_of(small(1));
  EXPECT_THAT(refusal(whole.substr(0, whole.size() - 17)), HasSubstr("its checksum is not there"));
}

TEST_F(SignatureFile, SpheresThatAreNoneAreRefused) {
  const auto refusal_of = [&](double Packing::*figure, double value) {
    Signature signature = small(1);
    *signature.packing.*figure = value;
    return refusal(bytes_of(signature));
  };
  EXPECT_THAT(refusal_of(&Packing::radius_m, 1e-300), HasSubstr("1e-300"));
  EXPECT_THAT(refusal_of(&Packing::radius_m, 1.1), HasSubstr("1.1"));  // the object's own is 0.9
  EXPECT_THAT(refusal_of(&Packing::rolling, 11), HasSubstr("11"));
  EXPECT_THAT(refusal_of(&Packing::turning, -1), HasSubstr("-1"));
  EXPECT_THAT(refusal_of(&Packing::leaning, 12), HasSubstr("12"));
  EXPECT_THAT(refusal_of(&Packing::rebound, 1.5), HasSubstr("1.5"));
}

TEST_F(SignatureFile, AFitPacksAsItsTable) {
  write_signature(small(1), file_);
  const FitRun run = fit_signature({.signature = file_, .max_bytes = 4000});
  ASSERT_TRUE(run.fitted.packing);
  EXPECT_EQ(run.fitted.packing->radius_m, 0.55);
  EXPECT_EQ(run.fitted.packing->measured.column_spread, 4);
}

TEST_F(SignatureFile, NestingWithoutEndIsRefused) {
  std::string maps;  // each inside the previous one
  for (int i = 0; i < 100'000; ++i)
    maps +=
        "\xa1\x61"
        "a";
  EXPECT_THAT(refusal(maps), HasSubstr("is nested too deeply"));
}

size_t fitted_bytes(const std::filesystem::path& file, size_t most) {
  const FitRun run = fit_signature({.signature = file, .max_bytes = most});
  EXPECT_EQ(encode_signature(run.fitted).size(), run.fitted_bytes);
  return run.fitted_bytes;
}

TEST_F(SignatureFile, BudgetHoldsAllThatIsStored) {
  for (const size_t poses : {0, 1, 20}) {
    write_signature(small(poses), file_);
    size_t least = 0;
    try {
      fitted_bytes(file_, 500);
      ADD_FAILURE() << "500 bytes are not enough";
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::usage);
      const std::string text = error.what();
      EXPECT_THAT(text, HasSubstr("of " + std::to_string(2 * poses) + " rest poses"));
      const std::string before = "expected at least ";
      least = std::stoul(text.substr(text.find(before) + before.size()));
    }
    for (const size_t more : {0, 1, 10, 100, 1000}) {
      EXPECT_LE(fitted_bytes(file_, least + more), least + more) << poses;
    }
  }
}

}  // namespace
}  // namespace pilesim
