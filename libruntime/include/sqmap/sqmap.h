// SPDX-License-Identifier: Apache-2.0
//
// sqmap for C (C99 and later): what sqmap::runtime does but for effects and scenes, and in the last section
// the reader of bundles. The headers in sqmap/runtime say more about each call than is repeated here.
//
// - An object is an opaque handle, made by sqmap_object_build or _load_..., freed by sqmap_object_destroy. It
//   is immutable, so any number of threads may use one. Instances are plain values of the caller's.
// - Arrays are the caller's. An optional array may be NULL. Vectors are three floats x y z, lengths metres.
// - Calls that can fail return a sqmap_status and, where the caller passes a sqmap_error, the reason in
// words.
//   On failure all other outputs are left as they were.
// - No callbacks, no global state; no exception leaves a call. Queries, contacts, sweeps do not allocate.
// - Structures that may grow begin with struct_size, which the caller sets to sizeof (the ..._INIT macros
// do).
//   A library newer than its caller takes missing fields as their defaults. An older one refuses inputs that
//   it cannot know, and leaves such fields of a sqmap_error or sqmap_object_info untouched. Elements of
//   arrays that the library writes never grow.
#ifndef SQMAP_SQMAP_H
#define SQMAP_SQMAP_H

// The names and means of C, in C++ sources too.
// NOLINTBEGIN(modernize-*,readability-identifier-naming)

#include <stddef.h>
#include <stdint.h>

#define SQMAP_VERSION_MAJOR 0
#define SQMAP_VERSION_MINOR 1
#define SQMAP_VERSION_PATCH 0
// Ordered: 0.1.0 is 100.
#define SQMAP_VERSION (SQMAP_VERSION_MAJOR * 10000 + SQMAP_VERSION_MINOR * 100 + SQMAP_VERSION_PATCH)

#if defined(__GNUC__)
#define SQMAP_API __attribute__((visibility("default")))
#else
#define SQMAP_API
#endif

#ifdef __cplusplus
extern "C" {
#endif

// SQMAP_VERSION of the library that is linked.
SQMAP_API int32_t sqmap_version(void);

// Status and errors. Numbers are stable; 1 to 99 are those of sqmap::Status.

typedef enum sqmap_status {
  SQMAP_OK = 0,
  SQMAP_BAD_OPTION = 1,
  SQMAP_FILE_MISSING = 2,
  SQMAP_FILE_UNREADABLE = 3,
  SQMAP_INVALID_ASSET = 7,
  SQMAP_UNSUPPORTED_VERSION = 8,
  SQMAP_NULL_ARGUMENT = 100,  // a handle or array that is required is NULL
  SQMAP_STRUCT_SIZE = 101,    // a struct_size that this library does not know
  SQMAP_OUT_OF_MEMORY = 102,
  SQMAP_STATUS_FORCE_32 = 0x7fffffff
} sqmap_status;

// Where a failed call says why. Both texts end with a zero; longer ones are cut.
typedef struct sqmap_error {
  uint32_t struct_size;
  int32_t status;
  char finding[488];  // what was found, what is required, where
  char remedy[256];   // what to do; may be empty
} sqmap_error;
#define SQMAP_ERROR_INIT                      \
  {                                           \
    sizeof(sqmap_error), SQMAP_OK, {0}, { 0 } \
  }

// A few words about any status; never NULL.
SQMAP_API const char* sqmap_status_text(int32_t status);

// Objects

typedef struct sqmap_object sqmap_object;

// One part of an asset made by the caller; formats/FORMAT.md defines the numbers.
typedef struct sqmap_part_desc {
  uint32_t struct_size;
  uint32_t vertex_count;  // N_m of the layer rule
  double semi_axes_m[3];
  double e1, e2;
  double orientation_wxyz[4];  // object_from_part
  double translation_m[3];
  double sphere_m[4];  // centre and radius of a ball around the superquadric, object frame
  uint32_t rows, cols, level_count, bits;
  double depth_min_m, depth_step_m;
  const uint16_t* code;         // [rows * cols]
  const uint8_t* start_inside;  // [(rows * cols + 7) / 8], or NULL: no texel starts inside
  uint32_t crossing_count;
  const uint32_t* crossing_texel;  // [crossing_count], ascending
  const uint16_t* crossing_code;   // [crossing_count]
  uint32_t vertex_sample_count;
  const uint32_t* vertex_cell;   // [vertex_sample_count], ascending
  const uint8_t* vertex_256ths;  // [2 * vertex_sample_count]: along the rows, along the columns
  const uint16_t* vertex_code;   // [vertex_sample_count]
  double taper;                  // K; 0: a rigid superquadric
  double bend_per_m[2];          // k cos alpha, k sin alpha [1/m]; 0: straight
} sqmap_part_desc;

typedef struct sqmap_asset_desc {
  uint32_t struct_size;
  uint32_t part_count;
  double r_max_m;
  double sphere_m[4];            // around all superquadrics
  const sqmap_part_desc* parts;  // [part_count]
} sqmap_asset_desc;

// Copies what it needs: the arrays may be freed afterwards.
SQMAP_API sqmap_status sqmap_object_build(const sqmap_asset_desc* asset, sqmap_object** object,
                                          sqmap_error* error);
SQMAP_API void sqmap_object_destroy(sqmap_object* object);  // NULL: nothing

typedef struct sqmap_object_info {
  uint32_t struct_size;
  uint32_t part_count, level_count;
  uint32_t reserved;
  double r_max_m;
  double sphere_m[4];
  uint64_t resident_bytes;  // memory that queries and sweeps hold
  // The farthest that a point told to be surely on one side may lie on the other; NaN: a part has no bounds.
  double certainty_tolerance_m;
} sqmap_object_info;
#define SQMAP_OBJECT_INFO_INIT \
  { sizeof(sqmap_object_info), 0, 0, 0, 0, {0, 0, 0, 0}, 0, 0 }

SQMAP_API sqmap_status sqmap_object_get_info(const sqmap_object* object, sqmap_object_info* info);

// Instances: an object under a pose, a scale and a mirror

// A value: copy it freely, while its object lives. Filled by sqmap_instance_place or _place_matrix alone.
typedef struct sqmap_instance {
  uint64_t opaque[12];
} sqmap_instance;

// p_world = scale * R * F * p_object + t, F = diag(-1, 1, 1) where mirrored.
SQMAP_API sqmap_status sqmap_instance_place(const sqmap_object* object, const double orientation_wxyz[4],
                                            const double translation_m[3], double scale, int32_t is_mirrored,
                                            sqmap_instance* instance, sqmap_error* error);
// The same from the upper three rows of a matrix: refused where it shears or scales the axes differently.
SQMAP_API sqmap_status sqmap_instance_place_matrix(const sqmap_object* object,
                                                   const double world_from_object[12],
                                                   sqmap_instance* instance, sqmap_error* error);

// Queries; points and answers in the world

enum { SQMAP_LAYER_AUTO = 0, SQMAP_LAYER_1 = 1, SQMAP_LAYER_2 = 2, SQMAP_LAYER_3 = 3 };
#define SQMAP_NOWHERE 0xFFFFFFFFu  // part of a point outside every superquadric

typedef struct sqmap_query_options {
  uint32_t struct_size;
  uint32_t layer;       // SQMAP_LAYER_
  uint32_t level;       // 0 the finest
  float edge_length_m;  // 0: points stand for themselves
} sqmap_query_options;
#define SQMAP_QUERY_OPTIONS_INIT \
  { sizeof(sqmap_query_options), SQMAP_LAYER_AUTO, 0, 0 }

// Arrays of point_count elements each, those of vectors of 3 * point_count floats; NULL: not wanted.
typedef struct sqmap_answers {
  uint32_t struct_size;
  uint32_t reserved;
  float* signed_distance_m;  // negative inside; NaN: unknown
  float* normal;
  float* surface_m;
  uint32_t* part;
  uint8_t* layer;
  uint8_t* inside;
} sqmap_answers;
#define SQMAP_ANSWERS_INIT \
  { sizeof(sqmap_answers), 0, NULL, NULL, NULL, NULL, NULL, NULL }

// options: NULL for the defaults.
SQMAP_API sqmap_status sqmap_query(const sqmap_instance* instance, const float* points_m, size_t point_count,
                                   const sqmap_query_options* options, const sqmap_answers* answers);

// What the bounds of a conservative bake prove of a point. Unsure: the surface may be near, so look closer;
// within a part without bounds, every point.
enum { SQMAP_UNSURE = 0, SQMAP_SURELY_OUTSIDE = 1, SQMAP_SURELY_INSIDE = 2 };
SQMAP_API sqmap_status sqmap_certainty(const sqmap_instance* instance, const float* points_m,
                                       size_t point_count, uint8_t* certainty);

// Contacts

typedef struct sqmap_contact {
  uint32_t point, part;
  float depth_m;
  float normal[3];
  float position_m[3];
  float surface_m[3];
} sqmap_contact;

// found is 1 or 0; *contact is written where it is 1.
SQMAP_API sqmap_status sqmap_any_contact(const sqmap_instance* instance, const float* points_m,
                                         size_t point_count, const sqmap_query_options* options,
                                         int32_t* found);
SQMAP_API sqmap_status sqmap_first_contact(const sqmap_instance* instance, const float* points_m,
                                           size_t point_count, const sqmap_query_options* options,
                                           int32_t* found, sqmap_contact* contact);
SQMAP_API sqmap_status sqmap_deepest_contact(const sqmap_instance* instance, const float* points_m,
                                             size_t point_count, const sqmap_query_options* options,
                                             int32_t* found, sqmap_contact* contact);
// The first `capacity` contacts; *found counts all of them, so more than capacity tells that they did not
// fit. contacts may be NULL where capacity is 0.
SQMAP_API sqmap_status sqmap_all_contacts(const sqmap_instance* instance, const float* points_m,
                                          size_t point_count, const sqmap_query_options* options,
                                          sqmap_contact* contacts, size_t capacity, size_t* found);

// Bodies: the points of a second object, in blocks that are dropped together where they are far

typedef struct sqmap_body sqmap_body;

// Copies the points. SQMAP_BAD_OPTION: one is not finite, or there are too many.
SQMAP_API sqmap_status sqmap_body_build(const float* points_m, size_t point_count, sqmap_body** body,
                                        sqmap_error* error);
SQMAP_API void sqmap_body_destroy(sqmap_body* body);  // NULL: nothing
// New places of the same points, for bodies that deform; does not allocate, and no other thread may use the
// body meanwhile. SQMAP_BAD_OPTION, and nothing changes: another count, or a point that is not finite.
SQMAP_API sqmap_status sqmap_body_refit(sqmap_body* body, const float* points_m, size_t point_count);

// p_object = scale * R * p_body + t
typedef struct sqmap_body_placement {
  double orientation_wxyz[4];
  double translation_m[3];
  double scale;
} sqmap_body_placement;

enum { SQMAP_SEEK_ALL = 0, SQMAP_SEEK_ANY = 1, SQMAP_SEEK_DEEPEST = 2 };

typedef struct sqmap_body_options {
  uint32_t struct_size;
  uint32_t layer, level;
  float edge_length_m;
  float within_m;  // signed distances below this are contacts
  uint32_t seek;   // SQMAP_SEEK_
} sqmap_body_options;
#define SQMAP_BODY_OPTIONS_INIT \
  { sizeof(sqmap_body_options), SQMAP_LAYER_AUTO, 0, 0, 0, SQMAP_SEEK_ALL }

// What a question may cost, in units of work that are the same on every machine: the deepest layer that fits
// is used, at least layer 1.
typedef struct sqmap_work_budget {
  uint32_t struct_size;
  uint32_t layer;  // out: SQMAP_LAYER_ that was afforded
  uint64_t units;  // in
  uint64_t spent;  // out
  uint32_t level;  // out
  uint32_t reserved;
} sqmap_work_budget;
#define SQMAP_WORK_BUDGET_INIT \
  { sizeof(sqmap_work_budget), SQMAP_LAYER_AUTO, 0, 0, 0, 0 }

// Contacts in the object's frame, in an order that is the same every time, their points by the caller's
// index. The first `capacity` are written; *found counts all, with SEEK_ANY and _DEEPEST at most 1.
// budget: NULL for none.
SQMAP_API sqmap_status sqmap_body_contacts(const sqmap_object* object, const sqmap_body* body,
                                           const sqmap_body_placement* placement,
                                           const sqmap_body_options* options, sqmap_work_budget* budget,
                                           sqmap_contact* contacts, size_t capacity, size_t* found);
// The same of an instance, contacts in the world. p_world = scale * R * F * p_body + t, F = diag(-1, 1, 1)
// where the body is mirrored.
SQMAP_API sqmap_status sqmap_instance_body_contacts(const sqmap_instance* instance, const sqmap_body* body,
                                                    const sqmap_body_placement* world_from_body,
                                                    int32_t is_mirrored, const sqmap_body_options* options,
                                                    sqmap_work_budget* budget, sqmap_contact* contacts,
                                                    size_t capacity, size_t* found);

// Turns microseconds into units, by what frames before took; the caller holds the clock and the rate.
#define SQMAP_UNITS_PER_US 20.0  // until frames have been seen
SQMAP_API uint64_t sqmap_work_units(double units_per_us, double us);
// The rate after a frame that spent so much in such a time.
SQMAP_API double sqmap_work_learned(double units_per_us, uint64_t spent, double took_us);

// Swept queries

enum {
  SQMAP_SWEEP_INVALID = 0,
  SQMAP_SWEEP_CLEAR = 1,
  SQMAP_SWEEP_CONTACT = 2,
  SQMAP_SWEEP_UNRESOLVED = 3  // clear up to `time`, unknown beyond
};

typedef struct sqmap_sweep_options {
  uint32_t struct_size;
  uint32_t layer, level;
  float edge_length_m;
  float tolerance_m;  // 0: a thousandth of r_max
  float error_m;      // negative: as the bundle declares
  uint32_t max_steps;
} sqmap_sweep_options;
#define SQMAP_SWEEP_OPTIONS_INIT \
  { sizeof(sqmap_sweep_options), SQMAP_LAYER_3, 0, 0, 0, -1, 256 }

typedef struct sqmap_sweep_result {
  uint8_t status;  // SQMAP_SWEEP_
  uint8_t starts_in_contact;
  uint16_t steps;
  float time;  // [0, 1]
  sqmap_contact contact;
} sqmap_sweep_result;

// Points that move from from_m[i] to to_m[i] while the object moves from start to end; end NULL: it rests.
SQMAP_API sqmap_status sqmap_sweep(const sqmap_instance* start, const sqmap_instance* end,
                                   const float* from_m, const float* to_m, size_t point_count,
                                   const sqmap_sweep_options* options, sqmap_sweep_result* results);

// Bundles: in the library sqmap_c, which needs HDF5 and zlib

SQMAP_API sqmap_status sqmap_object_load_file(const char* path, sqmap_object** object, sqmap_error* error);
SQMAP_API sqmap_status sqmap_object_load_memory(const void* bytes, size_t byte_count, sqmap_object** object,
                                                sqmap_error* error);

#ifdef __cplusplus
}
#endif

// NOLINTEND(modernize-*,readability-identifier-naming)
#endif
