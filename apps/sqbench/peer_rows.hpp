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

/// Builds a peer and records its size and build time, the exact field's included.
BuiltPeer build_peer(const Entrant& entrant, const Model& model, Results& results);
/// Adds the row unless an earlier suite has.
void add_peer_row(const PeerRow& row, Results& results);

/// Holds every peer's answers for one placed cloud against the oracle: stated errors of points within the
/// band.
void check_frames(const Model& model, const Cloud& cloud, const Placement& placement,
                  const std::vector<BuiltPeer>& peers, Results& results);

}  // namespace sqmap::bench
