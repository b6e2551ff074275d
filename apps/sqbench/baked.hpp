// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "sqmap/bake/bake.hpp"

#include "model.hpp"

namespace sqmap::bench {

/// A model from a mesh without a file. May throw what the baker finds wrong.
Model baked_model(const std::string& name, const bake::Mesh& mesh, const bake::BakeOptions& options);
/// The same object, baked otherwise.
Model baked_again(const Model& model, const bake::BakeOptions& options);

}  // namespace sqmap::bench
