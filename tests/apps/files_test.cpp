// SPDX-License-Identifier: Apache-2.0
#include "../../apps/common/files.hpp"

#include <csignal>
#include <filesystem>
#include <fstream>
#include <set>
#include <string>
#include <vector>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

namespace sqmap::apps {
namespace {

namespace fs = std::filesystem;

constexpr rlim_t kLargestFile_bytes = 1000;

class AbandonedFiles : public testing::Test {
 protected:
  AbandonedFiles() {
    std::string pattern = (fs::temp_directory_path() / "sqmap-XXXXXX").string();
    folder_ = ::mkdtemp(pattern.data());
  }
  ~AbandonedFiles() override { fs::remove_all(folder_); }

  std::set<std::string> names() const {
    std::set<std::string> found;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder_))
      found.insert(entry.path().filename().string());
    return found;
  }

  /// A process that the system kills in the middle of its write, for the size of the file.
  void write_and_die(const fs::path& path) const {
    const pid_t child = ::fork();
    if (child == 0) {
      const rlimit none{0, 0}, limit{kLargestFile_bytes, kLargestFile_bytes};
      ::setrlimit(RLIMIT_CORE, &none);
      ::setrlimit(RLIMIT_FSIZE, &limit);
      ::signal(SIGXFSZ, SIG_DFL);
      const Outcome written = write_file(path, std::string(5 * kLargestFile_bytes, 'x'));
      ::_exit(written ? 0 : 1);
    }
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == SIGXFSZ) << status;
  }

  fs::path folder_;
};

TEST_F(AbandonedFiles, OfAKilledWriterAreRemovedAndNothingElseIs) {
  const fs::path target = folder_ / "a.h5";
  ASSERT_TRUE(write_file(target, "earlier"));
  const std::set<std::string> others{"a.h5", ".sqmap-notes.tmp", ".sqmap-abcdefg.tmp", "x.sqmap-abcdef.tmp"};
  for (const std::string& name : others) std::ofstream(folder_ / name) << "earlier";
  write_and_die(target);
  ASSERT_EQ(names().size(), others.size() + 1) << "the kill left a file";
  remove_abandoned(std::vector{target});
  EXPECT_EQ(names(), others);
  EXPECT_EQ(fs::file_size(target), 7U);
}

TEST_F(AbandonedFiles, AreSoughtWhereALinkLeads) {
  fs::create_directory(folder_ / "there");
  ASSERT_TRUE(write_file(folder_ / "there" / "a.h5", "earlier"));
  fs::create_symlink("there/a.h5", folder_ / "link.h5");
  write_and_die(folder_ / "link.h5");
  const auto count = [&] {
    return std::distance(fs::directory_iterator(folder_ / "there"), fs::directory_iterator());
  };
  ASSERT_EQ(count(), 2);
  remove_abandoned(std::vector{folder_ / "link.h5"});
  EXPECT_EQ(count(), 1);
}

TEST_F(AbandonedFiles, OfALivingWriterStay) {
  const fs::path held = folder_ / ".sqmap-abcdef.tmp";
  const int fd = ::open(held.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
  ASSERT_EQ(::flock(fd, LOCK_EX), 0);
  remove_abandoned(std::vector{folder_ / "a.h5"});
  EXPECT_TRUE(fs::exists(held));
  ::close(fd);
  remove_abandoned(std::vector{folder_ / "a.h5"});
  EXPECT_FALSE(fs::exists(held));
}

// While one process writes a file again and again, another takes what it finds for abandoned: no write may
// fail.
TEST_F(AbandonedFiles, AreNeverThoseOfAWriteUnderWay) {
  const fs::path target = folder_ / "a.h5";
  const pid_t cleaner = ::fork();
  if (cleaner == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    for (;;) remove_abandoned(std::vector{target});
  }
  int failed = 0;
  for (int k = 0; k < 300; ++k) failed += write_file(target, std::to_string(k)) ? 0 : 1;
  ::kill(cleaner, SIGKILL);
  ::waitpid(cleaner, nullptr, 0);
  EXPECT_EQ(failed, 0);
  EXPECT_EQ(names(), std::set<std::string>{"a.h5"});
}

}  // namespace
}  // namespace sqmap::apps
