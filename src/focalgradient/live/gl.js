"use strict";
/* What every drawing in WebGL 2 needs: the windows of a focus series, the cube, and the paper's figures live. */

/* A canvas's WebGL 2, without alpha, so that the page's background does not show through. */
export function webgl(canvas) {
  const gl = canvas.getContext("webgl2", { alpha: false, antialias: false, depth: false, preserveDrawingBuffer: true });
  if (!gl) throw new Error("it has no WebGL 2");
  return gl;
}

/* Vertex shader of a rectangle: `where` is 0, 0 at the top left of the picture. */
export const CORNERS = `#version 300 es
in vec2 corner;
out vec2 where;
void main() {
    gl_Position = vec4(corner, 0.0, 1.0);
    where = vec2(0.5, -0.5) * corner + 0.5;
}
`;

/* GLSL function that encodes linear light from 0 to 1 as sRGB. */
export const SRGB = `
vec3 srgb(vec3 light) {
    return mix(12.92 * light, 1.055 * pow(light, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, light));
}
`;

/* Compile and link two shaders; the rectangle's corners are attribute 0. */
export function program(gl, pixel, vertex = CORNERS) {
  const made = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, pixel]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(made, shader);
  }
  gl.bindAttribLocation(made, 0, "corner");
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
  return made;
}

/* Send the corners of a rectangle as attribute 0; return their buffer. */
export function rectangle(gl, [left, bottom, right, top] = [-1, -1, 1, 1]) {
  const buffer = gl.createBuffer();
  gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
  gl.bufferData(gl.ARRAY_BUFFER, new Float32Array([left, bottom, right, bottom, left, top, right, top]), gl.STATIC_DRAW);
  gl.enableVertexAttribArray(0);
  gl.vertexAttribPointer(0, 2, gl.FLOAT, false, 0, 0);
  return buffer;
}

/* Set how the bound texture is sampled; beyond its edge, its edge. */
export function sample(gl, target, how = gl.NEAREST) {
  for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(target, name, how);
  for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(target, name, gl.CLAMP_TO_EDGE);
}

/* A texture of this size that can be drawn into. */
export function target(gl, format, width, height) {
  const texture = gl.createTexture(), frame = gl.createFramebuffer();
  gl.bindTexture(gl.TEXTURE_2D, texture);
  sample(gl, gl.TEXTURE_2D);
  gl.texStorage2D(gl.TEXTURE_2D, 1, format, width, height);
  gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
  return { texture, frame, width, height };
}
