// SPDX-License-Identifier: GPL-3.0-or-later
#include "peer_rows.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "field.hpp"

namespace sqmap::bench {

namespace {

double field_seconds(const Model& model) {
  double sum = 0;
  for (const auto& [resolution, field] : model.fields) sum += field->seconds;
  return sum;
}

}  // namespace

BuiltPeer build_peer(const Entrant& entrant, const Model& model, Results& results) {
  const double fields_before_s = field_seconds(model);
  const auto start = std::chrono::steady_clock::now();
  BuiltPeer built{entrant, entrant.build(model)};
  const double passed_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  // Grids share the exact field: each is charged for it, whoever asked first.
  const double own_s = passed_s - (field_seconds(model) - fields_before_s);
  const StatedError stated = built.peer->stated_error();
  add_peer_row({model.name, entrant.id, entrant.family, built.peer->bytes(), own_s + built.peer->field_s(),
                stated.percent, stated.is_mean},
               results);
  return built;
}

void add_peer_row(const PeerRow& row, Results& results) {
  const bool is_known = std::any_of(results.peers.begin(), results.peers.end(), [&](const PeerRow& known) {
    return known.model == row.model && known.peer == row.peer;
  });
  if (!is_known) results.peers.push_back(row);
}

void check_frames(const Model& model, const Cloud& cloud, const Placement& placement,
                  const std::vector<BuiltPeer>& peers, Results& results) {
  const double band_m = kBand * model.r_max_m();
  std::vector<double> truth_m;
  for (const Vec3f& p : cloud.points_m)
    truth_m.push_back(model.oracle->signed_distance(cast<double>(placement.apply(p))));
  Hits hits(cloud.count);
  for (const BuiltPeer& built : peers) {
    built.peer->answer(cloud, placement, hits);
    const StatedError stated = built.peer->stated_error();
    double sum = 0, most = 0;
    std::size_t count = 0;
    for (std::size_t i = 0; i < hits.count; ++i) {
      const double truth = truth_m[hits.point[i]];
      if (std::abs(truth) > band_m) continue;
      const double off = 100 * std::abs(hits.distance_m[i] - truth) / model.r_max_m();
      sum += off;
      most = std::max(most, off);
      ++count;
    }
    // A mean over the few points of one frame strays from that of the shell: three times it is allowed.
    const double found = stated.is_mean ? sum / static_cast<double>(std::max<std::size_t>(count, 1)) : most;
    const double allowed = stated.is_mean ? 3 * stated.percent : stated.percent;
    results.checks.push_back({model.name, built.entrant.id,
                              "distance error in a touching frame, percent of R_max", found, allowed,
                              count > 0 && found <= allowed});
  }
}

}  // namespace sqmap::bench
