#include <gtest/gtest.h>

#include "core/parallel_for.h"
#include "geometry/primitives.h"
#include "job/rest_drops.h"

namespace pilesim {
namespace {

TEST(RestDropsDeterminism, ThreadsDoNotChangeABit) {
  const auto drop = [](int threads) {
    set_thread_count(threads);
    return drop_to_rest(box_mesh({0.1, 0.2, 0.3}),
                        {.drops = 24, .seed = 5, .progress = ProgressMode::none})
        .rests;
  };
  const auto serial = drop(1), parallel = drop(4);
  ASSERT_EQ(serial.size(), parallel.size());
  for (size_t i = 0; i < serial.size(); ++i) {
    EXPECT_EQ(serial[i].up, parallel[i].up);
    EXPECT_EQ(serial[i].height_m, parallel[i].height_m);
  }
}

}  // namespace
}  // namespace pilesim
