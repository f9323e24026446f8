#include "core/base/file.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>

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

TEST(WriteFileAtomically, KeepsLinksAndPermissions) {
  namespace fs = std::filesystem;
  TemporaryFolder folder;
  write_file_atomically(folder.path("f"), "old");
  constexpr fs::perms kOwn = fs::perms::owner_read | fs::perms::owner_write | fs::perms::owner_exec;
  fs::permissions(folder.path("f"), kOwn);
  for (const char* target : {"f", "later"}) {
    const std::string link = folder.path(std::string("link_to_") + target);
    fs::create_symlink(target, link);  // beside it, wherever the process is
    write_file_atomically(link, "new");
    EXPECT_TRUE(fs::is_symlink(link));
    EXPECT_EQ(folder.read(target), "new");
  }
  EXPECT_EQ(fs::status(folder.path("f")).permissions(), kOwn);
}

TEST(RemoveTemporaries, WhatAKilledProcessLeft) {
  TemporaryFolder folder;
  for (const char* name : {"f.tmp", "f.1-.tmp", "f-1.tmp", "f1-2.tmp", "f.1-2.tmp.txt", "-.tmp", ".tmp"})
    folder.write(name, "somebody else's");
  NewFile under_way(folder.path("g"));
  under_way.seek(0);  // opens it
  const pid_t child = ::fork();
  if (child == 0) {
    NewFile file(folder.path("f"));
    file.write(std::string(3'000'000, 'x'));
    ::_exit(0);
  }
  ::waitpid(child, nullptr, 0);
  EXPECT_EQ(folder.entries(), 9);
  remove_temporaries(folder.path("."));
  EXPECT_EQ(folder.entries(), 8);
  under_way.finish();
  EXPECT_EQ(folder.entries(), 8);
  remove_temporaries(folder.path("none"));
}

TEST(WriteFileAtomically, FailureLeavesTheOldFileAndNothingElse) {
  TemporaryFolder folder;
  folder.write("f", "old");
  std::string message;
  {
    const FileSizeLimit limit(4096);
    try {
      write_file_atomically(folder.path("f"), std::string(10000, 'x'));
    } catch (const InputError&) {
      FAIL() << "a full disk is no mistake in the input";
    } catch (const std::runtime_error& error) {
      message = error.what();
    }
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

TEST(NewFile, IsWrittenInPartsWholeOrNotAtAll) {
  TemporaryFolder folder;
  folder.write("f", "old");
  {
    NewFile file(folder.path("f"));
    file.write("??part ");
    EXPECT_EQ(folder.entries(), 1) << "what a killed process would leave";
    file.write(std::string(3'000'000, 'x'));
    EXPECT_EQ(file.position(), 3'000'007u);
    file.seek(0);
    file.write("a ");
    EXPECT_EQ(file.position(), 2u);
    file.seek(3'000'007);
    file.write("end");
    EXPECT_EQ(folder.read("f"), "old");
    file.finish();
  }
  EXPECT_EQ(folder.read("f"), "a part " + std::string(3'000'000, 'x') + "end");
  {
    NewFile file(folder.path("f"));
    file.write("never finished");
  }
  EXPECT_EQ(folder.read("f").size(), 3'000'010u);
  EXPECT_EQ(folder.entries(), 1);
}

// OpenEXR keeps to itself what goes wrong while it ends.
TEST(NewFile, FinishTellsOfEarlierFailures) {
  TemporaryFolder folder;
  std::string message;
  {
    const FileSizeLimit limit(4096);
    NewFile file(folder.path("f"));
    EXPECT_THROW(file.write(std::string(3'000'000, 'x')), std::runtime_error);
    try {
      file.finish();
    } catch (const std::runtime_error& error) {
      message = error.what();
    }
  }
  EXPECT_EQ(message, folder.path("f") + ": cannot be written: File too large");
  EXPECT_EQ(folder.entries(), 0);
}

TEST(ReadRegularFile, ReadsWholeFiles) {
  TemporaryFolder folder;
  const std::string large = std::string(300'000, 'x') + std::string("\0\n", 2);
  folder.write("f", large);
  folder.write("empty", "");
  std::string problem;
  EXPECT_EQ(read_regular_file(folder.path("f"), problem), large);
  EXPECT_EQ(read_regular_file(folder.path("empty"), problem), "");
  EXPECT_GT(read_regular_file("/proc/self/stat", problem).value_or("").size(), 0u);  // of no size beforehand
}

TEST(ReadRegularFile, NeverWaits) {
  TemporaryFolder folder;
  ASSERT_EQ(::mkfifo(folder.path("pipe").c_str(), 0600), 0);
  std::string problem;
  for (const std::string& file : {folder.path("pipe"), std::string("/dev/null")}) {
    EXPECT_FALSE(read_regular_file(file, problem));
    EXPECT_EQ(problem, "is a pipe or a device, not a regular file");
  }
  EXPECT_FALSE(read_regular_file(folder.path("."), problem));
  EXPECT_EQ(problem, "is a folder");
  EXPECT_FALSE(read_regular_file(folder.path("none"), problem));
  EXPECT_EQ(problem, "cannot be opened: No such file or directory");
}

TEST(Checksum, IsFnv1a) {
  // Values of the algorithm's authors.
  EXPECT_EQ(checksum(""), "cbf29ce484222325");
  EXPECT_EQ(checksum("a"), "af63dc4c8601ec8c");
  EXPECT_EQ(checksum("foobar"), "85944171f73967e8");
}

}  // namespace
}  // namespace isochron
