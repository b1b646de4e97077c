// Time of a response's mean and covariance factor, fitted against interpolated in the table:
//   bspline_benchmark NAME.sig FITTED.sig...
// Ratios within one run, each the median over alternating rounds.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <string>
#include <vector>

#include "core/philox.h"
#include "report_errors.h"
#include "signature/response_model.h"
#include "signature/signature_file.h"

namespace pilesim {
namespace {

constexpr size_t kBodies = 10000;
constexpr int kRounds = 41;

double now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

void run(int argc, char** argv) {
  std::vector<Signature> signatures;
  for (int i = 1; i < argc; ++i) signatures.push_back(read_signature(argv[i]));
  std::vector<ResponseModel> models;
  for (const Signature& signature : signatures) models.emplace_back(signature);
  const ResponseTable& table = models.front().table();
  const auto k = static_cast<float>(signatures.front().body.gyration_m);
  Philox random(1, Stream::signature, 1);
  std::vector<ResponseKeys> keys;
  for (size_t i = 0; i < kBodies; ++i) {
    Vec3f v = random.direction().cast<float>(), w = random.direction().cast<float>() / k;
    v = Vec3f(std::hypot(v.x(), v.z()), -std::abs(v.y()), 0);
    keys.push_back(response_keys(table, k, 5 * v, static_cast<float>(random.uniform(0, 10)) * w));
  }
  std::vector<Vector6> means(kBodies);
  std::vector<SpreadFactor> factors(kBodies);
  std::vector<std::vector<double>> times(models.size());
  for (int round = 0; round < kRounds; ++round) {
    for (size_t m = 0; m < models.size(); ++m) {
      const double start = now_s();
      models[m].evaluate(keys, means, factors);
      times[m].push_back(now_s() - start);
    }
  }
  double first = 0;
  for (size_t m = 0; m < models.size(); ++m) {
    std::sort(times[m].begin(), times[m].end());
    const double body_ns = 1e9 * times[m][kRounds / 2] / kBodies;
    if (m == 0) first = body_ns;
    std::printf("%-28s %s  %7.1f ns a body  %.2f of the first\n", argv[m + 1],
                models[m].fitted() ? "fitted" : "table ", body_ns, body_ns / first);
  }
}

}  // namespace
}  // namespace pilesim

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fputs("usage: bspline_benchmark NAME.sig FITTED.sig...\n", stderr);
    return 2;
  }
  return pilesim::report_errors([&] { pilesim::run(argc, argv); });
}
