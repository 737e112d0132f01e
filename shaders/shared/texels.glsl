// Texel buffers, declared as TEXELS(binding, type, name) and read with texelFetch. With STORAGE_TEXELS the same bindings are
// storage buffers: for devices whose texel buffers are too small for a frame. The type is that of one texel: vec4, vec2, float,
// uvec4, uvec2 or uint; SMALL_TEXELS of one or two bytes are read with small_texel. Arrays of storage buffers are no arguments of functions, so what fetches from several is a macro.
#ifndef PALPATE_TEXELS_GLSL
#define PALPATE_TEXELS_GLSL

#ifdef STORAGE_TEXELS
#define TEXELS(slot, type, name) layout(std430, binding = slot) readonly buffer Texels_##name { type name[]; }
#define SMALL_TEXELS(slot, name) TEXELS(slot, uint, name)  // several to a word
#define texelFetch(name, at) whole_texel(name[at])
#define small_texel(name, at, bytes) (name[(at) * (bytes) >> 2] >> (8 * ((at) * (bytes) & 3)) & (1u << 8 * (bytes)) - 1u)
#define texel_count(name) uint(name.length())
vec4 whole_texel(vec4 v) { return v; }
vec4 whole_texel(vec2 v) { return vec4(v, 0.0, 1.0); }
vec4 whole_texel(float v) { return vec4(v, 0.0, 0.0, 1.0); }
uvec4 whole_texel(uvec4 v) { return v; }
uvec4 whole_texel(uvec2 v) { return uvec4(v, 0u, 1u); }
uvec4 whole_texel(uint v) { return uvec4(v, 0u, 0u, 1u); }
#else
#define TEXELS(slot, type, name) layout(binding = slot) uniform TEXELS_OF_##type name
#define SMALL_TEXELS(slot, name) TEXELS(slot, uint, name)
#define TEXELS_OF_vec4 samplerBuffer
#define TEXELS_OF_vec2 samplerBuffer
#define TEXELS_OF_float samplerBuffer
#define TEXELS_OF_uvec4 usamplerBuffer
#define TEXELS_OF_uvec2 usamplerBuffer
#define TEXELS_OF_uint usamplerBuffer
#define small_texel(name, at, bytes) texelFetch(name, at).x
#define texel_count(name) uint(textureSize(name))
#endif

#endif
