// SPDX-License-Identifier: GPL-3.0-or-later
#include "heat_method.hpp"

#include <exception>
#include <utility>

#include <CGAL/Eigen_vector.h>
#include <CGAL/Heat_method_3/Surface_mesh_geodesic_distances_3.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <Eigen/SparseCholesky>

namespace sqmap::bake {
namespace {

using CgalMesh = CGAL::Surface_mesh<CGAL::Simple_cartesian<double>::Point_3>;

// Matrix of the heat method. CGAL::Eigen_sparse_matrix, the default, swaps a flag it never set (undefined
// behaviour that the sanitizers stop at) and stores the right-hand sides, which are full columns, as sparse
// matrices.
class HeatMatrix {
 public:
  HeatMatrix() = default;
  HeatMatrix(int rows, int columns) : rows_(rows), columns_(columns) {
    if (is_column()) column_ = Eigen::VectorXd::Zero(rows);
  }
  explicit HeatMatrix(Eigen::SparseMatrix<double> square)
      : rows_(static_cast<int>(square.rows())), columns_(rows_), square_(std::move(square)) {}

  template <class Row, class Column>
  void set_coef(Row i, Column j, double value, bool /*is_new*/) {
    add_coef(i, j, value);  // the heat method sets each once
  }
  template <class Row, class Column>
  void add_coef(Row i, Column j, double value) {
    if (is_column())
      column_(static_cast<Eigen::Index>(i)) += value;
    else
      entries_.emplace_back(static_cast<int>(i), static_cast<int>(j), value);
  }
  void assemble_matrix() {
    square_.resize(rows_, columns_);
    square_.setFromTriplets(entries_.begin(), entries_.end());
    entries_.clear();
  }
  void swap(HeatMatrix& other) noexcept {
    std::swap(rows_, other.rows_);
    std::swap(columns_, other.columns_);
    entries_.swap(other.entries_);
    square_.swap(other.square_);
    column_.swap(other.column_);
  }
  const Eigen::SparseMatrix<double>& square() const { return square_; }
  const Eigen::VectorXd& column() const { return column_; }

  friend HeatMatrix operator*(double factor, const HeatMatrix& matrix) {
    return HeatMatrix(Eigen::SparseMatrix<double>(factor * matrix.square_));
  }
  friend HeatMatrix operator+(const HeatMatrix& a, const HeatMatrix& b) {
    return HeatMatrix(Eigen::SparseMatrix<double>(a.square_ + b.square_));
  }

 private:
  bool is_column() const { return columns_ == 1; }

  int rows_ = 0, columns_ = 0;
  std::vector<Eigen::Triplet<double>> entries_;
  Eigen::SparseMatrix<double> square_;
  Eigen::VectorXd column_;
};

// CGAL's concept SparseLinearAlgebraWithFactorTraits_d, as far as the heat method uses it.
class HeatAlgebra {
 public:
  using Matrix = HeatMatrix;
  using Vector = CGAL::Eigen_vector<double>;
  using Index = Eigen::Index;
  using NT = double;

  bool factor(const Matrix& matrix, double& divisor) {
    divisor = 1;
    solver_.compute(matrix.square());
    return solver_.info() == Eigen::Success;
  }
  bool linear_solver(const Matrix& column, Vector& solution) {
    solution = Eigen::VectorXd(solver_.solve(column.column()));
    return solver_.info() == Eigen::Success;
  }

 private:
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver_;
};

using CgalHeat = CGAL::Heat_method_3::Surface_mesh_geodesic_distances_3<CgalMesh, CGAL::Heat_method_3::Direct,
                                                                        CGAL::Default, HeatAlgebra>;

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
