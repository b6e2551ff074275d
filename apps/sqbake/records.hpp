// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sqmap/asset/asset.hpp"
#include "sqmap/asset/result.hpp"
#include "sqmap/bake/bake.hpp"

#include "../common/console.hpp"
#include "../common/exit_codes.hpp"

namespace sqmap::apps {

enum class RecordFormat { kText, kJson, kNdjson };

/// How the bake of one asset ended. Only the first two leave a bundle.
enum class Verdict { kOk, kDegraded, kFailed, kTimeout, kMemory, kCrashed, kCancelled };
inline constexpr std::size_t kVerdictCount = 7;

/// As in records: "ok", "degraded", "failed", "timeout", "memory", "crashed", "cancelled".
const char* verdict_name(Verdict verdict) noexcept;

/// Why a bundle is less than was asked for.
struct Degradation {
  std::string id;       ///< stable: "open-mesh", "fallback"
  std::string finding;  ///< for people
};

/// What came of one asset. The asset's maps are dropped: a folder may hold thousands.
struct BakeRecord {
  std::string input, output;
  std::string name;  ///< for the table
  Verdict verdict = Verdict::kOk;
  std::optional<Error> error;  ///< with every verdict but the first two
  std::vector<Degradation> degradations;
  std::vector<std::string> warnings;
  double seconds{};  ///< wall time from reading to the written bundle
  std::vector<bake::StageTime> times;
  bool is_cached = false;  ///< taken from the cache, not baked

  std::uint64_t bytes{};  ///< of the bundle
  std::string hash;       ///< content_hash() of the bundle, once it is written
  std::uint32_t parts{}, segments{};
  double r_max_m{};
  std::string stopped_by;
  std::vector<bake::PartFit> fits;  ///< one a part
  MeshRecord mesh;
  std::vector<ErrorRow> errors;

  bool has_bundle() const noexcept { return verdict == Verdict::kOk || verdict == Verdict::kDegraded; }
  /// Takes over what an asset says of itself.
  void describe(const Asset& asset);
  /// The errors at full resolution and the highest measured layer; null when nothing was measured.
  const ErrorRow* finest() const;
};

/// The exit code of a program that had only this to do.
Exit exit_of(const BakeRecord& record) noexcept;

/// Writes the records of one run to stdout in one format. Not thread-safe.
class RecordWriter {
 public:
  struct Options {
    RecordFormat format = RecordFormat::kText;
    bool quiet = false;    ///< no text
    bool profile = false;  ///< text: time of every stage
    bool is_single = false;
    std::size_t name_width = 0;
  };
  RecordWriter(Console& console, const Options& options);
  ~RecordWriter();
  RecordWriter(RecordWriter&&) = delete;

  void add(const BakeRecord& record);
  /// After the last record.
  void finish(double seconds);

  std::size_t count(Verdict verdict) const noexcept { return counts_[static_cast<std::size_t>(verdict)]; }

 private:
  void add_text(const BakeRecord& record);

  Console& console_;
  Options options_;
  std::array<std::size_t, kVerdictCount> counts_{};
  std::size_t cached_ = 0;
  bool has_header_ = false;
  struct Tail;
  std::unique_ptr<Tail> tail_;
};

}  // namespace sqmap::apps
