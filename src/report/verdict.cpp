#include "report/verdict.h"

#include <nlohmann/json.hpp>

#include "core/text.h"
#include "report/figure_text.h"
#include "report/html.h"

namespace pilesim {
namespace {

using Json = nlohmann::ordered_json;

std::string bodies(uint64_t count) { return grouped(count) + (count == 1 ? " body" : " bodies"); }

std::string settled_text(const Json& figures) {
  const Json& end = figures["quality_at_end"];
  const uint64_t all = end["bodies"], moving = end["unsettled"];
  if (all == 0) return "No body that moves is there at the end.";
  if (moving > 0) {
    return grouped(moving) + " of " + bodies(all) + (moving == 1 ? " still moves" : " still move") +
           " at the end: give the scene a longer <code>duration_s</code>, or "
           "<code>\"until\": \"settled\"</code>.";
  }
  return all == 1 ? "The body is at rest at the end."
                  : "All " + bodies(all) + " are at rest at the end.";
}

std::string soundness_text(const Json& end, bool good) {
  std::string text;
  const double deepest = end["deepest_penetration_diameters"];
  const uint64_t escaped = end["escaped"], floating = end["floating"];
  if (escaped > 0) text += bodies(escaped) + " escaped through a wall or the ground. ";
  if (floating > 0) text += bodies(floating) + " rest on nothing. ";
  if (end["overlapping_pairs"] == 0) return text + "No two bodies overlap.";
  text += "Where bodies touch they overlap by " + share_text(end["mean_penetration_diameters"]) +
          " of a body&rsquo;s size in the mean and " + share_text(deepest) + " (" +
          length_text(end["deepest_penetration_m"]) + ") at the deepest";
  if (good) return text + ".";
  return text + (deepest > kSoundOverlap
                     ? "; up to 2 % counts as sound. <code>pilesim finish</code> parts them."
                     : ".");
}

// The verdict on a pile in the shape of a guide.
struct GuideVerdict {
  bool kept = true, filled = true;
  std::vector<std::string> sentences;
};

GuideVerdict guide_verdict(const Json& figures) {
  GuideVerdict result;
  if (!figures.contains("piles") || !figures["piles"].is_object()) return result;
  const Json guide = figures["piles"].value("guide", Json::object());
  if (!guide.contains("bodies_inside") || !guide.contains("filled_share")) return result;
  const double inside = guide["bodies_inside"], filled = guide["filled_share"];
  const bool was_filled = guide.contains("filling");
  const double at_start = was_filled ? guide["filling"].value("filled_share", 1.0) : filled;
  result.kept = inside >= kKeptShape && filled >= at_start - (1 - kKeptShape);
  result.filled = at_start >= kFilled;
  std::string text = share_text(inside) + " of the bodies are inside the guide at the end, and " +
                     share_text(filled) + " of it is filled";
  if (was_filled) {
    text += " (" + share_text(at_start) + " at the start); the pile&rsquo;s outline has moved by " +
            length_text(guide.value("outline_moved_m", 0.0));
  }
  result.sentences.push_back(text + ".");
  if (!result.kept) {
    result.sentences.emplace_back(
        "The pile has not kept the shape: it has slumped, or something has hit it.");
  }
  if (!was_filled) return result;
  for (const Json& part : guide["filling"].value("empty", Json::array())) {
    result.sentences.push_back("When it was filled, " + escaped(part.value("what", "")) + ".");
  }
  return result;
}

std::string speed_text(const Json& figures) {
  const Json& time = figures["time"];
  const double a_second = time["wall_per_simulated_second"];
  std::string text = "It took " + duration_text(time["total_s"]) + " with " +
                     std::to_string(figures["threads"].get<int>()) +
                     (figures["threads"] == 1 ? " thread" : " threads");
  if (a_second <= 0) return text + ".";
  return text + ", " + duration_text(a_second) + " for each simulated second" +
         (a_second < 1 ? ": faster than real time." : ".");
}

}  // namespace

Verdict verdict(const Json& figures) {
  const Json& end = figures["quality_at_end"];
  const bool settled = end["unsettled"] == 0;
  const bool sound = end["escaped"] == 0 && end["floating"] == 0 &&
                     end["deepest_penetration_diameters"].get<double>() <= kSoundOverlap;
  Verdict result{.good = settled && sound};
  result.headline = std::string(settled ? "At rest" : "Still moving") +
                    (settled == sound ? " and " : ", but ") + (sound ? "sound" : "not sound");
  const GuideVerdict guide = guide_verdict(figures);
  if (!guide.kept) result.headline += "; the guide&rsquo;s shape is lost";
  if (!guide.filled) result.headline += "; the guide is not full";
  result.good = result.good && guide.kept && guide.filled;
  if (figures["interrupted"].get<bool>()) {
    result.good = false;
    result.sentences.emplace_back("<b>Interrupted:</b> shorter than the scene asks for.");
  }
  result.sentences.insert(result.sentences.end(), guide.sentences.begin(), guide.sentences.end());
  result.sentences.push_back(settled_text(figures));
  result.sentences.push_back(soundness_text(end, sound));
  size_t failed = 0;
  for (const Json& gate : figures["gates"]) failed += gate["passed"].get<bool>() ? 0 : 1;
  if (failed > 0) {
    result.good = false;
    result.sentences.push_back("It fails " + std::to_string(failed) + " of " +
                               std::to_string(figures["gates"].size()) + " quality gates.");
  }
  result.sentences.push_back(speed_text(figures));
  return result;
}

}  // namespace pilesim
