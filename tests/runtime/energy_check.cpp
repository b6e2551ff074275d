// SPDX-License-Identifier: Apache-2.0
// energy_check BUNDLE.h5 PLACES [FRAMES [SEED]]: presses a mass on a spring into PLACES random places of the
// surface of a bundle for FRAMES frames (60000, a minute) at 1 kHz, undamped, with the reaction alone, with
// tracking, with friction, with both and with passivity. Prints a line for each: the places that gained more
// than 1 %, the largest energy ever as a share of that at the start, with what the contact stores and of the
// probe alone, and that at the end. Exit code 2 where the bundle
// cannot be used. scripts/check_energy runs it on the samples.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "sqmap/io/bundle.hpp"

#include "support/energy.hpp"

namespace {

using namespace sqmap;

// A gain that is no rounding of the rule by which the mass moves.
constexpr double kGain = 0.01;

struct Model {
  const char* name;
  bool has_tracking, has_friction, has_passivity;
};
constexpr Model kModels[] = {
    {"reaction", false, false, false},        {"tracking", true, false, false},
    {"friction", false, true, false},         {"tracking+friction", true, true, false},
    {"passivity", false, false, true},        {"tracking+passivity", true, false, true},
    {"friction+passivity", false, true, true}};

int refuse(const Error& error) {
  std::fprintf(stderr, "energy_check: error: %s; %s\n", error.finding.c_str(), error.remedy.c_str());
  return 2;
}

int check(const std::filesystem::path& bundle, std::size_t count, int frames, std::uint64_t seed) {
  const auto asset = io::read(bundle);
  if (!asset) return refuse(asset.error());
  const auto object = runtime::Object::build(asset.value());
  if (!object) return refuse(object.error());
  // Lengths are shares of the object, so that the same is asked of all.
  const double length_m = asset.value().r_max_m;
  test::Press how;
  how.frames = frames;
  how.below_m = how.above_m = 0.01 * length_m;
  how.aside_m = 0.005 * length_m;
  const auto places = test::surface_places(object.value(), count, how.above_m, seed);
  const std::vector<runtime::SceneObject> objects{{&asset.value(), {}}};
  for (const Model& model : kModels) {
    double most = 0, most_of_probe = 0, sum_last = 0;
    std::size_t gaining = 0, worst = 0;
    for (std::size_t k = 0; k < places.size(); ++k) {
      runtime::SceneOptions options;
      options.query.layer = runtime::Layer::kThree;
      options.effects.push_back(
          {"reaction", {{"stiffness_n_per_m", static_cast<float>(how.stiffness_n_per_m)}}});
      if (model.has_tracking)
        options.effects.push_back({"tracking",
                                   {{"catch_up_m", static_cast<float>(1e-4 * length_m)},
                                    {"lose_m", static_cast<float>(1e-2 * length_m)}}});
      if (model.has_friction) options.effects.push_back({"friction", {}});
      if (model.has_passivity) options.effects.push_back({"passivity", {}});
      auto scene = runtime::Scene::build(objects, {{{0, 0, 0}}}, options);
      if (!scene) return refuse(scene.error());
      const test::Energy energy = test::press(scene.value(), how, places[k].point_m, places[k].normal,
                                              test::across(places[k].normal));
      if (energy.most > most) worst = k;
      most = std::max(most, energy.most);
      most_of_probe = std::max(most_of_probe, energy.most_of_probe);
      sum_last += energy.last;
      gaining += energy.most_of_probe > 1 + kGain ? 1 : 0;
    }
    const Vec3d at = places.empty() ? Vec3d{} : places[worst].point_m;
    std::printf("%-16s %-18s %6zu %8zu %10.4f %10.4f %10.4f   %9.4g %9.4g %9.4g\n", bundle.stem().c_str(),
                model.name, places.size(), gaining, most, most_of_probe,
                sum_last / static_cast<double>(std::max<std::size_t>(1, places.size())), at.x, at.y, at.z);
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const long count = argc >= 3 ? std::atol(argv[2]) : 0, frames = argc >= 4 ? std::atol(argv[3]) : 60000,
             seed = argc >= 5 ? std::atol(argv[4]) : 1;
  if (count < 1 || frames < 1 || seed < 0 || argc > 5) {
    std::fprintf(stderr, "usage: energy_check BUNDLE.h5 PLACES [FRAMES [SEED]]\n");
    return 2;
  }
  return check(argv[1], static_cast<std::size_t>(count), static_cast<int>(frames),
               static_cast<std::uint64_t>(seed));
}
