#version 450
// What a camera sees, in numbers: the world normal, the distance along the viewing axis, and whose surface it is.

#include "../blocks.glsl"

layout(location = 0) in vec3 inPosition;
layout(location = 1) in vec3 inNormal;
layout(location = 2) in flat uint inEntity;

// Without a deferred pass SAPIEN blends by the fourth component: it is 1.
layout(location = 0) out vec4 outWorldNormal;
layout(location = 1) out vec4 outDistance;
layout(location = 2) out uvec4 outSegmentation;

void main() {
  outWorldNormal = vec4(normalize(inNormal), 1);
  outDistance = vec4(-inPosition.z, 0, 0, 1);
  outSegmentation = uvec4(inEntity, 0, 0, 0);
}
