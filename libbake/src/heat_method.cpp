// SPDX-License-Identifier: GPL-3.0-or-later
#include "heat_method.hpp"

#include <exception>

#ifndef CGAL_EIGEN3_ENABLED
#define CGAL_EIGEN3_ENABLED
#endif
#include <CGAL/Heat_method_3/Surface_mesh_geodesic_distances_3.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>

namespace sqmap::bake {
namespace {

using CgalMesh = CGAL::Surface_mesh<CGAL::Simple_cartesian<double>::Point_3>;
using CgalHeat =
    CGAL::Heat_method_3::Surface_mesh_geodesic_distances_3<CgalMesh, CGAL::Heat_method_3::Direct>;

// False when the faces are not a manifold that CGAL accepts.
bool fill(const Surface& surface, CgalMesh& mesh) {
  mesh.reserve(static_cast<CgalMesh::size_type>(surface.points.size()),
               static_cast<CgalMesh::size_type>(surface.links.size()),
               static_cast<CgalMesh::size_type>(surface.faces.size()));
  for (const Vec3d& p : surface.points) mesh.add_vertex({p.x, p.y, p.z});
  for (const auto& [a, b, c] : surface.faces)
    if (mesh.add_face(CgalMesh::Vertex_index(a), CgalMesh::Vertex_index(b), CgalMesh::Vertex_index(c)) ==
        CgalMesh::null_face())
      return false;
  for (const CgalMesh::Vertex_index v : mesh.vertices())
    if (mesh.is_isolated(v)) return false;
  return true;
}

class CgalSolver final : public HeatSolver {
 public:
  bool prepare(const Surface& surface) {
    if (!fill(surface, mesh_)) return false;
    distance_ = mesh_.add_property_map<CgalMesh::Vertex_index, double>("v:distance", 0).first;
    heat_ = std::make_unique<CgalHeat>(mesh_);
    return true;
  }

  std::vector<float> distances(std::uint32_t vertex) override {
    try {
      heat_->clear_sources();
      heat_->add_source(CgalMesh::Vertex_index(vertex));
      heat_->estimate_geodesic_distances(distance_);
    } catch (const std::exception&) {  // CGAL reports failed solves this way
      return {};
    }
    std::vector<float> result;
    result.reserve(mesh_.number_of_vertices());
    for (const CgalMesh::Vertex_index v : mesh_.vertices())
      result.push_back(static_cast<float>(distance_[v]));
    return result;
  }

 private:
  CgalMesh mesh_;
  CgalMesh::Property_map<CgalMesh::Vertex_index, double> distance_;
  std::unique_ptr<CgalHeat> heat_;
};

}  // namespace

std::unique_ptr<HeatSolver> make_heat_solver(const Surface& surface) {
  try {
    auto solver = std::make_unique<CgalSolver>();
    if (solver->prepare(surface)) return solver;
  } catch (const std::exception&) {  // factorization failed
  }
  return nullptr;
}

}  // namespace sqmap::bake
