// @ts-check
/** The programs of the graphics card: lit bodies, the ground in squares that fade with distance, shadows, and paths. */

export const VERTEX = `#version 300 es
in vec3 place;
in vec3 normal;
uniform mat4 view;
uniform mat4 model;
out vec3 at;
out vec3 facing;
void main() {
  vec4 world = model * vec4(place, 1.0);
  at = world.xyz;
  facing = mat3(model) * normal;
  gl_Position = view * world;
}`;

export const FRAGMENT = `#version 300 es
precision highp float;
in vec3 at;
in vec3 facing;
uniform int kind;  // 0 a body, 1 the ground, 2 of one colour
uniform vec4 colour;
uniform vec4 other;
uniform vec4 sky;
uniform vec3 light;
uniform vec3 around;
uniform float scale;
out vec4 seen;
void main() {
  if (kind == 2) {
    seen = colour;
  } else if (kind == 1) {
    vec2 square = at.xy / (0.25 * scale);
    vec2 soft = fwidth(square);
    vec2 edges = clamp((abs(fract(square * 0.5) - 0.5) - 0.25) / max(soft * 0.5, vec2(1e-4)), -1.0, 1.0);
    float checker = 0.5 - 0.5 * edges.x * edges.y;
    float far = smoothstep(1.5, 6.0, distance(at.xy, around.xy) / scale);
    seen = mix(mix(colour, other, checker), sky, far);
  } else {
    float lit = 0.62 + 0.38 * dot(normalize(facing), light);
    seen = vec4(colour.rgb * lit, 1.0);
  }
}`;
