// SPDX-License-Identifier: GPL-3.0-or-later
#include "peer_rows.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "timing.hpp"

namespace sqmap::bench {

namespace {

bool is_known(const std::string& model, const std::string& peer, const Results& results) {
  return std::any_of(results.peers.begin(), results.peers.end(),
                     [&](const PeerRow& row) { return row.model == model && row.peer == peer; });
}

}  // namespace

std::vector<double> with_shared(std::vector<double> own_s, const std::vector<double>& shared_s) {
  if (shared_s.empty()) return own_s;
  own_s.resize(std::min(own_s.size(), shared_s.size()));
  for (std::size_t i = 0; i < own_s.size(); ++i) own_s[i] += shared_s[i];
  return own_s;
}

std::unique_ptr<Peer> build_timed(const Entrant& entrant, const Model& model, std::vector<double>& seconds) {
  const double shared_before_s = model.shared_s();
  std::vector<double> own_s;
  auto peer = make_timed([&] { return entrant.build(model); }, own_s);
  // The first to ask makes what is shared, and each is charged for it.
  own_s.front() -= model.shared_s() - shared_before_s;
  seconds = with_shared(std::move(own_s), peer->shared_seconds(model));
  return peer;
}

BuiltPeer build_peer(const Entrant& entrant, const Model& model, Results& results) {
  if (is_known(model.name, entrant.id, results)) return {entrant, entrant.build(model)};
  std::vector<double> seconds;
  BuiltPeer built{entrant, build_timed(entrant, model, seconds)};
  const StatedError stated = built.peer->stated_error();
  results.peers.push_back({model.name, entrant.id, entrant.family, built.peer->bytes(), spread_of(seconds),
                           stated.percent, stated.is_mean});
  return built;
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
