#version 450

layout(set = 0, binding = 0) uniform CameraBuffer {
  mat4 viewMatrix;
  mat4 projectionMatrix;
  mat4 viewMatrixInverse;
  mat4 projectionMatrixInverse;
  float width;
  float height;
} cameraBuffer;

layout(set = 1, binding = 0) uniform ObjectTransformBuffer {
  mat4 modelMatrix;
} objectTransformBuffer;

layout(set = 1, binding = 1) uniform ObjectDataBuffer {
  uvec4 segmentation;
  float transparency;
  int shadeFlat;
} objectDataBuffer;

layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec2 uv;
layout(location = 3) in vec3 tangent;
layout(location = 4) in vec3 bitangent;

layout(location = 0) out vec3 outPosition;  // in the camera's axes: x right, y up, -z forward
layout(location = 1) out vec3 outNormal;    // in the world's
layout(location = 2) out flat uint outEntity;

void main() {
  vec4 inCamera = cameraBuffer.viewMatrix * (objectTransformBuffer.modelMatrix * vec4(position, 1));
  outPosition = inCamera.xyz;
  outNormal = mat3(objectTransformBuffer.modelMatrix) * normal;
  outEntity = objectDataBuffer.segmentation.y;
  gl_Position = cameraBuffer.projectionMatrix * inCamera;
}
