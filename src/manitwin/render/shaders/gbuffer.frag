#version 450
// A studio: a key and a fill light that hang on the camera, and soft surroundings, brightest above. What they throw on
// a surface is a formula here, no picture: SAPIEN's own shaders filter a cube map and integrate a table first, which
// takes 10 CPU-seconds on lavapipe.

layout(set = 0, binding = 0) uniform CameraBuffer {
  mat4 viewMatrix;
  mat4 projectionMatrix;
  mat4 viewMatrixInverse;
  mat4 projectionMatrixInverse;
  float width;
  float height;
} cameraBuffer;

layout(set = 2, binding = 0) uniform MaterialBuffer {
  vec4 emission;
  vec4 baseColor;
  float fresnel;
  float roughness;
  float metallic;
  float transmission;
  float ior;
  float transmissionRoughness;
  int textureMask;
  int padding1;
  vec4 textureTransforms[6];
} materialBuffer;

layout(set = 2, binding = 1) uniform sampler2D colorTexture;
layout(set = 2, binding = 2) uniform sampler2D roughnessTexture;
layout(set = 2, binding = 3) uniform sampler2D normalTexture;
layout(set = 2, binding = 4) uniform sampler2D metallicTexture;
layout(set = 2, binding = 5) uniform sampler2D emissionTexture;
layout(set = 2, binding = 6) uniform sampler2D transmissionTexture;

struct PointLight {
  vec4 position;
  vec4 emission;
};

struct DirectionalLight {
  vec4 direction;
  vec4 emission;
};

struct SpotLight {
  vec4 position;
  vec4 direction;
  vec4 emission;
};

layout(set = 3, binding = 0) uniform SceneBuffer {
  vec4 ambientLight;
  PointLight pointLights[10];
  DirectionalLight directionalLights[3];
  SpotLight spotLights[10];
  SpotLight texturedLights[1];
} sceneBuffer;

layout(location = 0) in vec3 inPosition;
layout(location = 1) in vec3 inNormal;
layout(location = 2) in vec2 inUV;

layout(location = 0) out vec4 outColor;

const float PI = 3.14159265;
const int COLOR_TEXTURE = 1, ROUGHNESS_TEXTURE = 2, METALLIC_TEXTURE = 8;  // bits of textureMask

// Towards the light in the camera's axes, and irradiance. White paper that faces the camera gets 0.9 of what the
// picture can show, paper that faces the key light all of it.
const vec3 KEY = normalize(vec3(-0.55, 0.75, 0.75)), FILL = normalize(vec3(0.9, 0.1, 0.75));
const float KEY_IRRADIANCE = 1.8, FILL_IRRADIANCE = 0.8, AMBIENT = 0.18;
const float SKY = 0.30, HORIZON = 0.18, GROUND = 0.10;  // linear radiance of the surroundings

// Diffuse and specular reflection of a directional light: Lambert, and GGX with Smith's masking as of Karis 2013, "Real
// Shading in Unreal Engine 4".
vec3 lit(vec3 toLight, float irradiance, vec3 n, vec3 v, float nv, vec3 diffuse, vec3 fresnel, float roughness) {
  vec3 h = normalize(toLight + v);
  float nl = clamp(dot(n, toLight), 0, 1), nh = clamp(dot(n, h), 0, 1), vh = clamp(dot(v, h), 0, 1);
  float alpha = roughness * roughness, alpha2 = alpha * alpha;
  float k = (alpha + 2 * roughness + 1) / 8;
  float lobe = nh * nh * (alpha2 - 1) + 1;
  float masked = 4 * lobe * lobe * (nv * (1 - k) + k) * (nl * (1 - k) + k);
  vec3 mirrored = fresnel + (1 - fresnel) * exp2((-5.55473 * vh - 6.98316) * vh);
  return irradiance * nl / PI * (diffuse + mirrored * alpha2 / max(masked, 1e-6));
}

// Radiance that arrives around a height in [-1, 1] (1: straight up), averaged over the half space. A fit to SAPIEN's
// own filter of a cube map of such surroundings: 0.002 off (standard deviation), 0.013 at the cube's corners.
float softGlow(float height) {
  return 0.1984 + height * (0.0688 + height * (-0.0112 - height * 0.0063));
}

float glow(float height) {
  return HORIZON + height * (height > 0 ? SKY - HORIZON : HORIZON - GROUND);
}

// What a surface reflects of even surroundings: x times its fresnel colour plus y. A fit to SAPIEN's split-sum table
// (Karis 2013) in roughness and 1 - nv, off by 0.09 at most.
vec2 reflected(float roughness, float nv) {
  float f = 1 - nv, f4 = f * f * f * f, r = roughness;
  vec2 share = vec2(1 + r * r * (0.19 * f - 0.62) + f4 * (-0.74 + r * (-0.61 + r * 2.56)),
                    f4 * (0.73 + r * (-1.10 + r * 0.31)));
  return max(share, vec2(0));
}

void main() {
  int mask = materialBuffer.textureMask;
  vec3 albedo = (mask & COLOR_TEXTURE) != 0 ? texture(colorTexture, inUV).rgb : materialBuffer.baseColor.rgb;
  float roughness = (mask & ROUGHNESS_TEXTURE) != 0 ? texture(roughnessTexture, inUV).r : materialBuffer.roughness;
  float metallic = (mask & METALLIC_TEXTURE) != 0 ? texture(metallicTexture, inUV).r : materialBuffer.metallic;

  vec3 n = normalize(inNormal), v = -normalize(inPosition);
  float nv = clamp(dot(n, v), 1e-6, 1);
  vec3 diffuse = albedo * (1 - metallic);
  vec3 fresnel = materialBuffer.fresnel * 0.08 * (1 - metallic) + albedo * metallic;

  vec3 up = vec3(cameraBuffer.viewMatrix[2]);  // the scene's z axis in the camera's axes
  float height = dot(up, n), mirroredHeight = dot(up, 2 * dot(n, v) * n - v);
  vec2 share = reflected(roughness, nv);

  vec3 color = AMBIENT * albedo + softGlow(height) * diffuse;
  color += mix(glow(mirroredHeight), softGlow(mirroredHeight), roughness) * (fresnel * share.x + share.y);
  color += lit(KEY, KEY_IRRADIANCE, n, v, nv, diffuse, fresnel, roughness);
  color += lit(FILL, FILL_IRRADIANCE, n, v, nv, diffuse, fresnel, roughness);
  outColor = vec4(pow(min(color, vec3(1)), vec3(1 / 2.2)), 1);
}
