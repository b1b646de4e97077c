#include "json/object_codec.h"
#include "scene/scene_format.h"

namespace pilesim {

namespace {

Codec<PairMethod> sphere_method() {
  return enumeration<PairMethod>(
      {{"statistical", PairMethod::statistical}, {"particle", PairMethod::particle}});
}

Codec<DetailLevel> level_codec() {
  using L = DetailLevel;
  const Codec<PairMethod> any_method =
      enumeration<PairMethod>({{"impulse", PairMethod::impulse},
                               {"statistical", PairMethod::statistical},
                               {"particle", PairMethod::particle}});
  return object<L>(
      {.noun = "a level of detail",
       .fields = {
           field<L>("near_near", &L::near_near, any_method,
                    "Method for two bodies that are each near a must-impulse body: (I', I'). "
                    "statistical: with the method dissertation only."),
           field<L>("near_far", &L::near_far, sphere_method(),
                    "Method for such a body and one that is near none: (I', S)."),
           field<L>("far_far", &L::far_far, sphere_method(),
                    "Method for two bodies that are near none: (S, S)."),
           field<L>("exact", &L::exact, boolean(),
                    "Bodies of this level count as near a must-impulse body wherever they are."),
       }});
}

Codec<PairRule> pair_rule_codec() {
  using R = PairRule;
  return object<R>(
      {.noun = "a rule for pairs",
       .fields = {
           required_field<R>("a", &R::a, text(), "Name of a body or an emitter."),
           required_field<R>("b", &R::b, text(), "Name of a body or an emitter, perhaps the same."),
           required_field<R>("method", &R::method, sphere_method(),
                             "Method for pairs of the two at any level."),
       }});
}

Codec<LevelOfDetail> detail_codec() {
  using D = LevelOfDetail;
  constexpr int kMostLevels = 8;
  return object<D>(
      {.noun = "the level of detail",
       .fields = {
           field<D>("levels", &D::levels, list(level_codec(), 1),
                    "Methods for pairs, from the finest level to the coarsest. A pair has the "
                    "finer level of its two bodies. Default: a level with impulse near and "
                    "statistical elsewhere, and one of particles; with the method dissertation, "
                    "its Table 4.1."),
           field<D>("level", &D::level, integer(1, kMostLevels),
                    "The finest level that is used, counted from 1; without the keys below, the "
                    "level of all bodies."),
           field<D>("distances_m", &D::distances_m, list(number(above(0))),
                    "Distances from the camera, m, ascending: beyond the first one level 2 holds, "
                    "and so on."),
           field<D>("screen_sizes", &D::screen_sizes, list(number(above(0))),
                    "Diameters on the screen as shares of the picture's height, descending: below "
                    "the first one level 2 holds, and so on."),
           field<D>("speeds", &D::speeds, list(number(above(0))),
                    "Speeds, m/s, ascending: above the first one level 2 holds, and so on."),
           optional_field<D>("out_of_view", &D::out_of_view, integer(1, kMostLevels),
                             "The level of bodies that the camera does not see."),
           field<D>("hysteresis", &D::hysteresis, number(between(0, 0.9)),
                    "Share of a limit by which it must be passed before a level changes."),
           field<D>("pairs", &D::pairs, list(pair_rule_codec()),
                    "Pairs that one method takes at any level, the last rule first."),
       }});
}

}  // namespace

Codec<Preference> preference_codec() {
  return enumeration<Preference>({{"must_impulse", Preference::must_impulse},
                                  {"prefer_statistical", Preference::prefer_statistical}});
}

Codec<Method> method_codec() {
  return enumeration<Method>({{"own", Method::own}, {"dissertation", Method::dissertation}});
}

Codec<SimulatorSettings> simulator_codec() {
  using S = SimulatorSettings;
  return object<S>(
      {.noun = "the simulator",
       .fields = {
           field<S>("mode", &S::mode,
                    enumeration<SimulatorMode>({{"impulse", SimulatorMode::impulse},
                                                {"statistical", SimulatorMode::statistical},
                                                {"particle", SimulatorMode::particle},
                                                {"mixed", SimulatorMode::mixed}}),
                    "impulse: contacts are solved exactly; statistical: collisions are sampled "
                    "from the shapes' signatures; particle: spheres bounce; mixed: contacts are "
                    "solved near must-impulse bodies, statistical or particles elsewhere."),
           field<S>("engine", &S::engine,
                    enumeration<EngineKind>(
                        {{"exact", EngineKind::exact}, {"bullet", EngineKind::bullet}}),
                    "Engine that solves contacts. exact: pilesim's own, for the impulse and the "
                    "mixed mode; bullet: a second opinion for the impulse mode."),
           field<S>("method", &S::method, method_codec(),
                    "Statistical and mixed mode: pilesim's own method, or dissertation, chapters 3 "
                    "and 4 as they are written, to compare with."),
           field<S>("sleeping", &S::sleeping, boolean(),
                    "Bodies at rest leave the solver until they are touched."),
           field<S>(
               "rest_control", &S::rest_control, boolean(),
               "Statistical mode: bodies that lie alone on a floor or a slope turn into a rest "
               "pose of their signature; bodies on others or against walls turn towards one."),
           field<S>("solver_iterations", &S::solver_iterations, integer(1, 1000),
                    "Sweeps of the velocity solver in a step: of Bullet, of the statistical and "
                    "the particle mode (8 are enough) and of the mixed mode. The exact engine "
                    "alone does not use it."),
           field<S>(
               "level_of_detail", &S::detail, detail_codec(),
               "Mixed mode: the methods for pairs, and the rules that give each body a level."),
       }});
}

}  // namespace pilesim
