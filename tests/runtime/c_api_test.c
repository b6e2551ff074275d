// SPDX-License-Identifier: Apache-2.0
// The C interface, as a C program uses it. Usage: c_api_test [BUNDLE]
//
// The object is a ball of radius 0.4 m about the origin within a superquadric of radius 0.5 m: all answers
// are known by hand. Without a bundle it is made from numbers; the program then needs no HDF5. With
// SQMAP_TEST_LOAD it is read from BUNDLE, by name and from memory.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "sqmap/sqmap.h"

static int failures = 0;

#define SQMAP_CHECK(condition)                                            \
  do {                                                                    \
    if (!(condition)) {                                                   \
      fprintf(stderr, "c_api_test: line %d: %s\n", __LINE__, #condition); \
      ++failures;                                                         \
    }                                                                     \
  } while (0)

#define SQMAP_NEAR(a, b, tolerance) (fabs((double)(a) - (double)(b)) <= (tolerance))

enum { kRows = 17, kCols = 32 };
static uint16_t codes[kRows * kCols];  // all zero: a depth of depth_min_m everywhere

static sqmap_part_desc ball_part(void) {
  sqmap_part_desc part = {0};
  part.struct_size = sizeof part;
  part.vertex_count = 10000;
  part.semi_axes_m[0] = part.semi_axes_m[1] = part.semi_axes_m[2] = 0.5;
  part.e1 = part.e2 = 1;
  part.orientation_wxyz[0] = 1;
  part.sphere_m[3] = 0.5;
  part.rows = kRows;
  part.cols = kCols;
  part.level_count = 1;
  part.bits = 8;
  part.depth_min_m = 0.1;
  part.depth_step_m = 1e-4;
  part.code = codes;
  return part;
}

static sqmap_object* made_ball(void) {
  sqmap_part_desc part = ball_part();
  sqmap_asset_desc asset = {sizeof asset, 1, 0.8, {0, 0, 0, 0.5}, &part};
  sqmap_object* object = NULL;
  sqmap_error error = SQMAP_ERROR_INIT;
  SQMAP_CHECK(sqmap_object_build(&asset, &object, &error) == SQMAP_OK);
  SQMAP_CHECK(error.status == SQMAP_OK);
  return object;
}

static void refuses_broken_descriptions(void) {
  sqmap_part_desc part = ball_part();
  sqmap_asset_desc asset = {sizeof asset, 1, 0.8, {0, 0, 0, 0.5}, &part};
  sqmap_object* object = NULL;
  sqmap_error error = SQMAP_ERROR_INIT;
  SQMAP_CHECK(sqmap_object_build(NULL, &object, &error) == SQMAP_NULL_ARGUMENT);
  SQMAP_CHECK(error.status == SQMAP_NULL_ARGUMENT && error.finding[0] != 0 && error.remedy[0] != 0);
  SQMAP_CHECK(sqmap_object_build(&asset, NULL, NULL) == SQMAP_NULL_ARGUMENT);
  part.e1 = 3;
  SQMAP_CHECK(sqmap_object_build(&asset, &object, &error) == SQMAP_INVALID_ASSET);
  SQMAP_CHECK(strstr(error.finding, "part 0") != NULL);
  part = ball_part();
  part.code = NULL;
  SQMAP_CHECK(sqmap_object_build(&asset, &object, &error) == SQMAP_INVALID_ASSET);
  part = ball_part();
  part.rows = 0xFFFFFFFFU;  // must not be read, nor allocated
  SQMAP_CHECK(sqmap_object_build(&asset, &object, &error) == SQMAP_INVALID_ASSET);
  part = ball_part();
  part.struct_size -= 4;
  SQMAP_CHECK(sqmap_object_build(&asset, &object, &error) == SQMAP_STRUCT_SIZE);
  part = ball_part();
  asset.struct_size = 0;
  SQMAP_CHECK(sqmap_object_build(&asset, &object, &error) == SQMAP_STRUCT_SIZE);
  SQMAP_CHECK(object == NULL);
  sqmap_object_destroy(NULL);
}

// Narrower by 0.7 at the lower point, wider by 1.3 at the upper one: the ball would hold the first alone.
static void tapers(void) {
  const float points[6] = {0.38F, 0, -0.25F, 0.5F, 0, 0.25F};
  uint8_t inside[2] = {9, 9};
  sqmap_part_desc part = ball_part();
  part.taper = 0.6;
  part.sphere_m[3] = 0.8;
  sqmap_asset_desc asset = {sizeof asset, 1, 0.8, {0, 0, 0, 0.8}, &part};
  sqmap_object* object = NULL;
  SQMAP_CHECK(sqmap_object_build(&asset, &object, NULL) == SQMAP_OK);
  const double pose[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
  sqmap_instance instance;
  SQMAP_CHECK(sqmap_instance_place_matrix(object, pose, &instance, NULL) == SQMAP_OK);
  sqmap_query_options options = SQMAP_QUERY_OPTIONS_INIT;
  options.layer = SQMAP_LAYER_1;
  sqmap_answers answers = SQMAP_ANSWERS_INIT;
  answers.inside = inside;
  SQMAP_CHECK(sqmap_query(&instance, points, 2, &options, &answers) == SQMAP_OK);
  SQMAP_CHECK(inside[0] == 0 && inside[1] == 1);
  sqmap_object_destroy(object);

  sqmap_error error = SQMAP_ERROR_INIT;
  part.taper = 0.71;  // not convex
  object = NULL;
  SQMAP_CHECK(sqmap_object_build(&asset, &object, &error) == SQMAP_INVALID_ASSET && object == NULL);
  SQMAP_CHECK(strstr(error.finding, "taper") != NULL);
}

static void tells_about_the_object(const sqmap_object* object) {
  sqmap_object_info info = SQMAP_OBJECT_INFO_INIT;
  SQMAP_CHECK(sqmap_object_get_info(object, &info) == SQMAP_OK);
  SQMAP_CHECK(info.part_count == 1 && info.level_count == 1);
  SQMAP_CHECK(SQMAP_NEAR(info.r_max_m, 0.8, 1e-12) && SQMAP_NEAR(info.sphere_m[3], 0.5, 1e-12));
  SQMAP_CHECK(info.resident_bytes > 1000 && info.resident_bytes < 1000000);
  info.struct_size = 4;
  SQMAP_CHECK(sqmap_object_get_info(object, &info) == SQMAP_STRUCT_SIZE);
}

// Twice as large, mirrored, turned a quarter about z, and moved by (10, 0, 0).
static sqmap_instance placed(const sqmap_object* object) {
  const double matrix[12] = {0, -2, 0, 10, -2, 0, 0, 0, 0, 0, 2, 0};
  sqmap_instance instance;
  SQMAP_CHECK(sqmap_instance_place_matrix(object, matrix, &instance, NULL) == SQMAP_OK);
  return instance;
}

static void places_and_refuses(const sqmap_object* object) {
  const double turn[4] = {1, 0, 0, 0}, at[3] = {0, 0, 0}, nowhere[3] = {NAN, 0, 0};
  const double shear[12] = {1, 0.5, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
  sqmap_instance instance = {{0}};
  const sqmap_instance untouched = instance;
  sqmap_error error = SQMAP_ERROR_INIT;
  SQMAP_CHECK(sqmap_instance_place(object, turn, nowhere, 1, 0, &instance, &error) == SQMAP_BAD_OPTION);
  SQMAP_CHECK(sqmap_instance_place(object, turn, at, 0, 0, &instance, &error) == SQMAP_BAD_OPTION);
  SQMAP_CHECK(strstr(error.finding, "scale is 0.0") != NULL);
  SQMAP_CHECK(sqmap_instance_place_matrix(object, shear, &instance, &error) == SQMAP_BAD_OPTION);
  SQMAP_CHECK(sqmap_instance_place(NULL, turn, at, 1, 0, &instance, NULL) == SQMAP_NULL_ARGUMENT);
  SQMAP_CHECK(memcmp(&instance, &untouched, sizeof instance) == 0);
  int32_t found = 7;
  const float origin[3] = {0, 0, 0};
  SQMAP_CHECK(sqmap_any_contact(&instance, origin, 1, NULL, &found) == SQMAP_NULL_ARGUMENT);  // never placed
  SQMAP_CHECK(found == 7);
}

static void answers_points(const sqmap_instance* instance) {
  const float points[12] = {10.6F, 0, 0, 10, 0.9F, 0, 10, 0, 4, NAN, 0, 0};
  float distance[4] = {9, 9, 9, 9}, normal[12] = {0}, surface[12] = {0};
  uint32_t part[4] = {9, 9, 9, 9};
  uint8_t layer[4] = {9, 9, 9, 9}, inside[4] = {9, 9, 9, 9};
  sqmap_answers answers = SQMAP_ANSWERS_INIT;
  answers.signed_distance_m = distance;
  answers.normal = normal;
  answers.surface_m = surface;
  answers.part = part;
  answers.layer = layer;
  answers.inside = inside;
  SQMAP_CHECK(sqmap_query(instance, points, 4, NULL, &answers) == SQMAP_OK);
  SQMAP_CHECK(SQMAP_NEAR(distance[0], -0.2, 1e-3) && SQMAP_NEAR(distance[1], 0.1, 1e-3));
  SQMAP_CHECK(isnan(distance[2]) && isnan(distance[3]));
  SQMAP_CHECK(SQMAP_NEAR(normal[0], 1, 1e-3) && SQMAP_NEAR(normal[4], 1, 1e-3));
  SQMAP_CHECK(SQMAP_NEAR(surface[0], 10.8, 1e-3) && SQMAP_NEAR(surface[4], 0.8, 1e-3));
  SQMAP_CHECK(part[0] == 0 && part[1] == 0 && part[2] == SQMAP_NOWHERE && part[3] == SQMAP_NOWHERE);
  SQMAP_CHECK(layer[0] == SQMAP_LAYER_3);
  SQMAP_CHECK(inside[0] == 1 && inside[1] == 0 && inside[2] == 0 && inside[3] == 0);

  sqmap_query_options options = SQMAP_QUERY_OPTIONS_INIT;
  options.layer = SQMAP_LAYER_1;
  SQMAP_CHECK(sqmap_query(instance, points, 4, &options, &answers) == SQMAP_OK);
  SQMAP_CHECK(isnan(distance[1]) && inside[1] == 1);  // within the superquadric
  options.layer = 4;
  SQMAP_CHECK(sqmap_query(instance, points, 4, &options, &answers) == SQMAP_BAD_OPTION);
  options.struct_size = 3;
  SQMAP_CHECK(sqmap_query(instance, points, 4, &options, &answers) == SQMAP_STRUCT_SIZE);
  SQMAP_CHECK(sqmap_query(instance, NULL, 4, NULL, &answers) == SQMAP_NULL_ARGUMENT);
  SQMAP_CHECK(sqmap_query(instance, NULL, 0, NULL, &answers) == SQMAP_OK);
  answers.struct_size += 8;
  SQMAP_CHECK(sqmap_query(instance, points, 4, NULL, &answers) == SQMAP_STRUCT_SIZE);
}

static void finds_contacts(const sqmap_instance* instance) {
  const float points[15] = {0, 0, 0, 10.7F, 0, 0, 10, 0.9F, 0, 10, 0, 0.5F, 10, 0.75F, 0};
  int32_t found = 7;
  sqmap_contact contact = {0}, contacts[5];
  SQMAP_CHECK(sqmap_any_contact(instance, points, 5, NULL, &found) == SQMAP_OK && found == 1);
  SQMAP_CHECK(sqmap_any_contact(instance, points, 1, NULL, &found) == SQMAP_OK && found == 0);
  SQMAP_CHECK(sqmap_first_contact(instance, points, 5, NULL, &found, &contact) == SQMAP_OK && found == 1);
  SQMAP_CHECK(contact.point == 1 && contact.part == 0 && SQMAP_NEAR(contact.depth_m, 0.1, 1e-3));
  SQMAP_CHECK(SQMAP_NEAR(contact.normal[0], 1, 1e-3) && contact.position_m[0] == points[3]);
  SQMAP_CHECK(SQMAP_NEAR(contact.surface_m[0], 10.8, 1e-3));
  SQMAP_CHECK(sqmap_deepest_contact(instance, points, 5, NULL, &found, &contact) == SQMAP_OK && found == 1);
  SQMAP_CHECK(contact.point == 3 && SQMAP_NEAR(contact.depth_m, 0.3, 1e-3));
  size_t count = 0;
  SQMAP_CHECK(sqmap_all_contacts(instance, points, 5, NULL, contacts, 5, &count) == SQMAP_OK && count == 3);
  SQMAP_CHECK(contacts[0].point == 1 && contacts[1].point == 3 && contacts[2].point == 4);
  contacts[1].point = 99;
  SQMAP_CHECK(sqmap_all_contacts(instance, points, 5, NULL, contacts, 1, &count) == SQMAP_OK && count == 3);
  SQMAP_CHECK(contacts[0].point == 1 && contacts[1].point == 99);
  SQMAP_CHECK(sqmap_all_contacts(instance, points, 5, NULL, NULL, 0, &count) == SQMAP_OK && count == 3);
  SQMAP_CHECK(sqmap_all_contacts(instance, points, 5, NULL, NULL, 1, &count) == SQMAP_NULL_ARGUMENT);
}

// The ball has no bounds: only what lies outside its superquadric is sure.
static void tells_what_is_sure(const sqmap_object* object, const sqmap_instance* instance) {
  const float points[9] = {10.2F, 0, 0, 30, 0, 0, NAN, 0, 0};
  uint8_t certainty[3] = {9, 9, 9};
  SQMAP_CHECK(sqmap_certainty(instance, points, 3, certainty) == SQMAP_OK);
  SQMAP_CHECK(certainty[0] == SQMAP_UNSURE && certainty[1] == SQMAP_SURELY_OUTSIDE);
  SQMAP_CHECK(certainty[2] == SQMAP_UNSURE);
  SQMAP_CHECK(sqmap_certainty(instance, points, 3, NULL) == SQMAP_NULL_ARGUMENT);
  SQMAP_CHECK(sqmap_certainty(NULL, points, 3, certainty) == SQMAP_NULL_ARGUMENT);
  sqmap_object_info info = SQMAP_OBJECT_INFO_INIT;
  SQMAP_CHECK(sqmap_object_get_info(object, &info) == SQMAP_OK);
  SQMAP_CHECK(isnan(info.certainty_tolerance_m));
  // A caller built with version 0.1 has no such field.
  info.struct_size = 64;
  info.certainty_tolerance_m = 5;
  SQMAP_CHECK(sqmap_object_get_info(object, &info) == SQMAP_OK && info.certainty_tolerance_m == 5);
}

static void sweeps(const sqmap_object* object, const sqmap_instance* instance) {
  const float from[9] = {13, 0, 0, 13, 3, 0, NAN, 0, 0}, to[9] = {7, 0, 0, 7, 3, 0, 0, 0, 0};
  sqmap_sweep_result results[3];
  SQMAP_CHECK(sqmap_sweep(instance, NULL, from, to, 3, NULL, results) == SQMAP_OK);
  SQMAP_CHECK(results[0].status == SQMAP_SWEEP_CONTACT);
  SQMAP_CHECK(SQMAP_NEAR(results[0].time, (3 - 0.8) / 6, 2e-3));
  SQMAP_CHECK(SQMAP_NEAR(results[0].contact.normal[0], 1, 1e-2) && results[0].starts_in_contact == 0);
  SQMAP_CHECK(results[1].status == SQMAP_SWEEP_CLEAR && results[1].time == 1 &&
              results[1].contact.point == 1);
  SQMAP_CHECK(results[2].status == SQMAP_SWEEP_INVALID && results[2].time == 0);

  // The object comes to the point instead.
  const double matrix[12] = {0, -2, 0, 16, -2, 0, 0, 0, 0, 0, 2, 0};
  sqmap_instance end;
  sqmap_sweep_options options = SQMAP_SWEEP_OPTIONS_INIT;
  SQMAP_CHECK(sqmap_instance_place_matrix(object, matrix, &end, NULL) == SQMAP_OK);
  SQMAP_CHECK(sqmap_sweep(instance, &end, from, from, 1, &options, results) == SQMAP_OK);
  SQMAP_CHECK(results[0].status == SQMAP_SWEEP_CONTACT && SQMAP_NEAR(results[0].time, (3 - 0.8) / 6, 2e-3));
  options.max_steps = 1;
  SQMAP_CHECK(sqmap_sweep(instance, &end, from, from, 1, &options, results) == SQMAP_OK);
  SQMAP_CHECK(results[0].status == SQMAP_SWEEP_UNRESOLVED && results[0].time < 0.37F);
  options.struct_size = 0;
  SQMAP_CHECK(sqmap_sweep(instance, &end, from, from, 1, &options, results) == SQMAP_STRUCT_SIZE);
}

// The ball in its own frame, which is at the origin with the radius that finds_contacts() uses.
static void meets_a_body(const sqmap_object* object) {
  // Far apart, so that most blocks are dropped: in contact are 7 and 150 alone.
  enum { kPoints = 200 };
  float points[3 * kPoints];
  for (size_t i = 0; i < kPoints; ++i) {
    points[3 * i] = 3 + (float)i;
    points[3 * i + 1] = points[3 * i + 2] = 0;
  }
  sqmap_object_info info = SQMAP_OBJECT_INFO_INIT;
  SQMAP_CHECK(sqmap_object_get_info(object, &info) == SQMAP_OK);
  const float centre[3] = {(float)info.sphere_m[0], (float)info.sphere_m[1], (float)info.sphere_m[2]};
  for (int k = 0; k < 3; ++k) {
    points[3 * 7 + k] = centre[k] + (k == 0 ? 0.3F : 0);
    points[3 * 150 + k] = centre[k] + (k == 1 ? 0.35F : 0);
  }
  sqmap_body* body = NULL;
  SQMAP_CHECK(sqmap_body_build(points, kPoints, &body, NULL) == SQMAP_OK);
  SQMAP_CHECK(sqmap_body_build(NULL, 1, &body, NULL) == SQMAP_NULL_ARGUMENT);
  if (body == NULL) return;

  const sqmap_body_placement here = {{1, 0, 0, 0}, {0, 0, 0}, 1}, away = {{1, 0, 0, 0}, {0, 50, 0}, 1};
  sqmap_contact contacts[4];
  size_t found = 9;
  SQMAP_CHECK(sqmap_body_contacts(object, body, &here, NULL, NULL, contacts, 4, &found) == SQMAP_OK &&
              found == 2);
  SQMAP_CHECK(contacts[0].point + contacts[1].point == 157 && contacts[0].depth_m > 0);
  SQMAP_CHECK(sqmap_body_contacts(object, body, &here, NULL, NULL, NULL, 0, &found) == SQMAP_OK &&
              found == 2);
  SQMAP_CHECK(sqmap_body_contacts(object, body, &away, NULL, NULL, contacts, 4, &found) == SQMAP_OK &&
              found == 0);

  sqmap_body_options options = SQMAP_BODY_OPTIONS_INIT;
  options.layer = SQMAP_LAYER_3;
  options.seek = SQMAP_SEEK_DEEPEST;
  SQMAP_CHECK(sqmap_body_contacts(object, body, &here, &options, NULL, contacts, 4, &found) == SQMAP_OK &&
              found == 1);
  SQMAP_CHECK(contacts[0].point == 7);  // it lies deeper

  // Whatever the units, layer 1 is afforded and finds both; with enough of them layer 3 is reached.
  options.seek = SQMAP_SEEK_ALL;
  sqmap_work_budget budget = SQMAP_WORK_BUDGET_INIT;
  SQMAP_CHECK(sqmap_body_contacts(object, body, &here, &options, &budget, contacts, 4, &found) == SQMAP_OK);
  SQMAP_CHECK(budget.layer == SQMAP_LAYER_1 && budget.spent > 0 && found == 2);
  const uint64_t least = budget.spent;
  budget.units = 1000000;
  SQMAP_CHECK(sqmap_body_contacts(object, body, &here, &options, &budget, contacts, 4, &found) == SQMAP_OK);
  SQMAP_CHECK(budget.layer == SQMAP_LAYER_3 && budget.spent > least && budget.spent <= budget.units &&
              found == 2);

  points[3 * 7] = 500;
  SQMAP_CHECK(sqmap_body_refit(body, points, kPoints) == SQMAP_OK);
  SQMAP_CHECK(sqmap_body_contacts(object, body, &here, NULL, NULL, contacts, 4, &found) == SQMAP_OK &&
              found == 1);
  SQMAP_CHECK(contacts[0].point == 150);
  SQMAP_CHECK(sqmap_body_refit(body, points, kPoints - 1) == SQMAP_BAD_OPTION);
  points[0] = NAN;
  SQMAP_CHECK(sqmap_body_refit(body, points, kPoints) == SQMAP_BAD_OPTION);

  options.seek = 3;
  SQMAP_CHECK(sqmap_body_contacts(object, body, &here, &options, NULL, contacts, 4, &found) ==
              SQMAP_BAD_OPTION);
  budget.struct_size = 0;
  SQMAP_CHECK(sqmap_body_contacts(object, body, &here, NULL, &budget, contacts, 4, &found) ==
              SQMAP_STRUCT_SIZE);
  SQMAP_CHECK(sqmap_body_contacts(object, NULL, &here, NULL, NULL, contacts, 4, &found) ==
              SQMAP_NULL_ARGUMENT);
  sqmap_body_destroy(body);
  sqmap_body_destroy(NULL);

  sqmap_error error = SQMAP_ERROR_INIT;
  SQMAP_CHECK(sqmap_body_build(points, kPoints, &body, &error) == SQMAP_BAD_OPTION);
  SQMAP_CHECK(strstr(error.finding, "point 0") != NULL);
}

// The ball of 0.4 m, twice as large, is 0.8 m about (10, 0, 0): a point at x = 10.7 is 0.1 m deep. Mirrored,
// the body has its points at the other side of its origin.
static void meets_bodies_in_the_world(const sqmap_instance* instance) {
  const float points[6] = {0.35F, 0, 0, 5, 5, 5};
  sqmap_body* body = NULL;
  SQMAP_CHECK(sqmap_body_build(points, 2, &body, NULL) == SQMAP_OK);
  if (body == NULL) return;
  sqmap_contact contacts[2];
  size_t found = 9;
  sqmap_work_budget budget = SQMAP_WORK_BUDGET_INIT;
  budget.units = 1000;
  for (int32_t is_mirrored = 0; is_mirrored < 2; ++is_mirrored) {
    const sqmap_body_placement at = {{1, 0, 0, 0}, {is_mirrored ? 11.4 : 10, 0, 0}, 2};
    SQMAP_CHECK(sqmap_instance_body_contacts(instance, body, &at, is_mirrored, NULL, &budget, contacts, 2,
                                             &found) == SQMAP_OK);
    SQMAP_CHECK(found == 1 && contacts[0].point == 0 && SQMAP_NEAR(contacts[0].depth_m, 0.1, 1e-3));
    SQMAP_CHECK(SQMAP_NEAR(contacts[0].position_m[0], 10.7, 1e-5) &&
                SQMAP_NEAR(contacts[0].normal[0], 1, 1e-3));
    SQMAP_CHECK(budget.layer == SQMAP_LAYER_3 && budget.spent > 0);
    SQMAP_CHECK(sqmap_instance_body_contacts(instance, body, &at, !is_mirrored, NULL, NULL, contacts, 2,
                                             &found) == SQMAP_OK &&
                found == (is_mirrored ? 0U : 1U));
  }
  const sqmap_instance never = {{0}};
  SQMAP_CHECK(sqmap_instance_body_contacts(&never, body, NULL, 0, NULL, NULL, contacts, 2, &found) ==
              SQMAP_NULL_ARGUMENT);
  SQMAP_CHECK(sqmap_instance_body_contacts(instance, body, NULL, 0, NULL, NULL, contacts, 2, &found) ==
              SQMAP_NULL_ARGUMENT);
  sqmap_body_destroy(body);
}

static void keeps_a_rate(void) {
  SQMAP_CHECK(sqmap_work_units(20, 100) == 2000 && sqmap_work_units(20, NAN) == 0);
  const double slower = sqmap_work_learned(20, 1000, 100), faster = sqmap_work_learned(20, 10000, 100);
  SQMAP_CHECK(slower < 20 && slower > 10 && faster > 20 && faster < 100);
}

static void all_about(sqmap_object* object) {
  if (object == NULL) return;
  tells_about_the_object(object);
  places_and_refuses(object);
  const sqmap_instance instance = placed(object);
  meets_bodies_in_the_world(&instance);
  answers_points(&instance);
  finds_contacts(&instance);
  tells_what_is_sure(object, &instance);
  sweeps(object, &instance);
  meets_a_body(object);
  sqmap_object_destroy(object);
}

#ifdef SQMAP_TEST_LOAD
static void loads(const char* path) {
  sqmap_object* object = NULL;
  sqmap_error error = SQMAP_ERROR_INIT;
  SQMAP_CHECK(sqmap_object_load_file(path, &object, &error) == SQMAP_OK);
  if (error.status != SQMAP_OK) fprintf(stderr, "c_api_test: %s\n", error.finding);
  all_about(object);

  static unsigned char bytes[1 << 20];
  FILE* file = fopen(path, "rb");
  const size_t size = file != NULL ? fread(bytes, 1, sizeof bytes, file) : 0;
  if (file != NULL) fclose(file);
  SQMAP_CHECK(size > 512);
  object = NULL;
  SQMAP_CHECK(sqmap_object_load_memory(bytes, size, &object, NULL) == SQMAP_OK);
  all_about(object);

  object = NULL;
  SQMAP_CHECK(sqmap_object_load_memory(bytes, size / 2, &object, &error) == SQMAP_INVALID_ASSET);
  SQMAP_CHECK(error.finding[0] != 0);
  SQMAP_CHECK(sqmap_object_load_file("no such file.h5", &object, &error) == SQMAP_FILE_MISSING);
  SQMAP_CHECK(strstr(error.finding, "no such file.h5") != NULL);
  SQMAP_CHECK(object == NULL);
}
#endif

int main(int argc, char** argv) {
  SQMAP_CHECK(sqmap_version() == SQMAP_VERSION);
  SQMAP_CHECK(strcmp(sqmap_status_text(SQMAP_OK), "done") == 0);
  SQMAP_CHECK(strcmp(sqmap_status_text(-1), "unknown status") == 0);
  refuses_broken_descriptions();
  tapers();
  keeps_a_rate();
  all_about(made_ball());
#ifdef SQMAP_TEST_LOAD
  SQMAP_CHECK(argc == 2);
  if (argc == 2) loads(argv[1]);
#else
  (void)argc;
  (void)argv;
#endif
  return failures == 0 ? 0 : 1;
}
