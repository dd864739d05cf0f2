#version 450
// One triangle that covers the upper left quarter of what is drawn: its long side goes through the corner or beyond.

void main() {
  gl_Position = vec4(gl_VertexIndex == 1 ? -4 : 0, gl_VertexIndex == 2 ? -4 : 0, 0, 1);
}
