// Light comes from the sky and from beside the viewer, so that nothing is ever black.
const LIGHT = `
vec3 lit(vec3 colour, vec3 n, vec3 eye) {
  vec3 sun = normalize(vec3(0.35, -0.55, 0.85));
  vec3 h = normalize(sun + eye);
  float sky = 0.5 + 0.5 * n.z;
  float direct = max(dot(n, sun), 0.0), head = max(dot(n, eye), 0.0);
  vec3 c = colour * (0.30 + 0.22 * sky + 0.42 * direct + 0.20 * head);
  return c + vec3(0.16) * pow(max(dot(n, h), 0.0), 36.0);
}`;

const CAPSULE_VERTEX = `#version 300 es
uniform mat4 u_clip;
uniform vec4 u_flatten;      // sun's slope x and y, height of the floor, 1: draw the shadow
layout(location = 0) in vec4 a_unit;  // normal of a unit sphere with the axis along z; end: 0 or 1
layout(location = 1) in vec4 i_from;  // m; radius, m
layout(location = 2) in vec4 i_to;    // m; 1: shines by itself
layout(location = 3) in vec4 i_colour;
out vec3 v_place; out vec3 v_normal; out vec4 v_colour; out float v_glow;
void main() {
  vec3 d = i_to.xyz - i_from.xyz;
  float l = length(d);
  vec3 w = l > 1e-6 ? d / l : vec3(0.0, 0.0, 1.0);
  vec3 u = normalize(cross(w, abs(w.z) < 0.9 ? vec3(0.0, 0.0, 1.0) : vec3(1.0, 0.0, 0.0)));
  v_normal = u * a_unit.x + cross(w, u) * a_unit.y + w * a_unit.z;
  vec3 p = mix(i_from.xyz, i_to.xyz, a_unit.w) + v_normal * i_from.w;
  if (u_flatten.w > 0.5) {
    p.xy -= u_flatten.xy * (p.z - u_flatten.z);
    p.z = u_flatten.z;
  }
  v_place = p; v_colour = i_colour; v_glow = i_to.w;
  gl_Position = u_clip * vec4(p, 1.0);
}`;

const CAPSULE_FRAGMENT = `#version 300 es
precision highp float;
uniform vec3 u_eye;
uniform float u_shadow;
in vec3 v_place; in vec3 v_normal; in vec4 v_colour; in float v_glow;
out vec4 colour;
${LIGHT}
void main() {
  if (u_shadow > 0.5) { colour = vec4(0.0, 0.0, 0.0, 0.20 * v_colour.a); return; }
  vec3 eye = normalize(u_eye - v_place);
  colour = vec4(mix(lit(v_colour.rgb, normalize(v_normal), eye), v_colour.rgb, v_glow), v_colour.a);
}`;

const MESH_VERTEX = `#version 300 es
uniform mat4 u_clip;
uniform mat4 u_model;
layout(location = 0) in vec3 a_place;
layout(location = 1) in vec3 a_normal;
out vec3 v_place; out vec3 v_normal;
void main() {
  vec4 p = u_model * vec4(a_place, 1.0);
  v_place = p.xyz;
  v_normal = mat3(u_model) * a_normal;
  gl_Position = u_clip * p;
}`;

// Walls are visible from inside a room and nearly transparent from outside, to show what is behind them.
const MESH_FRAGMENT = `#version 300 es
precision highp float;
uniform vec3 u_eye;
uniform vec4 u_colour;
uniform float u_back;        // opacity of the back as a share of the front's
in vec3 v_place; in vec3 v_normal;
out vec4 colour;
${LIGHT}
void main() {
  vec3 eye = normalize(u_eye - v_place);
  vec3 n = normalize(v_normal);
  bool front = dot(n, eye) > 0.0;
  float a = front ? u_colour.a : u_colour.a * u_back;
  if (a < 0.004) discard;
  colour = vec4(lit(u_colour.rgb, front ? n : -n, eye), a);
}`;

const LINE_VERTEX = `#version 300 es
uniform mat4 u_clip;
uniform mat4 u_model;
layout(location = 0) in vec3 a_place;
out vec3 v_place;
void main() { vec4 p = u_model * vec4(a_place, 1.0); v_place = p.xyz; gl_Position = u_clip * p; }`;

const LINE_FRAGMENT = `#version 300 es
precision highp float;
uniform vec4 u_colour;
uniform float u_fade;        // lines end in the mist at this distance from the base, m; 0: never
uniform vec2 u_base;
in vec3 v_place;
out vec4 colour;
void main() {
  float far = u_fade > 0.0 ? clamp(1.6 - 1.6 * length(v_place.xy - u_base) / u_fade, 0.0, 1.0) : 1.0;
  colour = vec4(u_colour.rgb, u_colour.a * far);
}`;

function program(gl, vertex, fragment) {
  const made = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost()) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(made, shader);
  }
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS) && !gl.isContextLost()) throw new Error(gl.getProgramInfoLog(made));
  const at = {};
  const count = gl.getProgramParameter(made, gl.ACTIVE_UNIFORMS) ?? 0;
  for (let i = 0; i < count; i++) {
    const { name } = gl.getActiveUniform(made, i);
    at[name] = gl.getUniformLocation(made, name);
  }
  return { made, at };
}
