// A window with its swapchain: resized, minimised and closed by the user.
#pragma once

#include <vulkan/vulkan.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "viz/render/render_target.h"
#include "viz/render/view_state.h"

struct GLFWwindow;

namespace palpate::viz {

struct WindowOptions {
  std::string title = "palpate";
  uint32_t width = 1280;
  uint32_t height = 720;
  Vsync vsync = Vsync::On;
};

/// A key (GLFW_KEY_...) as it was pressed.
struct KeyPress {
  int key = 0;
  bool shift = false;
  bool control = false;
  bool alt = false;
  bool operator==(const KeyPress&) const = default;
};

/// A picture that the device has finished.
struct Finished {
  uint64_t picture = 0;  ///< number that end_picture gave
  double draw_ms = 0;    ///< submission to fence, host clock
  std::chrono::steady_clock::time_point at;
};

/// Main thread only.
class Window {
 public:
  static constexpr uint32_t kPicturesInFlight = 2;

  /// The context must have been made with window_extensions() and presentation. Throws
  /// Error(Failure::Display) where no window can be opened, Error(Failure::Device) where the device cannot
  /// present to it.
  Window(gpu::Context& context, const WindowOptions& options);
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  /// Gives up all that is on the device; the window stays on the screen, without new pictures. Before
  /// Context::reopen, with attach after it. Pictures in flight are given up.
  void detach();
  void attach();

  GLFWwindow* handle() const { return window_; }
  const RenderPass& pass() const { return *pass_; }
  VkExtent2D extent() const { return extent_; }
  /// Scale of text and panels, from the screen's resolution.
  float scale() const;
  bool close_requested() const;
  bool minimised() const;

  /// Another way to meet the display's refresh; stays as it is where the display does not offer it.
  void set_vsync(Vsync vsync);
  bool offers(Vsync vsync) const;
  Vsync vsync() const { return vsync_; }
  /// Keys pressed since the last call; keys of letters by what is printed on them.
  std::vector<KeyPress> take_keys();
  /// Files and folders dropped on the window since the last call.
  std::vector<std::string> take_drops();
  bool has_drops() const { return !drops_.empty(); }
  void switch_full_screen();
  void set_title(const std::string& title);
  /// Size in the screen's own units, as WindowOptions has it; of the window before it filled the screen.
  std::pair<uint32_t, uint32_t> size() const;
  bool has_keys() const { return !keys_.empty(); }

  /// Pictures that poll_finished has not returned yet.
  uint32_t in_flight() const { return static_cast<uint32_t>(next_picture_ - oldest_unfinished_); }
  /// Acquires an image and starts recording; false when there is nothing to draw to now (minimised, being
  /// resized). Fewer than kPicturesInFlight may be in flight.
  bool begin_picture();
  VkCommandBuffer cmd() const;
  void begin_pass();
  /// Submits and presents; `capture` also copies the picture for captured(). Returns the picture's number.
  uint64_t end_picture(bool capture);
  /// The oldest unfinished picture, once the device has finished it. `wait`: for it.
  std::optional<Finished> poll_finished(bool wait);
  /// The picture copied by the last end_picture(true); waits for it.
  std::optional<RgbImage> captured();

 private:
  using Clock = std::chrono::steady_clock;
  struct Slot {
    VkCommandPool pool = VK_NULL_HANDLE;
    VkCommandBuffer cmd = VK_NULL_HANDLE;
    VkFence fence = VK_NULL_HANDLE;
    VkSemaphore acquired = VK_NULL_HANDLE;
    uint64_t picture = 0;
    bool pending = false;
    Clock::time_point submitted, drawn;
  };
  struct Target {
    VkImage image = VK_NULL_HANDLE;
    VkImageView view = VK_NULL_HANDLE;
    VkFramebuffer framebuffer = VK_NULL_HANDLE;
    VkSemaphore drawn = VK_NULL_HANDLE;
  };
  void create_slots();
  void create_swapchain();
  void destroy_targets();
  void copy_target(VkCommandBuffer cmd, VkImage image);
  Slot& slot() { return slots_[next_picture_ % kPicturesInFlight]; }

  gpu::Context& context_;
  GLFWwindow* window_ = nullptr;
  VkSurfaceKHR surface_ = VK_NULL_HANDLE;
  VkSurfaceFormatKHR format_{};
  std::unique_ptr<RenderPass> pass_;
  VkSwapchainKHR swapchain_ = VK_NULL_HANDLE;
  VkExtent2D extent_{};
  Vsync vsync_ = Vsync::On;
  std::vector<KeyPress> keys_;
  std::vector<std::string> drops_;
  std::array<int, 4> before_full_screen_{};  ///< place and size; width 0: not full screen
  bool stale_ = false;                       ///< the swapchain no longer fits the window
  bool can_copy_ = false;                    ///< its images may be read back
  Attachments attachments_;
  std::vector<Target> targets_;
  std::array<Slot, kPicturesInFlight> slots_{};
  uint32_t target_ = 0;  ///< acquired image
  uint64_t next_picture_ = 0;
  uint64_t oldest_unfinished_ = 0;
  gpu::DeviceBuffer readback_;
  VkExtent2D readback_extent_{};
  std::optional<uint64_t> captured_picture_;
};

}  // namespace palpate::viz
