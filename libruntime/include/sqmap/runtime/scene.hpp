// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "sqmap/asset/asset.hpp"
#include "sqmap/asset/result.hpp"
#include "sqmap/runtime/effects/touches.hpp"

namespace sqmap::runtime {

/// An effect that a scene may name, and its parameters with ranges and defaults.
struct EffectInfo {
  struct Parameter {
    const char* name;
    float least, most, initial;
    bool is_whole;
  };
  const char* name;
  std::vector<Parameter> parameters;
};

/// All effects there are, in the order in which a frame runs them.
std::vector<EffectInfo> effect_table();

/// An effect that a scene wants, with the parameters that are not at their defaults.
struct EffectChoice {
  std::string name;
  std::vector<std::pair<std::string, float>> values;
};

/// An object of a scene. Objects of one asset share its tables.
struct SceneObject {
  const Asset* asset{};  ///< used by Scene::build only
  Placement placement;
};

/// The body that touches: points in its own frame.
struct Probe {
  std::vector<Vec3f> points_m;
  std::vector<float> weight_m2{};     ///< surface each point stands for; empty: all the same
  std::vector<std::uint32_t> zone{};  ///< impact zone of each point, from 0 without gaps; empty: one zone
};

struct SceneOptions {
  QueryOptions query;
  /// What is not named is neither computed nor stored. The order does not matter. With Layer::kOne there is
  /// no depth, so no effect may be named, and no distance map is read.
  std::vector<EffectChoice> effects;
};

/// What one frame came to. World frame.
struct FrameResult {
  Wrench wrench;               ///< on the probe
  std::uint32_t inside{};      ///< layer 1: points inside a superquadric; else the contacts
  Layer layer = Layer::kAuto;  ///< of the part of the first contact; kAuto: there is none
};

/// Objects, one probe and the effects between them. frame() changes the effects' memory, so one thread at a
/// time may use a scene.
class Scene {
 public:
  /// Errors: kInvalidAsset; kInvalidMesh for a probe with a point that is not finite; kBadOption for an
  /// effect or parameter that does not exist or is out of range, one that needs another, a transform that is
  /// not finite, or a probe whose arrays differ in length.
  static Result<Scene> build(std::span<const SceneObject> objects, Probe probe, const SceneOptions& options);
  ~Scene();
  Scene(Scene&&) noexcept;
  Scene& operator=(Scene&&) noexcept;

  /// @param about_m  point the torque is about, world frame
  /// No allocation, lock, log or system call. A pose that is not finite gives zero force and a flag.
  FrameResult frame(const Pose& world_from_probe, const Vec3d& about_m, float step_s) noexcept;
  /// The same within budget.units for all objects: each in the probe's reach has an equal share of what is
  /// left, and what it does not spend goes to the next. One that affords no more than layer 1 has contacts
  /// without depth, hence no force. `budget.layer` becomes the least that any of them had to do with, kAuto
  /// where none was reached. What effects ask beyond the contacts (smoothing, tracking) is not counted, but a
  /// WorkRate learns of it by the time of the frame.
  FrameResult frame(const Pose& world_from_probe, const Vec3d& about_m, float step_s,
                    WorkBudget& budget) noexcept;

  /// Contacts of the last frame with one instance, in that instance's frame (scale applied), after the
  /// effects that change them.
  std::span<const Contact> contacts(std::size_t instance) const noexcept;

  std::size_t part_count() const noexcept;  ///< of all instances
  /// Memory the scene holds, assets not included.
  std::size_t resident_bytes() const noexcept;

 private:
  struct Impl;
  explicit Scene(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace sqmap::runtime
