// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "sqmap/asset/asset.hpp"
#include "sqmap/asset/result.hpp"
#include "sqmap/bake/decompose.hpp"
#include "sqmap/bake/fit.hpp"
#include "sqmap/bake/mesh.hpp"
#include "sqmap/bake/progress.hpp"

namespace sqmap::bake {

/// What a user names when he does not care for each limit.
enum class Quality {
  kDraft,     ///< target 0.2 %: to look at, or for far and small things
  kStandard,  ///< target 0.05 %
  kFine,      ///< target 0.025 %: about half the errors of kStandard
};

/// Everything that decides the bytes of a bundle. Written into it as JSON.
struct BakeOptions {
  ReadOptions read;
  RepairOptions repair;
  DecomposeOptions decompose;
  FitOptions fit;
  double max_error_percent = 0.05;  ///< target of eq. 35, percent of R_max, > 0
  double max_error_m = 0;           ///< the target as a length; 0: max_error_percent holds
  std::uint32_t max_parts = 24;     ///< in [1, kMaxParts]
  std::uint64_t max_bytes =
      std::uint64_t{128} * 1024;       ///< of the stored maps, about; resolution gives way first
  std::uint32_t sample_count = 20000;  ///< points of each error measurement
  std::uint64_t seed = 1;              ///< of the sample points
  bool conservative = false;           ///< also store bounds of the surface, on top of max_bytes

  Outcome check() const;
  std::string to_json() const;
  /// Sets the error target and the limits on parts and bytes.
  void set(Quality quality);
};

/// Wall time of one stage.
struct StageTime {
  std::string stage;
  double seconds;
};

/// How the superquadric of a part was found.
struct PartFit {
  int iterations{};  ///< of all optimisation runs, those with sharper edges among them
  FitStop stop{};    ///< of the run that gave the shape
};

struct BakeResult {
  Asset asset;
  std::vector<StageTime> times;  ///< not stored in the bundle
  /// What ended the refinement: "target", "parts", "bytes", or "gain": no further split lowered the error.
  std::string stopped_by;
  std::vector<PartFit> fits;  ///< one a part of the asset, in its order; not stored in the bundle
};

/// The whole line: check, repair, decompose, fit, map, measure.
/// Errors: kBadOption, kInvalidMesh, kBakeFailed, kCancelled.
Result<BakeResult> bake(const SourceMesh& source, const BakeOptions& options, const Progress& progress = {});

}  // namespace sqmap::bake
