#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <set>

#include "batch/plan.h"
#include "batch/steps.h"
#include "core/error.h"
#include "support/scratch_directory.h"

namespace pilesim {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class BatchPlanTest : public testing::Test {
 protected:
  BatchPlanTest() {
    write("scene.json", R"({"version": 1, "materials": {"oak": {"friction": 0.5}},
      "shapes": {"ball": {"type": "sphere", "radius": 0.1}},
      "bodies": [{"shape": "ball", "material": "oak"}]})");
  }

  void write(const std::string& name, const std::string& text) const {
    std::ofstream(scratch_ / name) << text;
  }
  BatchPlan plan(const std::string& more) const {
    write("plan.json",
          R"({"version": 1, "scene": "scene.json", "steps": [["simulate"]])" + more + "}");
    return load_batch_plan(scratch_ / "plan.json");
  }
  std::string fault(const std::string& more) const {
    try {
      JobKeys{plan(more)};
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::input);
      return error.what();
    }
    return "";
  }
  static std::vector<std::string> texts(const BatchJob& job) {
    std::vector<std::string> texts;
    for (const JobValue& value : job.values) texts.push_back(override_text(value));
    return texts;
  }

  test::ScratchDirectory scratch_;
};

TEST_F(BatchPlanTest, SpansAGridWhoseLastVariationRunsFastest) {
  const BatchPlan grid = plan(R"(, "count": 2, "vary": [
    {"set": "/materials/oak/friction", "values": [0.2, 0.4]}, {"set": "/seed", "range": [5, 7]}])");
  ASSERT_EQ(grid.jobs(), 12u);
  EXPECT_THAT(texts(batch_job(grid, 0)), ElementsAre("/materials/oak/friction=0.2", "/seed=5"));
  EXPECT_THAT(texts(batch_job(grid, 1)), ElementsAre("/materials/oak/friction=0.2", "/seed=6"));
  EXPECT_THAT(texts(batch_job(grid, 5)), ElementsAre("/materials/oak/friction=0.4", "/seed=7"));
  EXPECT_THAT(texts(batch_job(grid, 6)), ElementsAre("/materials/oak/friction=0.2", "/seed=5"));
}

TEST_F(BatchPlanTest, SetsSeveralPointersTogether) {
  const BatchPlan zip = plan(R"(, "vary": [
    {"set": ["/materials/oak/friction", "/seed"], "values": [[0.2, 1], [0.4, 2]]}])");
  ASSERT_EQ(zip.jobs(), 2u);
  EXPECT_THAT(texts(batch_job(zip, 1)), ElementsAre("/materials/oak/friction=0.4", "/seed=2"));
}

TEST_F(BatchPlanTest, RangesEndWhereTheySayInSpiteOfRounding) {
  const BatchPlan range = plan(R"(, "vary": [{"set": "/duration_s", "range": [0.1, 0.7, 0.1]}])");
  ASSERT_EQ(range.jobs(), 7u);
  EXPECT_NEAR(batch_job(range, 6).values[0].value.get<double>(), 0.7, 1e-12);
}

TEST_F(BatchPlanTest, NamesFilesAsTheSceneWould) {
  std::filesystem::create_directory(scratch_ / "meshes");
  for (const char* name : {"meshes/b.obj", "meshes/a.obj", "meshes/c.stl", "meshes/.x.obj"})
    write(name, "");
  const BatchPlan files = plan(R"(, "vary": [{"set": "/name", "files": "meshes/*.obj"}])");
  ASSERT_EQ(files.jobs(), 2u);
  EXPECT_EQ(batch_job(files, 0).values[0].value, "meshes/a.obj");
  EXPECT_EQ(batch_job(files, 1).values[0].value, "meshes/b.obj");
}

TEST_F(BatchPlanTest, DrawsForEachJobByItself) {
  const std::string draws = R"("vary": [{"set": "/duration_s", "uniform": [2, 4]},
    {"set": "/materials/oak/friction", "log_uniform": [0.01, 1]},
    {"set": "/frame_rate", "integers": [24, 26]}, {"set": "/name", "choice": ["a", "b"]}])";
  const BatchPlan few = plan(R"(, "count": 10, )" + draws);
  const BatchPlan many = plan(R"(, "count": 4000, )" + draws);
  EXPECT_EQ(texts(batch_job(few, 7)), texts(batch_job(many, 7)));

  double sum = 0, log_sum = 0;
  std::map<int, int> rates;
  for (uint64_t i = 0; i < many.jobs(); ++i) {
    const BatchJob job = batch_job(many, i);
    const double duration = job.values[0].value, friction = job.values[1].value;
    ASSERT_TRUE(duration >= 2 && duration <= 4 && friction >= 0.01 && friction <= 1);
    sum += duration;
    log_sum += std::log10(friction);
    ++rates[job.values[2].value];
  }
  // Four standard errors.
  EXPECT_NEAR(sum / 4000, 3, 4 * (2 / std::sqrt(12.0)) / std::sqrt(4000.0));
  EXPECT_NEAR(log_sum / 4000, -1, 4 * (2 / std::sqrt(12.0)) / std::sqrt(4000.0));
  ASSERT_EQ(rates.size(), 3u);
  for (const int rate : {24, 25, 26})
    EXPECT_NEAR(rates[rate], 4000 / 3.0, 4 * std::sqrt(4000 * 2 / 9.0));
}

TEST_F(BatchPlanTest, SeedsAreOfEachJobAndAttempt) {
  const BatchPlan drawn = plan(R"(, "count": 500)");
  std::set<uint64_t> seeds;
  for (uint64_t i = 0; i < 500; ++i) {
    for (const int attempt : {0, 1, 2}) {
      seeds.insert(scene_seed(drawn, batch_job(drawn, i), attempt));
    }
  }
  EXPECT_EQ(seeds.size(), 1500u);
  EXPECT_LT(*seeds.rbegin(), uint64_t{1} << 53);

  const BatchPlan given = plan(R"(, "vary": [{"set": "/seed", "values": [42]}])");
  EXPECT_EQ(scene_seed(given, batch_job(given, 0), 0), 42u);
  EXPECT_NE(scene_seed(given, batch_job(given, 0), 1), 42u);
}

TEST_F(BatchPlanTest, KeysChangeWithWhatAJobIsMadeOf) {
  const auto keys = [&](const std::string& more) {
    const BatchPlan made = plan(more);
    const JobKeys all(made);
    return std::pair(all.key(batch_job(made, 0)), all.key(batch_job(made, 1)));
  };
  const std::string vary = R"(, "vary": [{"set": "/duration_s", "values": [1, 2]}])";
  const auto [first, second] = keys(vary);
  EXPECT_NE(first, second);
  EXPECT_EQ(keys(vary + R"(, "count": 3)").first, first);  // more of the same jobs
  EXPECT_EQ(keys(vary + R"(, "tries": 3, "longest_s": 5, "name": "n")").first, first);
  const auto [same, other] = keys(R"(, "vary": [{"set": "/duration_s", "values": [1, 3]}])");
  EXPECT_EQ(same, first);
  EXPECT_NE(other, second);
  EXPECT_NE(keys(vary + R"(, "drop": ["run/frames"])").first, first);
  write("scene.json", R"({"version": 1, "frame_rate": 30})");
  EXPECT_NE(keys(vary).first, first);
}

TEST_F(BatchPlanTest, SaysWhatIsWrongAndWhere) {
  EXPECT_THAT(fault(R"(, "vary": [{"set": "seed", "values": [1]}])"),
              HasSubstr("/vary/0/set: is \"seed\", which no step has in braces; expected a JSON "
                        "pointer into the scene (\"/seed\"), or {seed} in a step"));
  EXPECT_THAT(fault(R"(, "vary": [{"set": "a b", "values": [1]}])"),
              HasSubstr("/vary/0/set: is \"a b\"; expected a JSON pointer"));
  EXPECT_THAT(fault(R"(, "drop_packed": ["run"])"), HasSubstr("expected \"tar\" in \"collect\""));
  EXPECT_THAT(fault(R"(, "collect": ["tar", "bop"], "drop_packed": ["run"])"),
              HasSubstr("/drop_packed: would remove files that \"coco\" and \"bop\" collect"));
  EXPECT_THAT(fault(R"(, "vary": [{"set": "/seed"}])"),
              HasSubstr("has no \"values\" or \"range\""));
  EXPECT_THAT(fault(R"(, "vary": [{"set": "/seed", "range": [3, 1]}])"),
              HasSubstr("/vary/0/range: is an array of 2 values; expected [first, last]"));
  EXPECT_THAT(fault(R"(, "vary": [{"set": "/name", "files": "none/*.obj"}])"),
              HasSubstr("no file has such a name"));
  EXPECT_THAT(
      fault(R"(, "vary": [{"set": "/seed", "values": [1]}, {"set": "/seed", "values": [2]}])"),
      HasSubstr("/vary/1/set: sets \"/seed\" again"));
  EXPECT_THAT(fault(R"(, "vary": [{"set": ["/seed", "/name"], "values": [1]}])"),
              HasSubstr("/vary/0/values/0: is 1; expected an array of 2 values"));
  EXPECT_THAT(fault(R"(, "drop": ["../x"])"), HasSubstr("/drop/0"));
  EXPECT_THAT(fault(R"(, "tries": 0)"), HasSubstr("/tries: is 0; expected an integer from 1"));
  EXPECT_THAT(fault(R"(, "vary": [{"set": "/materials/elm/friction", "values": [1]}])"),
              HasSubstr("--set /materials/elm/friction=1: the scene has no material \"elm\", and "
                        "nothing would use it; expected one of \"oak\""));
  // The scene's own checks test each value before any job runs.
  EXPECT_THAT(fault(R"(, "vary": [{"set": "/duration_s", "values": [1, -2]}])"),
              HasSubstr("--set /duration_s=-2"));
  const std::string both =
      fault(R"(, "vary": [{"set": "/seed", "values": [1], "integers": [1, 2]}])");
  EXPECT_THAT(both, HasSubstr("/vary/0/integers: stands beside \"values\""));
  EXPECT_EQ(std::ranges::count(both, '\n'), 0) << both;
}

TEST_F(BatchPlanTest, StepsAreCommandsWithoutWhatTheBatchSays) {
  const auto fault_of = [&](const std::string& steps) {
    write("plan.json", R"({"version": 1, "scene": "scene.json", "steps": )" + steps + "}");
    try {
      load_batch_plan(scratch_ / "plan.json");
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(fault_of(R"([["simulate"], ["render", "--size", "64x48"], ["export", "-o", "a.npz"]])"),
            "");
  EXPECT_EQ(fault_of(R"([["simulate"], ["render"], ["simulate", "--take", "3"],
                         ["render", "-o", "night"]])"),
            "");
  EXPECT_EQ(fault_of(R"([["compare", "--modes", "impulse"]])"), "");
  EXPECT_THAT(fault_of(R"([["render", "a"]])"),
              HasSubstr("/scene: stands beside a first step \"render\""));
  EXPECT_THAT(fault_of(R"([["finish"]])"), HasSubstr("/steps/0/0: is \"finish\""));
  EXPECT_THAT(fault_of(R"([["compare"], ["render"]])"),
              HasSubstr("/steps/1/0: is \"render\"; expected no further step after \"compare\""));
  EXPECT_THAT(fault_of(R"([["simulate"], ["render", "-o", "../x"]])"),
              HasSubstr("/steps/1: draws into \"../x\""));
  EXPECT_THAT(fault_of(R"([["simulate"], ["render", "--frames", "{f}"]])"),
              HasSubstr("/steps/1/2: has {f}; expected a name that \"vary\" sets"));
  EXPECT_THAT(fault_of(R"([["simulate"], ["batch"]])"), HasSubstr("/steps/1/0: is \"batch\""));
  EXPECT_THAT(fault_of(R"([["simulate", "--threads", "2"]])"),
              HasSubstr("/steps/0/1: is \"--threads\""));
  EXPECT_THAT(fault_of(R"([["simulate", "-o", "x"]])"), HasSubstr("/steps/0/1: is \"-o\""));
}

std::vector<std::string> words_of(const BatchPlan& plan, uint64_t job, size_t step) {
  return step_words(plan, batch_job(plan, job), step, 5, 2);
}

TEST_F(BatchPlanTest, EachStepTakesWhatTheOneBeforeItLeft) {
  write("plan.json", R"({"version": 1, "scene": "scene.json",
    "vary": [{"set": "/duration_s", "values": [2]}, {"set": "night", "values": ["dark", "light"]}],
    "steps": [["simulate"], ["finish"], ["render"], ["simulate", "--take", "3"],
              ["render", "-o", "{night}"], ["export", "-o", "a.npz"]]})");
  const BatchPlan plan = load_batch_plan(scratch_ / "plan.json");
  const std::string scene = (scratch_ / "scene.json").string();
  EXPECT_THAT(words_of(plan, 1, 0),
              ElementsAre("simulate", scene, "-o", "run", "--resume", "--no-picture", "--set",
                          "/duration_s=2", "--seed", "5", "--threads", "2"));
  EXPECT_THAT(words_of(plan, 1, 1), ElementsAre("finish", "run", "-o", "finished", "--scene", scene,
                                                "--resume", "--no-picture", "--threads", "2"));
  EXPECT_THAT(words_of(plan, 1, 2),
              ElementsAre("render", "finished", "--resume", "--threads", "2"));
  EXPECT_THAT(words_of(plan, 1, 3),
              ElementsAre("simulate", scene, "-o", "run_2", "--resume", "--no-picture", "--from",
                          "finished", "--set", "/duration_s=2", "--seed", "6", "--threads", "2",
                          "--take", "3"));
  EXPECT_THAT(words_of(plan, 1, 4),
              ElementsAre("render", "run_2", "--resume", "--threads", "2", "-o", "light"));
  EXPECT_THAT(words_of(plan, 1, 5), ElementsAre("export", "run_2", "--force", "-o", "a.npz"));
  EXPECT_THAT(picture_directories(plan, batch_job(plan, 0)), ElementsAre("finished", "dark"));
}

TEST_F(BatchPlanTest, MeshesAndRangesOfFramesNeedNoScene) {
  for (const char* name : {"a.obj", "b.obj"}) write(name, name);
  write("plan.json", R"({"version": 1, "vary": [{"set": "mesh", "files": "*.obj"}],
    "steps": [["sample-signature", "{mesh}", "--trials", "9"]]})");
  const BatchPlan meshes = load_batch_plan(scratch_ / "plan.json");
  EXPECT_THAT(words_of(meshes, 1, 0),
              ElementsAre("sample-signature", (scratch_ / "b.obj").string(), "-o", "signature.sig",
                          "--seed", "5", "--threads", "2", "--trials", "9"));
  const std::string before = JobKeys(meshes).key(batch_job(meshes, 1));
  write("b.obj", "another");
  EXPECT_NE(JobKeys(meshes).key(batch_job(meshes, 1)), before);

  write("plan.json", R"({"version": 1, "vary": [{"set": "frames", "values": ["0-9", "10-"]}],
    "steps": [["render", "pile", "--frames", "{frames}"]]})");
  const BatchPlan ranges = load_batch_plan(scratch_ / "plan.json");
  EXPECT_THAT(words_of(ranges, 1, 0),
              ElementsAre("render", (scratch_ / "pile").string(), "-o", "run", "--resume",
                          "--threads", "2", "--frames", "10-"));
}

TEST(BatchPresets, AreSoundWithAllTheirValues) {
  const std::filesystem::path presets = std::filesystem::path(PILESIM_SOURCE_DIR) / "presets/batch";
  int plans = 0;
  for (const auto& entry : std::filesystem::directory_iterator(presets)) {
    if (entry.path().stem().extension() != ".plan") continue;
    ++plans;
    EXPECT_NO_THROW(JobKeys{load_batch_plan(entry.path())}) << entry.path();
  }
  EXPECT_GE(plans, 1);
}

}  // namespace
}  // namespace pilesim
