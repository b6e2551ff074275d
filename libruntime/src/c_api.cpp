// SPDX-License-Identifier: Apache-2.0
#include "c_api.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <memory>
#include <string>

#include "sqmap/asset/validate.hpp"
#include "sqmap/runtime/budget.hpp"
#include "sqmap/runtime/contacts.hpp"

namespace sqmap::runtime {
namespace {

// Arrays of C are read and written in place: the layouts must be the same.
static_assert(sizeof(Vec3f) == 3 * sizeof(float));
static_assert(sizeof(Contact) == sizeof(sqmap_contact));
static_assert(alignof(Contact) == alignof(sqmap_contact));  // NOLINT(misc-redundant-expression): two types
static_assert(offsetof(Contact, depth_m) == offsetof(sqmap_contact, depth_m));
static_assert(offsetof(Contact, normal) == offsetof(sqmap_contact, normal));
static_assert(offsetof(Contact, position_m) == offsetof(sqmap_contact, position_m));
static_assert(offsetof(Contact, surface_m) == offsetof(sqmap_contact, surface_m));
static_assert(sizeof(SweepResult) == sizeof(sqmap_sweep_result));
static_assert(offsetof(SweepResult, steps) == offsetof(sqmap_sweep_result, steps));
static_assert(offsetof(SweepResult, time) == offsetof(sqmap_sweep_result, time));
static_assert(offsetof(SweepResult, contact) == offsetof(sqmap_sweep_result, contact));

// Sizes of the structures in version 0.1. They grow at their end only.
constexpr std::size_t kError01 = 8 + 488 + 256;
constexpr std::size_t kInfo01 = 64;
constexpr std::size_t kInfoWithTolerance = 72;
static_assert(sizeof(sqmap_error) >= kError01 && sizeof(sqmap_object_info) >= kInfo01);

void copy_text(char* to, std::size_t size, const char* from) noexcept {
  const std::size_t length = std::min(std::strlen(from), size - 1);
  std::memcpy(to, from, length);
  to[length] = '\0';
}

std::span<const Vec3f> vectors(const float* values, std::size_t count) noexcept {
  return {reinterpret_cast<const Vec3f*>(values), count};
}
std::span<Vec3f> vectors(float* values, std::size_t count) noexcept {
  return values != nullptr ? std::span(reinterpret_cast<Vec3f*>(values), count) : std::span<Vec3f>{};
}
template <class T>
std::span<T> optional_array(T* values, std::size_t count) noexcept {
  return values != nullptr ? std::span(values, count) : std::span<T>{};
}
template <class T>
std::vector<T> copied(const T* values, std::size_t count) {
  return values != nullptr ? std::vector<T>(values, values + count) : std::vector<T>{};
}

Vec3d vector(const double* v) noexcept { return {v[0], v[1], v[2]}; }
BoundingSphere sphere(const double* s) noexcept { return {vector(s), s[3]}; }

/// sqmap_instance: the handle, then an Instance.
struct Placed {
  const sqmap_object* owner;
  std::array<std::byte, sizeof(Instance)> bytes;
  Instance instance() const noexcept { return std::bit_cast<Instance>(bytes); }
};
static_assert(sizeof(Placed) <= sizeof(sqmap_instance));

Placed unpacked(const sqmap_instance& instance) noexcept {
  Placed placed{};
  std::memcpy(&placed, instance.opaque, sizeof placed);
  return placed;
}

sqmap_status pack(const sqmap_object* owner, const Result<Instance>& result, sqmap_instance* instance,
                  sqmap_error* error) noexcept {
  if (!result) return c_failure(result.error(), error);
  const Placed placed{owner, std::bit_cast<std::array<std::byte, sizeof(Instance)>>(result.value())};
  *instance = {};
  std::memcpy(instance->opaque, &placed, sizeof placed);
  return SQMAP_OK;
}

/// Whether an optional structure of options may be used.
template <class T>
bool is_known(const T* options) noexcept {
  return options == nullptr || options->struct_size == sizeof(T);
}

QueryOptions query_options(std::uint32_t layer, std::uint32_t level, float edge_length_m) noexcept {
  return {static_cast<Layer>(layer <= 3 ? layer : 0), level, edge_length_m};
}
QueryOptions query_options(const sqmap_query_options* options) noexcept {
  if (options == nullptr) return {};
  return query_options(options->layer, options->level, options->edge_length_m);
}

/// What every call about points requires.
sqmap_status check(const sqmap_instance* instance, const float* points_m, std::size_t count,
                   const sqmap_query_options* options) noexcept {
  if (instance == nullptr || (points_m == nullptr && count > 0)) return SQMAP_NULL_ARGUMENT;
  if (unpacked(*instance).owner == nullptr) return SQMAP_NULL_ARGUMENT;
  if (!is_known(options)) return SQMAP_STRUCT_SIZE;
  return options != nullptr && options->layer > SQMAP_LAYER_3 ? SQMAP_BAD_OPTION : SQMAP_OK;
}

sqmap_status write_one(const std::optional<Contact>& found_contact, std::int32_t* found,
                       sqmap_contact* contact) noexcept {
  *found = found_contact.has_value() ? 1 : 0;
  if (found_contact) *contact = std::bit_cast<sqmap_contact>(*found_contact);
  return SQMAP_OK;
}

/// A part without arrays that its own counts promise keeps its map empty; the validator then says so.
Part part_of(const sqmap_part_desc& desc) {
  Part part;
  part.shape = {
      vector(desc.semi_axes_m), desc.e1, desc.e2, desc.taper, {desc.bend_per_m[0], desc.bend_per_m[1]}};
  const double* q = desc.orientation_wxyz;
  part.object_from_part = {{q[0], q[1], q[2], q[3]}, vector(desc.translation_m)};
  part.sphere = sphere(desc.sphere_m);
  part.vertex_count = desc.vertex_count;
  DistanceMap& map = part.map;
  map.rows = desc.rows;
  map.cols = desc.cols;
  map.level_count = desc.level_count;
  map.bits = desc.bits;
  map.depth_min_m = desc.depth_min_m;
  map.depth_step_m = desc.depth_step_m;
  // Rules 31 and 32 bound what is read from the caller's arrays.
  constexpr std::uint32_t kMostRows = 4097, kMostCols = 8192;
  if (desc.rows > kMostRows || desc.cols > kMostCols) return part;
  const std::size_t texels = std::size_t{desc.rows} * desc.cols;
  map.code = copied(desc.code, texels);
  map.start_inside = copied(desc.start_inside, (texels + 7) / 8);
  if (desc.crossing_texel != nullptr && desc.crossing_code != nullptr) {
    for (std::size_t k = 0; k < desc.crossing_count; ++k)
      map.crossings.push_back({desc.crossing_texel[k], desc.crossing_code[k]});
  }
  if (desc.vertex_cell != nullptr && desc.vertex_256ths != nullptr && desc.vertex_code != nullptr) {
    for (std::size_t k = 0; k < desc.vertex_sample_count; ++k) {
      map.vertex_samples.push_back({desc.vertex_cell[k], desc.vertex_256ths[2 * k],
                                    desc.vertex_256ths[2 * k + 1], desc.vertex_code[k]});
    }
  }
  return part;
}

sqmap_status build(const sqmap_asset_desc& desc, sqmap_object** object, sqmap_error* error) {
  if (desc.part_count > kMaxParts) {
    return c_failure(SQMAP_INVALID_ASSET, "part_count is more than 4096", "use fewer parts", error);
  }
  Asset asset;
  asset.r_max_m = desc.r_max_m;
  asset.sphere = sphere(desc.sphere_m);
  for (std::uint32_t k = 0; k < desc.part_count; ++k) {
    if (desc.parts[k].struct_size != sizeof(sqmap_part_desc)) {
      return c_failure(SQMAP_STRUCT_SIZE,
                       "struct_size of a part is not that of this library's sqmap_part_desc",
                       "set it to sizeof(sqmap_part_desc), and use one version of header and library", error);
    }
    asset.parts.push_back(part_of(desc.parts[k]));
  }
  // In full: a bundle's reader has more to trust than numbers that a program made up.
  const auto findings = validate(asset, CheckLevel::kFull);
  if (!findings.empty()) {
    return c_failure(SQMAP_INVALID_ASSET, findings.front().message.c_str(),
                     "correct the description; formats/FORMAT.md section 8 has the rules", error);
  }
  return c_object(asset, object, error);
}

/// What both kinds of contacts of a body check and convert; `ask` has the question itself.
template <class Ask>
sqmap_status contacts_of(const sqmap_body* body, const sqmap_body_placement* placement,
                         const sqmap_body_options* options, sqmap_work_budget* budget,
                         std::span<sqmap_contact> contacts, std::size_t* found, const Ask& ask) {
  if (body == nullptr || placement == nullptr || found == nullptr ||
      (contacts.data() == nullptr && !contacts.empty()))
    return SQMAP_NULL_ARGUMENT;
  if (!is_known(options) || !is_known(budget)) return SQMAP_STRUCT_SIZE;
  ContactQuery query;
  if (options != nullptr) {
    if (options->layer > SQMAP_LAYER_3 || options->seek > SQMAP_SEEK_DEEPEST || !(options->within_m >= 0))
      return SQMAP_BAD_OPTION;
    query = {query_options(options->layer, options->level, options->edge_length_m), options->within_m,
             static_cast<Seek>(options->seek)};
  }
  if (!(placement->scale > 0)) return SQMAP_BAD_OPTION;
  const double* q = placement->orientation_wxyz;
  const Pose pose{{q[0], q[1], q[2], q[3]}, vector(placement->translation_m)};
  const std::span<Contact> room(reinterpret_cast<Contact*>(contacts.data()), contacts.size());
  if (budget == nullptr) {
    *found = ask(pose, query, room, nullptr);
    return SQMAP_OK;
  }
  WorkBudget work{budget->units};
  *found = ask(pose, query, room, &work);
  budget->spent = work.spent;
  budget->layer = static_cast<std::uint32_t>(work.layer);
  budget->level = work.level;
  return SQMAP_OK;
}

}  // namespace

sqmap_status c_failure(int status, const char* finding, const char* remedy, sqmap_error* error) noexcept {
  if (error != nullptr && error->struct_size >= kError01) {
    error->status = status;
    copy_text(error->finding, sizeof error->finding, finding);
    copy_text(error->remedy, sizeof error->remedy, remedy);
  }
  return static_cast<sqmap_status>(status);
}

sqmap_status c_object(const Asset& asset, sqmap_object** object, sqmap_error* error) {
  auto built = Object::build(asset);
  if (!built) return c_failure(built.error(), error);
  auto sweeper = Sweeper::build(asset);
  if (!sweeper) return c_failure(sweeper.error(), error);
  *object = std::make_unique<sqmap_object>(sqmap_object{std::move(built).value(), std::move(sweeper).value()})
                .release();
  return SQMAP_OK;
}

}  // namespace sqmap::runtime

using namespace sqmap::runtime;

std::int32_t sqmap_version(void) { return SQMAP_VERSION; }

const char* sqmap_status_text(std::int32_t status) {
  switch (status) {
    case SQMAP_OK:
      return "done";
    case SQMAP_BAD_OPTION:
      return "an option is outside its documented range";
    case SQMAP_FILE_MISSING:
      return "the path names nothing";
    case SQMAP_FILE_UNREADABLE:
      return "the file cannot be read";
    case SQMAP_INVALID_ASSET:
      return "the asset is damaged or breaks a rule of its format";
    case SQMAP_UNSUPPORTED_VERSION:
      return "the bundle's version is not one this library reads";
    case SQMAP_NULL_ARGUMENT:
      return "an argument that is required is NULL, or an instance was never placed";
    case SQMAP_STRUCT_SIZE:
      return "a struct_size is not one this library knows";
    case SQMAP_OUT_OF_MEMORY:
      return "memory is exhausted";
    default:
      return "unknown status";
  }
}

sqmap_status sqmap_object_build(const sqmap_asset_desc* asset, sqmap_object** object, sqmap_error* error) {
  if (asset == nullptr || object == nullptr || (asset->parts == nullptr && asset->part_count > 0)) {
    return c_failure(SQMAP_NULL_ARGUMENT, "asset, its parts or object is NULL", "pass all three", error);
  }
  if (asset->struct_size != sizeof(sqmap_asset_desc)) {
    return c_failure(SQMAP_STRUCT_SIZE,
                     "struct_size of the asset is not that of this library's sqmap_asset_desc",
                     "set it to sizeof(sqmap_asset_desc), and use one version of header and library", error);
  }
  return c_guarded(error, [&] { return build(*asset, object, error); });
}

void sqmap_object_destroy(sqmap_object* object) { std::unique_ptr<sqmap_object>{object}.reset(); }

sqmap_status sqmap_object_get_info(const sqmap_object* object, sqmap_object_info* info) {
  if (object == nullptr || info == nullptr) return SQMAP_NULL_ARGUMENT;
  if (info->struct_size < kInfo01) return SQMAP_STRUCT_SIZE;
  const sqmap::BoundingSphere& ball = object->object.sphere();
  info->part_count = static_cast<std::uint32_t>(object->object.part_count());
  info->level_count = object->object.level_count();
  info->r_max_m = object->object.r_max_m();
  const double values[4] = {ball.centre_m.x, ball.centre_m.y, ball.centre_m.z, ball.radius_m};
  std::copy(values, values + 4, info->sphere_m);
  info->resident_bytes = object->object.resident_bytes() + object->sweeper.resident_bytes();
  if (info->struct_size >= kInfoWithTolerance)
    info->certainty_tolerance_m = object->object.certainty_tolerance_m();
  return SQMAP_OK;
}

sqmap_status sqmap_instance_place(const sqmap_object* object, const double orientation_wxyz[4],
                                  const double translation_m[3], double scale, std::int32_t is_mirrored,
                                  sqmap_instance* instance, sqmap_error* error) {
  if (object == nullptr || orientation_wxyz == nullptr || translation_m == nullptr || instance == nullptr) {
    return c_failure(SQMAP_NULL_ARGUMENT, "object, orientation, translation or instance is NULL",
                     "pass all four", error);
  }
  return c_guarded(error, [&] {
    const double* q = orientation_wxyz;
    const Placement placement{{{q[0], q[1], q[2], q[3]}, vector(translation_m)}, scale, is_mirrored != 0};
    return pack(object, Instance::place(object->object, placement), instance, error);
  });
}

sqmap_status sqmap_instance_place_matrix(const sqmap_object* object, const double world_from_object[12],
                                         sqmap_instance* instance, sqmap_error* error) {
  if (object == nullptr || world_from_object == nullptr || instance == nullptr) {
    return c_failure(SQMAP_NULL_ARGUMENT, "object, matrix or instance is NULL", "pass all three", error);
  }
  return c_guarded(error, [&] {
    const double* m = world_from_object;
    const Affine affine{{vector(m), vector(m + 4), vector(m + 8)}, {m[3], m[7], m[11]}};
    return pack(object, Instance::place(object->object, affine), instance, error);
  });
}

sqmap_status sqmap_query(const sqmap_instance* instance, const float* points_m, std::size_t point_count,
                         const sqmap_query_options* options, const sqmap_answers* answers) {
  const sqmap_status status = check(instance, points_m, point_count, options);
  if (status != SQMAP_OK) return status;
  if (answers == nullptr) return SQMAP_NULL_ARGUMENT;
  if (answers->struct_size != sizeof(sqmap_answers)) return SQMAP_STRUCT_SIZE;
  unpacked(*instance).instance().query(
      vectors(points_m, point_count),
      {.signed_distance_m = optional_array(answers->signed_distance_m, point_count),
       .normal = vectors(answers->normal, point_count),
       .surface_m = vectors(answers->surface_m, point_count),
       .part = optional_array(answers->part, point_count),
       .layer = optional_array(answers->layer, point_count),
       .inside = optional_array(answers->inside, point_count)},
      query_options(options));
  return SQMAP_OK;
}

sqmap_status sqmap_certainty(const sqmap_instance* instance, const float* points_m, std::size_t point_count,
                             std::uint8_t* certainty) {
  const sqmap_status status = check(instance, points_m, point_count, nullptr);
  if (status != SQMAP_OK) return status;
  if (certainty == nullptr && point_count > 0) return SQMAP_NULL_ARGUMENT;
  static_assert(sizeof(Certainty) == sizeof *certainty);
  static_assert(static_cast<int>(Certainty::kUnsure) == SQMAP_UNSURE);
  static_assert(static_cast<int>(Certainty::kOutside) == SQMAP_SURELY_OUTSIDE);
  static_assert(static_cast<int>(Certainty::kInside) == SQMAP_SURELY_INSIDE);
  unpacked(*instance).instance().certainty(vectors(points_m, point_count),
                                           {reinterpret_cast<Certainty*>(certainty), point_count});
  return SQMAP_OK;
}

sqmap_status sqmap_any_contact(const sqmap_instance* instance, const float* points_m, std::size_t point_count,
                               const sqmap_query_options* options, std::int32_t* found) {
  const sqmap_status status = check(instance, points_m, point_count, options);
  if (status != SQMAP_OK) return status;
  if (found == nullptr) return SQMAP_NULL_ARGUMENT;
  *found =
      any_contact(unpacked(*instance).instance(), vectors(points_m, point_count), query_options(options));
  return SQMAP_OK;
}

sqmap_status sqmap_first_contact(const sqmap_instance* instance, const float* points_m,
                                 std::size_t point_count, const sqmap_query_options* options,
                                 std::int32_t* found, sqmap_contact* contact) {
  const sqmap_status status = check(instance, points_m, point_count, options);
  if (status != SQMAP_OK) return status;
  if (found == nullptr || contact == nullptr) return SQMAP_NULL_ARGUMENT;
  return write_one(
      first_contact(unpacked(*instance).instance(), vectors(points_m, point_count), query_options(options)),
      found, contact);
}

sqmap_status sqmap_deepest_contact(const sqmap_instance* instance, const float* points_m,
                                   std::size_t point_count, const sqmap_query_options* options,
                                   std::int32_t* found, sqmap_contact* contact) {
  const sqmap_status status = check(instance, points_m, point_count, options);
  if (status != SQMAP_OK) return status;
  if (found == nullptr || contact == nullptr) return SQMAP_NULL_ARGUMENT;
  return write_one(
      deepest_contact(unpacked(*instance).instance(), vectors(points_m, point_count), query_options(options)),
      found, contact);
}

sqmap_status sqmap_all_contacts(const sqmap_instance* instance, const float* points_m,
                                std::size_t point_count, const sqmap_query_options* options,
                                sqmap_contact* contacts, std::size_t capacity, std::size_t* found) {
  const sqmap_status status = check(instance, points_m, point_count, options);
  if (status != SQMAP_OK) return status;
  if (found == nullptr || (contacts == nullptr && capacity > 0)) return SQMAP_NULL_ARGUMENT;
  *found = all_contacts(unpacked(*instance).instance(), vectors(points_m, point_count),
                        {reinterpret_cast<Contact*>(contacts), capacity}, query_options(options))
               .found;
  return SQMAP_OK;
}

sqmap_status sqmap_body_build(const float* points_m, std::size_t point_count, sqmap_body** body,
                              sqmap_error* error) {
  if (body == nullptr || (points_m == nullptr && point_count > 0))
    return c_failure(SQMAP_NULL_ARGUMENT, "points or body is NULL", "pass both", error);
  return c_guarded(error, [&] {
    auto built = PointBody::build(vectors(points_m, point_count));
    if (!built)
      return c_failure(SQMAP_BAD_OPTION, built.error().finding.c_str(), built.error().remedy.c_str(), error);
    *body = std::make_unique<sqmap_body>(sqmap_body{std::move(built).value()}).release();
    return SQMAP_OK;
  });
}

void sqmap_body_destroy(sqmap_body* body) { std::unique_ptr<sqmap_body>{body}.reset(); }

sqmap_status sqmap_body_refit(sqmap_body* body, const float* points_m, std::size_t point_count) {
  if (body == nullptr || (points_m == nullptr && point_count > 0)) return SQMAP_NULL_ARGUMENT;
  return body->body.refit(vectors(points_m, point_count)) ? SQMAP_OK : SQMAP_BAD_OPTION;
}

sqmap_status sqmap_body_contacts(const sqmap_object* object, const sqmap_body* body,
                                 const sqmap_body_placement* placement, const sqmap_body_options* options,
                                 sqmap_work_budget* budget, sqmap_contact* contacts, std::size_t capacity,
                                 std::size_t* found) {
  if (object == nullptr) return SQMAP_NULL_ARGUMENT;
  return contacts_of(
      body, placement, options, budget, {contacts, capacity}, found,
      [&](const sqmap::Pose& pose, const ContactQuery& query, std::span<Contact> room, WorkBudget* work) {
        const BodyPlacement placed{pose, placement->scale};
        return work != nullptr ? object->object.contacts(body->body, placed, room, query, *work)
                               : object->object.contacts(body->body, placed, room, query);
      });
}

sqmap_status sqmap_instance_body_contacts(const sqmap_instance* instance, const sqmap_body* body,
                                          const sqmap_body_placement* world_from_body,
                                          std::int32_t is_mirrored, const sqmap_body_options* options,
                                          sqmap_work_budget* budget, sqmap_contact* contacts,
                                          std::size_t capacity, std::size_t* found) {
  if (const sqmap_status status = check(instance, nullptr, 0, nullptr); status != SQMAP_OK) return status;
  const Instance placed = unpacked(*instance).instance();
  return contacts_of(
      body, world_from_body, options, budget, {contacts, capacity}, found,
      [&](const sqmap::Pose& pose, const ContactQuery& query, std::span<Contact> room, WorkBudget* work) {
        const Placement at{pose, world_from_body->scale, is_mirrored != 0};
        return work != nullptr ? placed.contacts(body->body, at, room, query, *work)
                               : placed.contacts(body->body, at, room, query);
      });
}

std::uint64_t sqmap_work_units(double units_per_us, double us) {
  return WorkRate(units_per_us).units_for(us);
}

double sqmap_work_learned(double units_per_us, std::uint64_t spent, double took_us) {
  WorkRate rate(units_per_us);
  rate.learn(spent, took_us);
  return rate.units_per_us();
}

sqmap_status sqmap_sweep(const sqmap_instance* start, const sqmap_instance* end, const float* from_m,
                         const float* to_m, std::size_t point_count, const sqmap_sweep_options* options,
                         sqmap_sweep_result* results) {
  const sqmap_status status = check(start, from_m, point_count, nullptr);
  if (status != SQMAP_OK) return status;
  if (point_count > 0 && (to_m == nullptr || results == nullptr)) return SQMAP_NULL_ARGUMENT;
  if (end != nullptr && unpacked(*end).owner == nullptr) return SQMAP_NULL_ARGUMENT;
  if (!is_known(options)) return SQMAP_STRUCT_SIZE;
  SweepOptions sweep_options;
  if (options != nullptr) {
    if (options->layer > SQMAP_LAYER_3) return SQMAP_BAD_OPTION;
    sweep_options = {query_options(options->layer, options->level, options->edge_length_m),
                     options->tolerance_m, options->error_m, options->max_steps};
  }
  const Placed placed = unpacked(*start);
  const Instance first = placed.instance(), last = end != nullptr ? unpacked(*end).instance() : first;
  const auto from = vectors(from_m, point_count), to = vectors(to_m, point_count);
  for (std::size_t i = 0; i < point_count; ++i) {
    SweepResult result = placed.owner->sweeper.sweep(first, last, {from[i], to[i]}, sweep_options);
    result.contact.point = static_cast<std::uint32_t>(i);
    results[i] = std::bit_cast<sqmap_sweep_result>(result);
  }
  return SQMAP_OK;
}
