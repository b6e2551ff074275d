// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

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

/// What came of one asset. The asset's maps are dropped: a folder may hold thousands.
struct BakeRecord {
  std::string input, output;
  std::string name;            ///< for the table
  std::optional<Error> error;  ///< empty: baked
  double seconds{};            ///< wall time from reading to the written bundle
  std::vector<bake::StageTime> times;

  std::uint64_t bytes{};  ///< of the bundle
  std::uint32_t parts{}, segments{};
  double r_max_m{};
  std::string stopped_by;
  MeshRecord mesh;
  std::vector<ErrorRow> errors;

  /// Takes over what an asset says of itself.
  void describe(const Asset& asset);
  /// The errors at full resolution and the highest measured layer; null when nothing was measured.
  const ErrorRow* finest() const;
};

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

 private:
  void add_text(const BakeRecord& record);

  Console& console_;
  Options options_;
  struct Tail;
  std::unique_ptr<Tail> tail_;
};

}  // namespace sqmap::apps
