#version 450
// Materials of what a camera sees. They are lit in deferred.frag, once a pixel: lavapipe shades blocks of pixels for every
// triangle, and things have as many triangles as pixels in a small picture.

#include "../blocks.glsl"

layout(location = 0) in vec3 inNormal;  // in the world's axes
layout(location = 1) in vec2 inUV;

layout(location = 0) out vec4 outAlbedo;  // square roots of it: 8 bits, finer in the dark; and metallic
layout(location = 1) out vec4 outNormal;  // and roughness, below zero for a floor that fades with distance; halved, and up by 0.5

const int COLOR_TEXTURE = 1, ROUGHNESS_TEXTURE = 2, METALLIC_TEXTURE = 8;  // bits of textureMask

void main() {
  int mask = materialBuffer.textureMask;
  vec4 color = vec4(sqrt(materialBuffer.baseColor.rgb), materialBuffer.roughness);
  if ((mask & COLOR_TEXTURE) != 0) {  // of square roots, and with roughness where the material says so
    vec4 texel = texture(colorTexture, inUV);
    color = vec4(texel.rgb, materialBuffer.emission.r > 0 ? texel.a : color.a);
  }
  if ((mask & ROUGHNESS_TEXTURE) != 0) color.a = texture(roughnessTexture, inUV).r;
  float metallic = (mask & METALLIC_TEXTURE) != 0 ? texture(metallicTexture, inUV).r : materialBuffer.metallic;
  outAlbedo = vec4(color.rgb, metallic);
  outNormal = 0.5 * vec4(normalize(inNormal), materialBuffer.emission.a > 0 ? -color.a : color.a) + 0.5;
}
