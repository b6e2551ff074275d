// SPDX-License-Identifier: GPL-3.0-or-later
#include "worker_messages.hpp"

#include <exception>

#include <nlohmann/json.hpp>

#include "../common/json_text.hpp"
#include "record_json.hpp"

namespace sqmap::apps {
namespace {

using Json = nlohmann::ordered_json;

Error unreadable(const std::exception& problem) {
  return {Status::kBakeFailed, std::string("message between processes: ") + problem.what(), ""};
}

}  // namespace

std::string job_line(const WorkerJob& job) {
  return json_line({{"settings", job.bake.settings},
                    {"threads", job.bake.threads},
                    {"verify_determinism", job.bake.verify_determinism},
                    {"is_fallback", job.bake.is_fallback},
                    {"memory_bytes", job.memory_bytes},
                    {"parent_pid", job.parent_pid}});
}

Result<WorkerJob> parse_job(std::string_view line) {
  try {
    const Json json = Json::parse(line);
    WorkerJob job;
    for (const auto& [name, text] : json.at("settings").items())
      job.bake.settings.emplace(name, text.get<std::string>());
    job.bake.threads = json.at("threads").get<unsigned>();
    job.bake.verify_determinism = json.at("verify_determinism").get<bool>();
    job.bake.is_fallback = json.at("is_fallback").get<bool>();
    job.memory_bytes = json.at("memory_bytes").get<std::uint64_t>();
    job.parent_pid = json.at("parent_pid").get<std::int64_t>();
    return job;
  } catch (const std::exception& problem) {
    return unreadable(problem);
  }
}

std::string progress_line(std::string_view stage, double fraction) {
  return json_line({{"stage", stage}, {"fraction", fraction}});
}

std::string product_line(const BakeProduct& product) {
  return json_line(
      {{"record", Json::parse(record_line(product.record))}, {"bundle_bytes", product.bundle.size()}});
}

Result<WorkerMessage> parse_message(std::string_view line) {
  try {
    const Json json = Json::parse(line);
    WorkerMessage message;
    if (json.contains("memory")) {
      message.kind = WorkerMessage::Kind::kMemory;
    } else if (const auto stage = json.find("stage"); stage != json.end()) {
      message.stage = stage->get<std::string>();
      message.fraction = json.at("fraction").is_null() ? 0 : json.at("fraction").get<double>();
    } else {
      message.kind = WorkerMessage::Kind::kRecord;
      Result<BakeRecord> record = parse_record(json.at("record").dump());
      if (!record) return record.error();
      message.record = std::move(record).value();
      message.bundle_bytes = json.at("bundle_bytes").get<std::uint64_t>();
    }
    return message;
  } catch (const std::exception& problem) {
    return unreadable(problem);
  }
}

}  // namespace sqmap::apps
