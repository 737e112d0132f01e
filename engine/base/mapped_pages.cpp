#include "engine/base/mapped_pages.h"

#include <unistd.h>

#include <utility>

namespace palpate {
namespace {

// To the end of the last page that is touched.
size_t whole_pages(const uint8_t* begin, size_t bytes) {
  const auto page = static_cast<uintptr_t>(sysconf(_SC_PAGESIZE));
  const auto first = reinterpret_cast<uintptr_t>(begin);
  return (first + bytes + page - 1) / page * page - first;
}

}  // namespace

MappedPages::MappedPages(const uint8_t* begin, size_t bytes, std::function<void()> unmap)
    : begin_(begin), bytes_(whole_pages(begin, bytes)), unmap_(std::move(unmap)) {}

MappedPages::~MappedPages() {
  for (const std::weak_ptr<PageUser>& user : users_)
    if (const auto still = user.lock()) still->let_go();
  if (unmap_) unmap_();
}

void MappedPages::add_user(const std::weak_ptr<PageUser>& user) {
  const std::lock_guard lock(mutex_);
  std::erase_if(users_, [](const std::weak_ptr<PageUser>& other) { return other.expired(); });
  users_.push_back(user);
}

}  // namespace palpate
