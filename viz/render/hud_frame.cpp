#include "viz/render/hud_frame.h"

#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_vulkan.h>
#include <imgui.h>

#include <algorithm>
#include <filesystem>

#include "engine/gpu/commands.h"
#include "engine/gpu/context.h"
#include "palpate/error.h"

namespace palpate::viz {
namespace {

void check_imgui(VkResult result) {
  gpu::check(result, "drawing the display");
}

void set_style(float scale) {
  ImGui::StyleColorsDark();
  ImGuiStyle& style = ImGui::GetStyle();
  style.WindowRounding = 6;
  style.FrameRounding = 4;
  style.GrabRounding = 4;
  style.WindowBorderSize = 0;
  style.WindowPadding = {12, 10};
  style.ItemSpacing = {8, 5};
  style.CellPadding = {4, 2};
  style.Colors[ImGuiCol_WindowBg] = {0.075f, 0.082f, 0.098f, 0.94f};
  style.Colors[ImGuiCol_TitleBg] = {0.075f, 0.082f, 0.098f, 1};
  style.Colors[ImGuiCol_TitleBgActive] = {0.11f, 0.13f, 0.16f, 1};
  style.Colors[ImGuiCol_TitleBgCollapsed] = {0.075f, 0.082f, 0.098f, 0.8f};
  style.Colors[ImGuiCol_Text] = {0.90f, 0.92f, 0.94f, 1};
  style.Colors[ImGuiCol_TextDisabled] = {0.58f, 0.62f, 0.67f, 1};
  style.Colors[ImGuiCol_FrameBg] = {0.16f, 0.18f, 0.22f, 1};
  style.Colors[ImGuiCol_Separator] = {0.22f, 0.25f, 0.30f, 1};
  style.ScaleAllSizes(scale);
}

void put_pictures(ImFontAtlas& atlas, std::span<const RgbImage> pictures, const std::vector<int>& places) {
  atlas.Build();
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
#ifdef PALPATE_FONT
  if (std::filesystem::exists(PALPATE_FONT)) {
    static const ImWchar kRanges[] = {0x20, 0xFF, 0x2190, 0x2193, 0};
    body_ = io.Fonts->AddFontFromFileTTF(PALPATE_FONT, 14 * scale, nullptr, kRanges);
    large_ = io.Fonts->AddFontFromFileTTF(PALPATE_FONT, 30 * scale, nullptr, kRanges);
  }
#endif
  if (!body_ || !large_) {  // ImGui's own font: plain, but complete
    ImFontConfig config;
    config.SizePixels = 13 * scale;
    body_ = io.Fonts->AddFontDefault(&config);
    config.SizePixels = 26 * scale;
    large_ = io.Fonts->AddFontDefault(&config);
  }
  // Pictures lie in the texture of the letters: one texture, one descriptor, one upload.
  for (const RgbImage& picture : pictures)
    if (picture.width > 400) io.Fonts->TexDesiredWidth = 2048;  // wider than letters alone need
  for (const RgbImage& picture : pictures)
    pictures_.push_back(
        io.Fonts->AddCustomRectRegular(static_cast<int>(picture.width), static_cast<int>(picture.height)));
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
