// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <vector>

#include "peer.hpp"
#include "results.hpp"

namespace sqmap::bench {

struct BuiltPeer {
  Entrant entrant;
  std::unique_ptr<Peer> peer;
};

/// Seconds that making a method takes, one a repetition, with those of what it shares with others: as many as
/// there are of both.
std::vector<double> with_shared(std::vector<double> own_s, const std::vector<double>& shared_s);
/// Builds a peer until it is timed often enough. `seconds`: what each took, as above.
std::unique_ptr<Peer> build_timed(const Entrant& entrant, const Model& model, std::vector<double>& seconds);
/// Builds a peer, and records its size and build time unless an earlier suite has.
BuiltPeer build_peer(const Entrant& entrant, const Model& model, Results& results);
/// Holds every peer's answers for one placed cloud against the oracle: stated errors of points within the
/// band.
void check_frames(const Model& model, const Cloud& cloud, const Placement& placement,
                  const std::vector<BuiltPeer>& peers, Results& results);

}  // namespace sqmap::bench
