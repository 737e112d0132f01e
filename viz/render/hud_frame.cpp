#include "viz/render/hud_frame.h"

#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_vulkan.h>
#include <imgui.h>

#include <algorithm>
#include <initializer_list>

#include "engine/gpu/commands.h"
#include "engine/gpu/context.h"
#include "palpate/error.h"
#include "viz/look/measures.h"
#include "viz/look/theme.h"
#include "viz/render/drawing.h"

namespace palpate::viz {
namespace {

void check_imgui(VkResult result) {
  gpu::check(result, "drawing the display");
}

void set_style(float scale) {
  ImGuiStyle& style = ImGui::GetStyle();
  style.WindowRounding = kGrid_px;
  style.FrameRounding = kGrid_px / 2;
  style.GrabRounding = kGrid_px / 2;
  style.WindowBorderSize = 0;
  style.WindowPadding = {1.5f * kGrid_px, kGrid_px};
  style.ItemSpacing = {kGrid_px, kGrid_px / 2};
  style.CellPadding = {kGrid_px / 2, kGrid_px / 4};
  style.ScaleAllSizes(scale);
}

void set_colours(const Theme& t) {
  ImVec4* colours = ImGui::GetStyle().Colors;
  const auto set = [colours](Rgb colour, std::initializer_list<ImGuiCol_> of, float alpha = 1) {
    for (const ImGuiCol_ one : of) colours[one] = tint(colour, alpha);
  };
  set(t.text, {ImGuiCol_Text});
  set(t.faint, {ImGuiCol_TextDisabled, ImGuiCol_ScrollbarGrabHovered, ImGuiCol_ScrollbarGrabActive});
  set(t.panel, {ImGuiCol_WindowBg, ImGuiCol_PopupBg, ImGuiCol_TitleBg, ImGuiCol_TitleBgCollapsed});
  set(t.panel, {ImGuiCol_ChildBg, ImGuiCol_ScrollbarBg}, 0);
  set(t.field, {ImGuiCol_TitleBgActive, ImGuiCol_FrameBg, ImGuiCol_Button, ImGuiCol_Tab});
  set(t.frame, {ImGuiCol_Border, ImGuiCol_Separator, ImGuiCol_ScrollbarGrab});
  set(t.picked, {ImGuiCol_FrameBgHovered, ImGuiCol_FrameBgActive, ImGuiCol_ButtonHovered,
                 ImGuiCol_ButtonActive, ImGuiCol_Header, ImGuiCol_HeaderActive, ImGuiCol_TextSelectedBg});
  set(t.field, {ImGuiCol_HeaderHovered});
  // Numbers stand over what is dragged.
  set(t.picked, {ImGuiCol_SliderGrab, ImGuiCol_SliderGrabActive});
  set(t.chosen, {ImGuiCol_CheckMark, ImGuiCol_NavHighlight});
}

void put_pictures(ImFontAtlas& atlas, std::span<const RgbImage> pictures, const std::vector<int>& places) {
  unsigned char* texels = nullptr;
  int width = 0, height = 0;
  atlas.GetTexDataAsRGBA32(&texels, &width, &height);
  for (size_t i = 0; i < pictures.size(); ++i) {
    const ImFontAtlasCustomRect& rect = *atlas.GetCustomRectByIndex(places[i]);
    for (uint32_t y = 0; y < pictures[i].height; ++y)
      for (uint32_t x = 0; x < pictures[i].width; ++x) {
        unsigned char* to = texels + 4 * (static_cast<size_t>(rect.Y + y) * width + rect.X + x);
        std::copy_n(pictures[i].at(x, y), 3, to);
        to[3] = 255;
      }
  }
}

}  // namespace

HudFrame::HudFrame(gpu::Context& context, const RenderPass& pass, uint32_t frames_in_flight,
                   GLFWwindow* window, float scale, std::span<const RgbImage> pictures)
    : context_(context), window_(window), scale_(scale) {
  IMGUI_CHECKVERSION();
  imgui_ = ImGui::CreateContext();
  ImGui::SetCurrentContext(imgui_);
  ImGuiIO& io = ImGui::GetIO();
  io.IniFilename = nullptr;  // nothing is written to the user's folder
  io.LogFilename = nullptr;
  set_style(scale);
  fonts_ = add_fonts(*io.Fonts, scale);
  // Pictures lie in the texture of the letters: one texture, one descriptor, one upload.
  for (const RgbImage& picture : pictures)
    if (picture.width > 400) io.Fonts->TexDesiredWidth = 2048;  // wider than letters alone need
  for (const RgbImage& picture : pictures)
    pictures_.push_back(
        io.Fonts->AddCustomRectRegular(static_cast<int>(picture.width), static_cast<int>(picture.height)));
  io.Fonts->Build();
  make_figures_tabular(*io.Fonts);
  if (!pictures.empty()) put_pictures(*io.Fonts, pictures, pictures_);

  const VkDescriptorPoolSize size{VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, 1};
  VkDescriptorPoolCreateInfo pool{};
  pool.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO;
  pool.maxSets = 1;
  pool.poolSizeCount = 1;
  pool.pPoolSizes = &size;
  gpu::check(vkCreateDescriptorPool(context.device(), &pool, nullptr, &pool_), "the display's descriptors");

  if (window) ImGui_ImplGlfw_InitForVulkan(window, true);
  ImGui_ImplVulkan_InitInfo info{};
  info.Instance = context.instance();
  info.PhysicalDevice = context.physical_device();
  info.Device = context.device();
  info.QueueFamily = context.queue_family();
  info.Queue = context.queue();
  info.PipelineCache = context.pipeline_cache();
  info.DescriptorPool = pool_;
  // The backend keeps one set of vertex buffers for each; it wants two at least.
  info.MinImageCount = frames_in_flight < 2 ? 2 : frames_in_flight;
  info.ImageCount = info.MinImageCount;
  info.MSAASamples = pass.samples();
  info.CheckVkResultFn = check_imgui;
  ImGui_ImplVulkan_Init(&info, pass.handle());

  gpu::Commands commands(context);
  commands.begin();
  ImGui_ImplVulkan_CreateFontsTexture(commands.handle());
  commands.end();
  commands.submit();
  commands.wait();
  ImGui_ImplVulkan_DestroyFontUploadObjects();
}

HudFrame::~HudFrame() {
  context_.wait_idle();
  ImGui::SetCurrentContext(context_.hung() ? nullptr : imgui_);
  if (context_.hung()) return;
  ImGui_ImplVulkan_Shutdown();
  if (window_) ImGui_ImplGlfw_Shutdown();
  ImGui::DestroyContext(imgui_);
  vkDestroyDescriptorPool(context_.device(), pool_, nullptr);
}

void HudFrame::begin(VkExtent2D extent) {
  ImGui::SetCurrentContext(imgui_);
  ImGui_ImplVulkan_NewFrame();
  set_colours(theme());
  ImGuiIO& io = ImGui::GetIO();
  if (window_) {
    ImGui_ImplGlfw_NewFrame();
  } else {
    io.DeltaTime = 1.0f / 60;
  }
  // The swapchain's size, which may lag behind the window's for a picture.
  io.DisplaySize = {static_cast<float>(extent.width), static_cast<float>(extent.height)};
  io.DisplayFramebufferScale = {1, 1};
  ImGui::NewFrame();
}

void HudFrame::draw_picture(size_t index, std::array<float, 2> low, std::array<float, 2> high) const {
  if (index >= pictures_.size()) return;
  const ImFontAtlas& atlas = *ImGui::GetIO().Fonts;
  const ImFontAtlasCustomRect& rect = *const_cast<ImFontAtlas&>(atlas).GetCustomRectByIndex(pictures_[index]);
  ImVec2 from, to;
  atlas.CalcCustomRectUV(&rect, &from, &to);
  ImGui::GetWindowDrawList()->AddImage(atlas.TexID, {low[0], low[1]}, {high[0], high[1]}, from, to);
}

void HudFrame::abandon() {
  ImGui::EndFrame();
}

void HudFrame::draw(VkCommandBuffer cmd) {
  ImGui::Render();
  ImGui_ImplVulkan_RenderDrawData(ImGui::GetDrawData(), cmd);
}

}  // namespace palpate::viz
