#include "core/image/file.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>

#include "tests/scene/temporary_folder.h"

namespace isochron {
namespace {

/// While it lives, writing more than `bytes` to a file fails, as on a full disk.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{bytes, before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FileSizeLimit() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;

 private:
  rlimit before_{};
  void (*handler_)(int);
};

TEST(WriteFileAtomically, WritesAndReplaces) {
  TemporaryFolder folder;
  const std::string contents("with\0zero\r\n", 11);
  write_file_atomically(folder.path("f"), contents);
  EXPECT_EQ(folder.read("f"), contents);
  write_file_atomically(folder.path("f"), "");
  EXPECT_EQ(folder.read("f"), "");
  const std::string large(5'000'001, 'x');
  write_file_atomically(folder.path("f"), large);
  EXPECT_EQ(folder.read("f"), large);
  EXPECT_EQ(folder.entries(), 1);
}

TEST(WriteFileAtomically, FailureLeavesTheOldFileAndNothingElse) {
  TemporaryFolder folder;
  folder.write("f", "old");
  std::string message;
  {
    const FileSizeLimit limit(4096);
    message = error_of([&] { write_file_atomically(folder.path("f"), std::string(10000, 'x')); });
  }
  EXPECT_EQ(message, folder.path("f") + ": cannot be written: File too large");
  EXPECT_EQ(folder.read("f"), "old");
  EXPECT_EQ(folder.entries(), 1);
}

TEST(WriteFileAtomically, NamesPathAndReason) {
  TemporaryFolder folder;
  EXPECT_EQ(error_of([&] { write_file_atomically(folder.path("none/f"), "x"); }),
            folder.path("none/f") + ": cannot be written: No such file or directory");
  std::filesystem::create_directory(folder.path("d"));
  EXPECT_EQ(error_of([&] { write_file_atomically(folder.path("d"), "x"); }),
            folder.path("d") + ": cannot be written: Is a directory");
  EXPECT_EQ(folder.entries(), 1);
}

}  // namespace
}  // namespace isochron
