// SPDX-License-Identifier: GPL-3.0-or-later
//
// What every method answers, so that their times can be compared: for one placed cloud, the signed distance,
// unit gradient and reaction force of each point that lies within kBand of the surface. Or, where a method
// knows triangles only: the pairs of triangles that cross.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "cloud.hpp"
#include "model.hpp"

namespace sqmap::bench {

/// How far a peer's distances may be from the truth, in percent of R_max. The tests hold it to that.
struct StatedError {
  double percent{};
  bool is_mean{};  ///< of the mean over the +-3 % shell; otherwise of every point
};

class Peer {
 public:
  virtual ~Peer() = default;
  /// Replaces the content of `hits`, which has room for every point of the cloud.
  virtual void answer(const Cloud& cloud, const Placement& object_from_cloud, Hits& hits) const = 0;
  /// Which points of the cloud are inside, for methods that know it of points whose distance they do not
  /// know. False: the method has no more to say than its distances do; `inside` is untouched.
  virtual bool sides(const Cloud&, const Placement&, std::vector<std::uint8_t>& /*inside*/) const {
    return false;
  }
  virtual std::size_t bytes() const = 0;  ///< memory resident for queries
  virtual StatedError stated_error() const = 0;
  /// Of the points that lie inside a superquadric, the share whose foot on it is more than kWrongFoot farther
  /// away than the nearest. NaN: the method has no feet. Searches exhaustively: slow.
  virtual double wrong_feet_percent(const Cloud&) const { return std::numeric_limits<double>::quiet_NaN(); }
  /// The solids whose union the method took for the object, to hold its answers against. Empty: it took the
  /// mesh.
  virtual std::span<const bake::Mesh> stands_for() const { return {}; }
  /// Times of what it was made from and shares with others, the exact field or hulls [s], one a repetition:
  /// makes them again where they were not timed often enough. Empty: it shares nothing.
  virtual std::vector<double> shared_seconds(const Model&) const { return {}; }
};

/// A method that is made from the exact field.
class FieldPeer : public Peer {
 public:
  std::vector<double> shared_seconds(const Model& model) const override {
    return model.field_seconds(resolution_);
  }

 protected:
  explicit FieldPeer(unsigned resolution) : resolution_(resolution) {}

 private:
  unsigned resolution_;  ///< of the field
};

inline constexpr double kWrongFoot = 0.005;      ///< of R_max
inline constexpr std::size_t kFeetSample = 400;  ///< points of a cloud whose feet are looked at, about

/// A method at one setting, by a name that reports keep.
struct Entrant {
  std::string id;      ///< e.g. "grid-int16-128-simd"
  std::string family;  ///< methods that differ only in their setting, e.g. "grid-int16-simd"
  std::function<std::unique_ptr<Peer>(const Model&)> build;
  unsigned density = 0;  ///< samples along an axis: nodes of a grid, rows of a map; 0: not its setting
};

/// A face of the object and one of the probe.
using FacePair = std::pair<std::uint32_t, std::uint32_t>;

/// A method that tells which triangles of the probe and the object cross.
class ContactPeer {
 public:
  virtual ~ContactPeer() = default;
  virtual std::size_t contacts(const Placement& object_from_probe) const = 0;
  /// Which pairs it told, sorted, for methods that tell several contacts of a pair, and pairs that do not
  /// cross. False: as many as contacts() says, and only those that cross.
  virtual bool pairs(const Placement&, std::vector<FacePair>& /*told*/) const { return false; }
  virtual std::size_t bytes() const = 0;  ///< of the object's side
};
enum class FclTree { kObb, kKdop18 };
std::unique_ptr<ContactPeer> make_fcl(const Model& model, const bake::Mesh& probe, FclTree tree,
                                      bool first_contact_only);
std::unique_ptr<ContactPeer> make_gimpact(const Model& model, const bake::Mesh& probe);
/// The same by testing every pair; sorted.
std::vector<FacePair> crossing_pairs(const Model& model, const bake::Mesh& probe,
                                     const Placement& object_from_probe);
/// How many of these pairs neither cross nor are near each other, each with a corner behind the other: all
/// that a method may tell that takes the faces of a mesh for the skin of a solid.
std::size_t count_strays(const std::vector<FacePair>& pairs, const Model& model, const bake::Mesh& probe,
                         const Placement& object_from_probe);

/// The method that ratios refer to: a plain and strong rival, at its best.
inline constexpr const char* kReference = "grid-int16-128-simd-culled";
/// The fastest rival of most frames.
inline constexpr const char* kBricks = "bricks-8bit-128-simd";
/// The method that the paper's Fig. 11 refers to.
inline constexpr const char* kTreeReference = "fcl-obb-all-contacts";

// One source a method.
std::unique_ptr<Peer> make_sqmap(const Model& model, int layer, unsigned level);
enum class GridCode { kFloatScalar, kFloatSimd, kInt16Simd, kInt16SimdCulled };
std::unique_ptr<Peer> make_grid(const Model& model, GridCode code, unsigned resolution);
std::unique_ptr<Peer> make_bricks(const Model& model, unsigned resolution);
/// An octree over the lattice of the field at `resolution`, each leaf within `bound_percent` of R_max of it.
std::unique_ptr<Peer> make_adf(const Model& model, unsigned resolution, double bound_percent);
/// `rows` x `cols`: the paper's sampling density (eta_d, omega_d); `subdivisions`: its A_S, 0 is layer 2.
std::unique_ptr<Peer> make_paper(const Model& model, unsigned rows, unsigned cols, unsigned subdivisions);
std::unique_ptr<Peer> make_embree(const Model& model);
std::unique_ptr<Peer> make_cgal(const Model& model);

/// The methods of the suites. `smoke`: a few of each kind, without what takes minutes to prepare.
std::vector<Entrant> frame_entrants(const Model& model, bool smoke);
std::vector<Entrant> accuracy_entrants(const Model& model, bool smoke);

}  // namespace sqmap::bench
