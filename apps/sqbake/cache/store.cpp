// SPDX-License-Identifier: GPL-3.0-or-later
#include "store.hpp"

#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <string_view>
#include <system_error>
#include <tuple>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <sys/stat.h>
#include <unistd.h>

#include "../../common/files.hpp"

namespace sqmap::apps {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr std::uint64_t kLargestText = std::uint64_t{16} << 20;
constexpr std::uint64_t kLargestObject = std::uint64_t{1} << 30;
constexpr std::int64_t kMarkInterval_ns = 3'600'000'000'000;
constexpr const char* kResultSchema = "sqmap.cache-result/1";
constexpr const char* kOutputSchema = "sqmap.cache-output/1";

constexpr std::string_view kTag =
    "Signature: 8a477f597d28d172789f06886806bc55\n"
    "# This folder holds bundles that sqbake can make again. It may be removed at any time.\n";

fs::path sharded(const fs::path& folder, const std::string& hash) {
  return folder / hash.substr(0, 2) / hash;
}

std::span<const std::uint8_t> bytes_of(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

/// Bytes that are not UTF-8, in file names, become U+FFFD.
std::string text_of(const Json& json) {
  return json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string text_at(const Json& json, const char* name) {
  const auto found = json.find(name);
  return found != json.end() && found->is_string() ? found->get<std::string>() : std::string();
}

Json stamp_json(const std::optional<FileStamp>& stamp) {
  if (!stamp) return nullptr;
  return {stamp->size, stamp->inode, stamp->device, stamp->mtime_ns, stamp->ctime_ns};
}

std::optional<FileStamp> stamp_at(const Json& json, const char* name) {
  const auto found = json.find(name);
  if (found == json.end() || !found->is_array() || found->size() != 5) return std::nullopt;
  for (const Json& number : *found)
    if (!number.is_number_integer()) return std::nullopt;
  const Json& n = *found;
  return FileStamp{n[0].get<std::uint64_t>(), n[1].get<std::uint64_t>(), n[2].get<std::uint64_t>(),
                   n[3].get<std::int64_t>(), n[4].get<std::int64_t>()};
}

std::optional<Json> parsed(std::span<const std::uint8_t> bytes, const char* schema) {
  Json json = Json::parse(bytes.begin(), bytes.end(), nullptr, false);
  if (!json.is_object() || text_at(json, "schema") != schema) return std::nullopt;
  return json;
}

std::optional<OutputRecord> parse_output_record(std::span<const std::uint8_t> bytes) {
  const std::optional<Json> json = parsed(bytes, kOutputSchema);
  if (!json) return std::nullopt;
  OutputRecord record{{},
                      text_at(*json, "options"),
                      text_at(*json, "algorithm"),
                      text_at(*json, "format"),
                      text_at(*json, "object"),
                      stamp_at(*json, "stamp")};
  const auto inputs = json->find("inputs");
  if (inputs == json->end() || !inputs->is_array() || inputs->empty()) return std::nullopt;
  for (const Json& input : *inputs) {
    if (!input.is_object()) return std::nullopt;
    record.inputs.push_back({text_at(input, "name"), text_at(input, "hash"), stamp_at(input, "stamp")});
  }
  return record;
}

std::string output_key(const fs::path& output) {
  std::error_code code;
  return content_hash(bytes_of(fs::absolute(output, code).lexically_normal().native()));
}

/// Different in every process of every machine that shares a folder, and in every call.
std::string temporary_name() {
  static std::atomic<unsigned> counter{0};
  std::array<char, 64> host{};
  ::gethostname(host.data(), host.size() - 1);
  return fmt::format("{}{}-{}-{}.tmp", kTemporaryPrefix, host.data(), ::getpid(), counter++);
}

/// Replaces a file of the cache: written beside it, then renamed. Other machines may do the same; gc removes
/// by its age what a killed one leaves. Not synced: what a crash tears, its hash or schema shows.
Outcome replace_file(const fs::path& path, std::span<const std::uint8_t> bytes) {
  const auto failed = [&](int code) {
    return Error{Status::kFileUnwritable, fmt::format("{}: {}", path.string(), std::strerror(code)),
                 "check the folder, its permissions and the free space"};
  };
  const fs::path temporary = path.parent_path() / temporary_name();
  const int fd = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (fd < 0) return failed(errno);
  int problem = write_all(fd, bytes);
  if (::close(fd) != 0 && problem == 0) problem = errno;  // some file systems report a failed write only here
  if (problem == 0 && ::rename(temporary.c_str(), path.c_str()) != 0) problem = errno;
  if (problem == 0) return Done{};
  ::unlink(temporary.c_str());
  return failed(problem);
}

}  // namespace

std::optional<CacheResult> parse_result(std::span<const std::uint8_t> bytes) {
  const std::optional<Json> json = parsed(bytes, kResultSchema);
  if (!json) return std::nullopt;
  CacheResult result;
  if (const auto names = json->find("side_files"); names != json->end() && names->is_array())
    for (const Json& name : *names)
      if (name.is_string()) result.side_files.push_back(name.get<std::string>());
  result.object = text_at(*json, "object");
  if (result.side_files.empty() != is_content_hash(result.object)) return std::nullopt;
  if (const auto record = json->find("record"); record != json->end() && record->is_object())
    result.record_json = record->dump();
  return result;
}

std::optional<CacheResult> CacheStore::result(const std::string& key) const {
  const fs::path path = sharded(results(), key);
  const Result<std::vector<std::uint8_t>> bytes = read_file(path, kLargestText);
  if (!bytes) return std::nullopt;
  std::optional<CacheResult> result = parse_result(bytes.value());
  if (!result) ::unlink(path.c_str());
  return result;
}

std::optional<std::vector<std::uint8_t>> CacheStore::object(const std::string& hash) const {
  const fs::path path = sharded(objects(), hash);
  Result<std::vector<std::uint8_t>> bytes = read_file(path, kLargestObject);
  if (!bytes) return std::nullopt;
  if (content_hash(bytes.value()) == hash) return std::move(bytes).value();
  ::unlink(path.c_str());
  return std::nullopt;
}

std::optional<OutputRecord> CacheStore::output_record(const fs::path& output) const {
  const Result<std::vector<std::uint8_t>> bytes =
      read_file(sharded(outputs(), output_key(output)), kLargestText);
  return bytes ? parse_output_record(bytes.value()) : std::nullopt;
}

Outcome CacheStore::put(const fs::path& path, std::span<const std::uint8_t> bytes) const {
  std::error_code code;
  const bool is_new = !fs::exists(folder_, code);
  fs::create_directories(path.parent_path(), code);
  if (code)
    return Error{Status::kFileUnwritable, fmt::format("{}: {}", path.parent_path().string(), code.message()),
                 "name a cache folder that can be written, or bake without (--no-cache)"};
  if (is_new)
    if (Outcome tagged = replace_file(folder_ / "CACHEDIR.TAG", bytes_of(kTag)); !tagged) return tagged;
  return replace_file(path, bytes);
}

Outcome CacheStore::put_result(const std::string& key, const CacheResult& result) const {
  Json json{{"schema", kResultSchema}};
  if (result.side_files.empty()) {
    json["object"] = result.object;
    json["record"] = Json::parse(result.record_json, nullptr, false);
  } else {
    json["side_files"] = result.side_files;
  }
  return put(sharded(results(), key), bytes_of(text_of(json)));
}

Outcome CacheStore::put_object(const std::string& hash, std::span<const std::uint8_t> bytes) const {
  const fs::path path = sharded(objects(), hash);
  if (const auto stamp = stamp_of(path); stamp && stamp->size == bytes.size())
    if (object(hash)) return Done{};
  return put(path, bytes);
}

Outcome CacheStore::put_output_record(const fs::path& output, const OutputRecord& record) const {
  std::error_code code;
  Json json{
      {"schema", kOutputSchema},       {"output", fs::absolute(output, code).lexically_normal().string()},
      {"inputs", Json::array()},       {"options", record.options_json},
      {"algorithm", record.algorithm}, {"format", record.format},
      {"object", record.object},       {"stamp", stamp_json(record.bundle_stamp)}};
  for (const BakeInput& input : record.inputs)
    json["inputs"].push_back(
        {{"name", input.name}, {"hash", input.hash}, {"stamp", stamp_json(input.stamp)}});
  return put(sharded(outputs(), output_key(output)), bytes_of(text_of(json)));
}

void CacheStore::mark_used(const std::string& key) const {
  const fs::path path = sharded(results(), key);
  const std::optional<FileStamp> stamp = stamp_of(path);
  if (stamp && now_ns() - stamp->mtime_ns > kMarkInterval_ns)
    std::ignore = ::utimensat(AT_FDCWD, path.c_str(), nullptr, 0);
}

}  // namespace sqmap::apps
