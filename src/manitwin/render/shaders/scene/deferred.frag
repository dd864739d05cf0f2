#version 450
// Surfaces under directional lights and soft surroundings. The first light shines straight down and has no colour: its
// shadow map is a map of heights, which says how much of the sky a point sees. The second one may throw shadows. Maps are
// named by constants: lavapipe is much slower where an index is computed.
//
// The buffers have two samples a pixel each way, and the picture is the upper left quarter of what is drawn here. A pixel
// whose four samples lie on one smooth surface is lit once, others at each sample. This is told by how often a loop runs:
// lavapipe goes through both ways of a condition, and through a loop as often as one of its eight pixels needs it.


// SAPIEN sets these by their names, and wants all of them
layout(constant_id = 0) const int NUM_DIRECTIONAL_LIGHTS = 3;
layout(constant_id = 1) const int NUM_DIRECTIONAL_LIGHT_SHADOWS = 2;
layout(constant_id = 2) const int NUM_POINT_LIGHTS = 0;
layout(constant_id = 3) const int NUM_POINT_LIGHT_SHADOWS = 0;
layout(constant_id = 4) const int NUM_SPOT_LIGHTS = 0;
layout(constant_id = 5) const int NUM_SPOT_LIGHT_SHADOWS = 0;
layout(constant_id = 6) const int NUM_TEXTURED_LIGHT_SHADOWS = 0;

layout(set = 1, binding = 0) uniform CameraBuffer {
  mat4 viewMatrix;
  mat4 projectionMatrix;
  mat4 viewMatrixInverse;
  mat4 projectionMatrixInverse;
  float width;
  float height;
} cameraBuffer;

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

layout(set = 0, binding = 0) uniform SceneBuffer {
  vec4 ambientLight;
  DirectionalLight directionalLights[6];
  PointLight pointLights[10];
  SpotLight spotLights[10];
  SpotLight texturedLights[1];
} sceneBuffer;

struct LightBuffer {
  mat4 viewMatrix;
  mat4 viewMatrixInverse;
  mat4 projectionMatrix;
  mat4 projectionMatrixInverse;
  int width;
  int height;
};

layout(set = 0, binding = 1) uniform ShadowBuffer {
  LightBuffer pointLightBuffers[60];
  LightBuffer directionalLightBuffers[6];
  LightBuffer spotLightBuffers[10];
  LightBuffer texturedLightBuffers[1];
} shadowBuffer;

layout(set = 0, binding = 2) uniform samplerCube samplerPointLightDepths[10];
layout(set = 0, binding = 3) uniform sampler2D samplerDirectionalLightDepths[6];
layout(set = 0, binding = 4) uniform sampler2D samplerSpotLightDepths[10];
layout(set = 0, binding = 5) uniform sampler2D samplerTexturedLightDepths[1];
layout(set = 0, binding = 6) uniform sampler2D samplerTexturedLightTextures[1];

layout(set = 2, binding = 0) uniform sampler2D samplerAlbedo;
layout(set = 2, binding = 1) uniform sampler2D samplerNormal;
layout(set = 2, binding = 2) uniform sampler2D samplerGbufferDepth;

layout(location = 0) out vec4 outColor;

const float PI = 3.14159265;
const float FADE_FROM = 1.6, FADE_TO = 4.5;  // metres from the z axis: where a floor that fades does so

const float LIGHT_WIDTH = 0.15;     // added to the width of highlights: lamps are no points (Karis 2013, area lights)
const float SHADOW_RADIUS = 0.009;  // metres: half the width of a shadow's soft edge
const float SHADOW_BIAS = 0.0012;   // metres along the light
const float STEEPEST = 4;           // tangent of the angle at which a surface's own plane is followed no further
const float SKY_RADIUS = 0.085;     // metres around a point in which it looks for what hides the sky
const float SKY_BIAS = 0.006;       // metres: more than one texel of the map of heights is wide
const float SKY_REACH = 0.16;       // metres above it from which on things hide less of the sky

const float SMOOTH = 0.97;       // cosine between normals of a pixel's samples, up to which they are one surface's
const float STEP = 1.5;          // of the depths of a plane's samples: so much farther apart they still are one surface's
const float FLATTEST = 0.02;     // cosine between a plane and the view below which its depths may differ no more

// Where a pixel looks around it, in radii: three ways for shadows, six for the sky, each time at four texels. The samples of a
// pixel turn them, so that it has four times as many. Of the six three look at a wall that is parallel to an axis, all four alike.
const vec2 TRIANGLE[3] = vec2[](vec2(0.62, 0), vec2(-0.31, 0.5369), vec2(-0.31, -0.5369));
const vec2 HEXAGON[6] = vec2[](vec2(0.3671, 0.0984), vec2(0.2122, 0.7921), vec2(-0.4101, 0.4101),
                               vec2(-0.9176, -0.2459), vec2(-0.1242, -0.4636), vec2(0.5091, -0.5091));
const vec2 TURNS[4] = vec2[](vec2(1, 0), vec2(0.5, 0.8660), vec2(0.8660, 0.5), vec2(0, 1));

mat2 turned(int number) {
  vec2 turn = TURNS[number];
  return mat2(turn.x, turn.y, -turn.y, turn.x);
}

// The share of a light that arrives at p. Depths are compared with the surface's own plane at each texel, so that a plane
// never shades itself (Isidoro 2006, "Shadow Mapping: GPU-based Tips and Techniques", receiver plane depth bias). Where the
// first turn of the triangle finds all lit, or nothing, the others up to the last one are not asked.
float lightShare(sampler2D depths, mat4 view, mat4 proj, vec3 p, vec3 n, int turn, int last) {
  vec3 scale = vec3(proj[0][0], proj[1][1], proj[2][2]);
  vec3 at = (view * vec4(p, 1)).xyz * scale + proj[3].xyz;
  if (any(greaterThan(abs(at.xy), vec2(0.98))) || at.z > 1) return 1;
  vec3 facing = mat3(view) * n;
  vec2 slope = -facing.xy / (abs(facing.z) > 0.02 ? facing.z : 0.02);
  slope *= min(1, STEEPEST / max(length(slope), 1e-3));
  vec2 size = vec2(textureSize(depths, 0)), toTexel = 0.5 * size, perTexel = 2 / size;
  vec2 gradient = slope * scale.z / scale.xy, step2 = 0.5 * gradient * perTexel;
  vec4 corners = vec4(step2.y - step2.x, step2.x + step2.y, step2.x - step2.y, -step2.x - step2.y);  // as textureGather has them
  float radius = SHADOW_RADIUS * abs(scale.x), base = at.z - SHADOW_BIAS * abs(scale.z) - dot(gradient, at.xy);
  float lit = 0, asked = 0;
  for (; turn <= last && (asked == 0 || (lit > 0.001 && lit < asked - 0.001)); ++turn) {
    mat2 turning = turned(turn);
    for (int k = 0; k < 3; ++k) {
      vec2 there = (at.xy + radius * (turning * TRIANGLE[k]) + 1) * toTexel, part = fract(there - 0.5);
      vec4 planes = base + dot(gradient, (there - part + 0.5) * perTexel - 1) + corners;
      vec4 passes = step(planes, textureGather(depths, there / size));
      lit += mix(mix(passes.w, passes.z, part.x), mix(passes.x, passes.y, part.x), part.y);
    }
    asked += 3;
  }
  return lit / asked;
}

// The share of the sky that p sees past the heights around it: horizon-based, after Bavoil et al. 2008, with one sample a
// direction, between four texels. The map looks straight down on the scene.
float skyShare(sampler2D heights, mat4 view, mat4 proj, vec3 p, vec3 n, int turn) {
  p += n * (0.004 + 0.5 * SKY_RADIUS * length(n.xy));
  vec3 at = (view * vec4(p, 1)).xyz * vec3(proj[0][0], proj[1][1], proj[2][2]) + proj[3].xyz;
  if (any(greaterThan(abs(at.xy), vec2(0.9))) || at.z > 1) return 1;
  float radius = SKY_RADIUS * abs(proj[0][0]), toMetres = 1 / abs(proj[2][2]), hidden = 0;
  vec2 size = vec2(textureSize(heights, 0));
  mat2 turning = turned(turn);
  for (int k = 0; k < 6; ++k) {
    vec2 there = 0.5 * (at.xy + radius * (turning * HEXAGON[k]) + 1), part = fract(there * size - 0.5);
    vec4 above = max((at.z - textureGather(heights, there)) * toMetres - SKY_BIAS, 0);
    vec4 slope = above / (SKY_RADIUS * length(HEXAGON[k]) + 0.004);
    vec4 hides = slope * inversesqrt(1 + slope * slope) / (1 + above * above / (SKY_REACH * SKY_REACH));
    hidden += mix(mix(hides.w, hides.z, part.x), mix(hides.x, hides.y, part.x), part.y);
  }
  return 1 - hidden / 6;
}

// Diffuse and specular reflection of a directional light: Lambert, and GGX with Smith's masking as of Karis 2013, "Real
// Shading in Unreal Engine 4".
vec3 lit(vec3 toLight, vec3 n, vec3 v, float nv, vec3 diffuse, vec3 fresnel, float roughness) {
  vec3 h = normalize(toLight + v);
  float nl = clamp(dot(n, toLight), 0, 1), nh = clamp(dot(n, h), 0, 1), vh = clamp(dot(v, h), 0, 1);
  float alpha = min(roughness * roughness + LIGHT_WIDTH, 1), alpha2 = alpha * alpha;
  float k = (alpha + 2 * roughness + 1) / 8;
  float lobe = nh * nh * (alpha2 - 1) + 1;
  float masked = 4 * lobe * lobe * (nv * (1 - k) + k) * (nl * (1 - k) + k);
  vec3 mirrored = fresnel + (1 - fresnel) * exp2((-5.55473 * vh - 6.98316) * vh);
  return nl / PI * (diffuse + mirrored * alpha2 / max(masked, 1e-6));
}

// Radiance of the surroundings in a direction of height in [-1, 1], 1 on average over the upper half: darker below,
// brightest above. Spread over the half space it changes half as much.
float glow(float height, float spread) {
  return 0.82 + height * mix(0.36, 0.18, spread) - 0.25 * smoothstep(0.0, 0.6, -height) * (1 - spread);
}

// What a surface reflects of even surroundings: x times its fresnel colour plus y. A fit to SAPIEN's split-sum table
// (Karis 2013) in roughness and 1 - nv, off by 0.09 at most.
vec2 reflected(float roughness, float nv) {
  float f = 1 - nv, f4 = f * f * f * f, r = roughness;
  vec2 share = vec2(1 + r * r * (0.19 * f - 0.62) + f4 * (-0.74 + r * (-0.61 + r * 2.56)),
                    f4 * (0.73 + r * (-1.10 + r * 0.31)));
  return max(share, vec2(0));
}

// Linear up to 0.7, then bent so that white is approached and never passed.
vec3 exposed(vec3 x) {
  return mix(x, 1 - 0.3 * exp2((0.7 - x) * (1.442695 / 0.3)), step(vec3(0.7), x));
}

// Of the surface at a pixel of the buffers, and its roughness, below zero for a floor that fades with distance.
vec4 normalAt(ivec2 at) {
  return texelFetch(samplerNormal, at, 0) * 2 - 1;
}

vec3 inWorld(vec2 at, float depth) {
  vec4 inCamera = cameraBuffer.projectionMatrixInverse * vec4(at / textureSize(samplerGbufferDepth, 0) * 2 - 1, depth, 1);
  return (cameraBuffer.viewMatrixInverse * vec4(inCamera.xyz / inCamera.w, 1)).xyz;
}

// Along the viewing axis, metres.
float distanceOf(float depth) {
  return cameraBuffer.projectionMatrix[3][2] / (depth + cameraBuffer.projectionMatrix[2][2]);
}

// A surface as the buffers have it: the colour that it shows, gamma-encoded.
vec3 shown(vec3 position, vec3 n, vec3 albedo, float metallic, float roughness, int turn, int last) {
  vec3 v = normalize(cameraBuffer.viewMatrixInverse[3].xyz - position);
  float nv = clamp(dot(n, v), 1e-6, 1);
  vec3 diffuse = albedo * (1 - metallic), fresnel = mix(vec3(0.04), albedo, metallic);
  float sky = skyShare(samplerDirectionalLightDepths[0], shadowBuffer.directionalLightBuffers[0].viewMatrix,
                       shadowBuffer.directionalLightBuffers[0].projectionMatrix, position, n, turn);
  vec2 share = reflected(roughness, nv);
  float mirroredHeight = 2 * dot(n, v) * n.z - v.z;
  vec3 color = glow(n.z, 1) * diffuse + glow(mirroredHeight, roughness) * (fresnel * share.x + share.y);
  color *= sceneBuffer.ambientLight.rgb * sky;
  for (int i = 1; i < NUM_DIRECTIONAL_LIGHTS; ++i) {
    vec3 toLight = -sceneBuffer.directionalLights[i].direction.xyz;
    if (dot(n, toLight) <= 0) continue;
    float arriving = 0.5 + 0.5 * sky;  // lights without a map of their own
    if (i == 1 && NUM_DIRECTIONAL_LIGHT_SHADOWS > 1) {
      arriving = lightShare(samplerDirectionalLightDepths[1], shadowBuffer.directionalLightBuffers[1].viewMatrix,
                            shadowBuffer.directionalLightBuffers[1].projectionMatrix, position, n, turn, last);
    }
    color += arriving * sceneBuffer.directionalLights[i].emission.rgb * lit(toLight, n, v, nv, diffuse, fresnel, roughness);
  }
  return pow(exposed(color), vec3(1 / 2.2));
}

void main() {
  ivec2 first = 2 * ivec2(gl_FragCoord.xy);
  vec4 depth = textureGather(samplerGbufferDepth, (vec2(first) + 1) / textureSize(samplerGbufferDepth, 0)).wzxy;
  vec4 a0 = texelFetch(samplerAlbedo, first, 0), a1 = texelFetch(samplerAlbedo, first + ivec2(1, 0), 0);
  vec4 a2 = texelFetch(samplerAlbedo, first + ivec2(0, 1), 0), a3 = texelFetch(samplerAlbedo, first + ivec2(1, 1), 0);
  vec4 n0 = normalAt(first), n1 = normalAt(first + ivec2(1, 0));
  vec4 n2 = normalAt(first + ivec2(0, 1)), n3 = normalAt(first + ivec2(1, 1));
  float middle = 0.25 * (depth.x + depth.y + depth.z + depth.w);
  vec3 center = inWorld(vec2(first) + 1, middle);

  vec4 away = vec4(distanceOf(depth.x), distanceOf(depth.y), distanceOf(depth.z), distanceOf(depth.w));
  float nearest = min(min(away.x, away.y), min(away.z, away.w)), farthest = max(max(away.x, away.y), max(away.z, away.w));
  float facing = abs(dot(n0.xyz, normalize(cameraBuffer.viewMatrixInverse[3].xyz - center)));
  float width = 4 * nearest / (abs(cameraBuffer.projectionMatrix[1][1]) * textureSize(samplerGbufferDepth, 0).y);
  bool even = min(min(dot(n0.xyz, n1.xyz), dot(n0.xyz, n2.xyz)), dot(n0.xyz, n3.xyz)) > SMOOTH &&
              farthest - nearest < STEP * width / max(facing, FLATTEST) && all(lessThan(depth, vec4(1)));
  int samples = even ? 1 : all(equal(depth, vec4(1))) ? 0 : 4;

  vec4 sum = vec4(0);
  for (int i = 0; i < samples; ++i) {
    float here = i == 0 ? depth.x : i == 1 ? depth.y : i == 2 ? depth.z : depth.w;
    vec4 stored = i == 0 ? a0 : i == 1 ? a1 : i == 2 ? a2 : a3, normal = i == 0 ? n0 : i == 1 ? n1 : i == 2 ? n2 : n3;
    vec3 albedo = stored.rgb * stored.rgb, position = even ? center : inWorld(vec2(first + ivec2(i & 1, i >> 1)) + 0.5, here);
    vec2 matter = vec2(stored.a, abs(normal.w));
    vec3 n = normal.xyz;
    if (even) {
      albedo = 0.25 * (albedo + a1.rgb * a1.rgb + a2.rgb * a2.rgb + a3.rgb * a3.rgb);
      matter = 0.25 * (matter + vec2(a1.a + a2.a + a3.a, abs(n1.w) + abs(n2.w) + abs(n3.w)));
      n += n1.xyz + n2.xyz + n3.xyz;
    }
    float there = here < 1 ? 1 : 0;
    if (normal.w < 0) there *= 1 - smoothstep(FADE_FROM, FADE_TO, length(position.xy));
    sum += vec4(shown(position, normalize(n), albedo, matter.x, matter.y, even ? 0 : i, even ? 1 : i), 1) * there;
  }
  outColor = sum / max(samples, 1);
}
