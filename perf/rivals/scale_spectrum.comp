// Divides a spectrum by the Laplacian's eigenvalues, between VkFFT's transforms.
#version 460

layout(local_size_x_id = 0, local_size_y_id = 1, local_size_z_id = 2) in;
layout(push_constant) uniform Push { uint count; };
layout(binding = 0) readonly buffer Scale { float scale[]; };
layout(binding = 1) buffer Spectrum { float spectrum[]; };

void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i < count) spectrum[i] *= scale[i];
}
