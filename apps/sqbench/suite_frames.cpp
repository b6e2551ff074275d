// SPDX-License-Identifier: GPL-3.0-or-later
//
// The probe against each object, whole frames: every point of the probe within the band, or all contacts.
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <memory>

#include <fmt/format.h>

#include "contact_curves.hpp"
#include "costume.hpp"
#include "peer.hpp"
#include "peer_rows.hpp"
#include "peer_voxmap.hpp"
#include "scene_frames.hpp"
#include "suites.hpp"
#include "timing.hpp"
#include "work.hpp"

namespace sqmap::bench {
namespace {

enum class Tells { kPairs, kSkins, kAny, kPoints };
/// A method that knows which triangles cross or which points touch, but no distance.
struct ContactEntrant {
  const char* id;
  const char* family;
  Tells tells;
  std::unique_ptr<ContactPeer> (*build)(const Model& model, const bake::Mesh& probe);
  unsigned resolution = 0;  ///< of those that tell points
};
template <FclTree tree, bool first_only>
std::unique_ptr<ContactPeer> build_fcl(const Model& model, const bake::Mesh& probe) {
  return make_fcl(model, probe, tree, first_only);
}
template <unsigned resolution>
std::unique_ptr<ContactPeer> build_voxmap(const Model& model, const bake::Mesh& probe) {
  return make_voxmap(model, probe, resolution);
}
constexpr ContactEntrant kContactEntrants[] = {
    {kTreeReference, "fcl-obb", Tells::kPairs, build_fcl<FclTree::kObb, false>},
    {"fcl-obb-first-contact", "fcl-obb", Tells::kAny, build_fcl<FclTree::kObb, true>},
    {"fcl-kdop18-all-contacts", "fcl-kdop18", Tells::kPairs, build_fcl<FclTree::kKdop18, false>},
    {"fcl-kdop18-first-contact", "fcl-kdop18", Tells::kAny, build_fcl<FclTree::kKdop18, true>},
    {"bullet-gimpact-all-contacts", "bullet-gimpact", Tells::kSkins, make_gimpact},
    {"voxmap-pointshell-128", "voxmap-pointshell", Tells::kPoints, build_voxmap<128>, 128},
    {"voxmap-pointshell-256", "voxmap-pointshell", Tells::kPoints, build_voxmap<256>, 256},
};
constexpr double kPairsOff_percent = 2;  ///< pairs that touch within the rounding of single precision
constexpr double kStrays_percent = 0.1;

struct BuiltContactPeer {
  const ContactEntrant* entrant;
  std::unique_ptr<ContactPeer> peer;
};

/// All points inside must be told, and none that is farther outside than a voxel reaches.
void check_points(const Model& model, const Probe& probe, const BuiltContactPeer& built, const char* work,
                  const Placement& placement, Results& results) {
  const double reach_m = voxel_reach_m(model, built.entrant->resolution);
  std::size_t least = 0, most = 0;
  for (const Vec3f& p : probe.cloud.points_m) {
    const double d = model.oracle->signed_distance(cast<double>(placement.apply(p)));
    if (d < 0) ++least;
    if (d <= reach_m) ++most;
  }
  const std::size_t found = built.peer->contacts(placement);
  results.checks.push_back(
      {model.name, built.entrant->id,
       fmt::format("points told, {}: no more than lie within a voxel of the object", work),
       static_cast<double>(found), static_cast<double>(most), found >= least && found <= most});
}

double percent_of(std::size_t part, std::size_t whole) {
  return 100 * static_cast<double>(part) / static_cast<double>(std::max<std::size_t>(whole, 1));
}

/// Holds the pairs themselves against those that cross: none may be missed, and those told beside must lie
/// near each other. `elsewhere`: another pose, whose pairs must break both.
void check_pairs(const Model& model, const Probe& probe, const BuiltContactPeer& built, const char* work,
                 const Placement& placement, const Placement& elsewhere,
                 const std::vector<FacePair>& crossing, Results& results) {
  for (const bool is_control : {false, true}) {
    if (is_control && crossing.empty()) return;  // there is nothing to miss
    std::vector<FacePair> told, missed;
    built.peer->pairs(is_control ? elsewhere : placement, told);
    std::set_difference(crossing.begin(), crossing.end(), told.begin(), told.end(),
                        std::back_inserter(missed));
    const double missed_percent = percent_of(missed.size(), crossing.size());
    const double stray_percent = percent_of(count_strays(told, model, probe.mesh, placement), told.size());
    const char* start = is_control ? "pairs of another pose break it: " : "";
    const auto add = [&](const char* what, double found, double allowed) {
      results.checks.push_back({model.name, built.entrant->id,
                                fmt::format("{}{}, {}, percent", start, what, work), found, allowed,
                                (found <= allowed) != is_control});
    };
    add("crossing pairs that are not told", missed_percent, kPairsOff_percent);
    add("told pairs that are not near each other", stray_percent, kStrays_percent);
  }
}

/// Against every pair of triangles, in one pose. A pair that barely touches may go either way. `elsewhere`:
/// another pose, whose pairs must not pass for those of this one.
void check_contacts(const Model& model, const Probe& probe, const std::vector<BuiltContactPeer>& peers,
                    const char* work, const Placement& placement, const Placement& elsewhere,
                    Results& results) {
  const std::vector<FacePair> crossing = crossing_pairs(model, probe.mesh, placement);
  const auto expected = static_cast<double>(crossing.size());
  for (const BuiltContactPeer& built : peers) {
    if (built.entrant->tells == Tells::kPoints) {
      check_points(model, probe, built, work, placement, results);
      continue;
    }
    if (built.entrant->tells == Tells::kSkins) {
      check_pairs(model, probe, built, work, placement, elsewhere, crossing, results);
      continue;
    }
    const auto found = static_cast<double>(built.peer->contacts(placement));
    const bool agrees_on_any = (found > 0) == (expected > 0);
    if (built.entrant->tells == Tells::kAny) {
      results.checks.push_back({model.name, built.entrant->id,
                                fmt::format("says whether any triangles cross, {}: contacts, pairs", work),
                                found, expected, agrees_on_any});
      continue;
    }
    const double off = 100 * std::abs(found - expected) / std::max(expected, 1.0);
    results.checks.push_back({model.name, built.entrant->id,
                              fmt::format("crossing pairs off the brute-force count, {}, percent", work), off,
                              2, off <= 2 && agrees_on_any});
  }
}

void run_model(const SuiteInput& input, const Model& model, Results& results) {
  const Probe probe = scaled_probe(input.probe, model);
  std::vector<BuiltPeer> peers;
  for (const Entrant& entrant : frame_entrants(model, input.is_smoke))
    peers.push_back(build_peer(entrant, model, results));
  std::vector<BuiltContactPeer> contact_peers;
  for (const ContactEntrant& entrant : kContactEntrants) {
    if (input.is_smoke && entrant.resolution > 128) continue;
    std::vector<double> own_s, field_s;
    if (entrant.resolution > 0) field_s = model.field_seconds(entrant.resolution);
    contact_peers.push_back({&entrant, make_timed([&] { return entrant.build(model, probe.mesh); }, own_s)});
    results.peers.push_back({model.name, entrant.id, entrant.family, contact_peers.back().peer->bytes(),
                             spread_of(with_shared(own_s, field_s)), std::numeric_limits<double>::quiet_NaN(),
                             false});
  }

  Hits hits(probe.cloud.count);
  for (const Contact contact : {Contact::kTouching, Contact::kFar, Contact::kGrasp}) {
    input.note(fmt::format("frames: {}, {}", model.name, name_of(contact)));
    const Sequence sequence = make_sequence(model, probe, contact, input.is_smoke ? 3 : 24);
    results.works.push_back({model.name, name_of(contact), sequence.object_from_probe.size(),
                             probe.cloud.count, sequence.contacts_mean, sequence.near_mean,
                             sequence.deepest_percent, sequence.nearest_percent});
    const std::size_t poses = sequence.object_from_probe.size();
    const bool is_valid =
        poses > 0 &&
        (contact == Contact::kFar ? sequence.nearest_percent > 100 * kBand
                                  : sequence.contacts_mean > 0 && sequence.deepest_percent < 100 * kBand);
    results.checks.push_back(
        {model.name, "oracle",
         fmt::format("{} poses are valid: deepest penetration, percent", name_of(contact)),
         sequence.deepest_percent, 100 * kBand, is_valid});
    if (contact != Contact::kGrasp && poses > 0)
      check_contacts(model, probe, contact_peers, name_of(contact), sequence.object_from_probe[poses / 2],
                     sequence.object_from_probe.front(), results);
    if (contact == Contact::kTouching) {
      check_frames(model, probe.cloud, sequence.object_from_probe.front(), peers, results);
    }

    std::vector<Contestant> contestants;
    for (const BuiltPeer& built : peers)
      contestants.push_back({built.entrant.id, [&](std::size_t pose) {
                               built.peer->answer(probe.cloud, sequence.object_from_probe[pose], hits);
                               return hits.count;
                             }});
    for (const BuiltContactPeer& built : contact_peers)
      contestants.push_back({built.entrant->id, [&](std::size_t pose) {
                               return built.peer->contacts(sequence.object_from_probe[pose]);
                             }});
    const std::vector<Timing> timings = measure(contestants, poses, input.is_smoke ? 3 : 15);
    const auto reference =
        static_cast<std::size_t>(std::find_if(contestants.begin(), contestants.end(),
                                              [](const Contestant& c) { return c.name == kReference; }) -
                                 contestants.begin());
    for (std::size_t c = 0; c < contestants.size(); ++c)
      results.frames.push_back({model.name, name_of(contact), contestants[c].name, timings[c].answers_mean,
                                timings[c].spread(1e6), timings[c].ratio_to(timings[reference])});
  }
}

}  // namespace

void run_frames(const SuiteInput& input, Results& results) {
  for (const Model& model : input.models) {
    run_model(input, model, results);
    run_costume(input, model, results);
  }
  if (!input.models.empty()) run_contact_curves(input, input.models.front(), results);
  run_scene(input, results);
}

}  // namespace sqmap::bench
