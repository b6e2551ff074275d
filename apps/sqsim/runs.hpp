// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "sqmap/asset/asset.hpp"

#include "../common/console.hpp"
#include "picture.hpp"
#include "scene_file.hpp"

namespace sqmap::apps {

/// A scene file with what it names.
struct LoadedScene {
  SceneFile file;
  std::vector<Asset> assets;  ///< each bundle once
  std::vector<DrawnObject> objects;
  TriangleSurface probe;  ///< the probe's own frame; only points where the file gives points
};

struct RunOptions {
  bool is_fast = false;          ///< frames follow each other without waiting for their time
  int runs = 1;                  ///< of a probe; those after the first do not wait
  std::filesystem::path output;  ///< folder for the trace, the plot and the picture; empty: none
};

/// Runs a probe over the objects: prints the latencies, writes trace.csv, trace.svg and last_frame.glb.
Outcome run_probe(Console& console, const LoadedScene& scene, const RunOptions& options);

/// Drops a cloth on the objects; the same outputs.
Outcome run_cloth(Console& console, const LoadedScene& scene, const RunOptions& options);

}  // namespace sqmap::apps
