// Shaders of head, hair and wall. Hair is shaded as in pictures: its packet brings the text of that
// shader, with its constants.

// The vertex shader of the hair, which colours points with `seen_colour` of the text `shading`.
export const hairVertex = (shading) => `#version 300 es
precision highp float;
precision highp sampler2D;
precision highp sampler3D;
const float u_perspective = 1.0;
const vec3 u_forward = vec3(0.0);
${shading}
uniform sampler2D u_hair;      // (points * columns, rows) rest positions
uniform sampler2D u_moved;     // (points, guides) displacement of guides, and their packed colour
uniform mat4 u_clip_from_head;
uniform vec2 u_layout;         // points of a strand, strands in a row of u_hair
uniform float u_width, u_taper, u_pixel;
in vec3 a_carriers, a_weights;
out vec3 v_colour;

vec3 place(int point) {
  int points = int(u_layout.x), columns = int(u_layout.y);
  ivec2 at = ivec2(gl_InstanceID % columns * points + point, gl_InstanceID / columns);
  vec3 here = texelFetch(u_hair, at, 0).xyz;
  for (int k = 0; k < 3; ++k)
    here += a_weights[k] * texelFetch(u_moved, ivec2(point, int(a_carriers[k])), 0).xyz;
  return here;
}

void main() {
  int points = int(u_layout.x), point = gl_VertexID / 2;
  vec3 along = place(min(point + 1, points - 1)) - place(max(point - 1, 0));
  vec3 here = place(point), tangent = normalize(along + vec3(0.0, 1e-9, 0.0));
  float share = float(point) / float(points - 1);
  vec3 own = vec3(0.0);
  for (int k = 0; k < 3; ++k) {
    float bits = texelFetch(u_moved, ivec2(point, int(a_carriers[k])), 0).w;
    own += a_weights[k] * unpacked(floatBitsToUint(bits));
  }
  v_colour = seen_colour(here, tangent, own, fract(float(gl_InstanceID) * 0.61803399));
  vec3 side = normalize(cross(tangent, u_eye - here));
  float depth = (u_clip_from_head * vec4(here, 1.0)).w;
  float width = max(u_width * (1.0 - u_taper * pow(share, 4.0)), u_pixel * depth);
  gl_Position = u_clip_from_head * vec4(here + (float(gl_VertexID % 2) - 0.5) * width * side, 1.0);
}`;

export const HAIR_FRAGMENT = `#version 300 es
precision highp float;
in vec3 v_colour;
out vec4 out_colour;
void main() { out_colour = vec4(v_colour, 1.0); }`;

export const HEAD_VERTEX = `#version 300 es
precision highp float;
uniform mat4 u_clip_from_head;
in vec3 a_point, a_normal, a_colour;
in vec2 a_uv;
in float a_eye, a_scalp;
out vec3 v_normal, v_place, v_colour;
out vec2 v_uv;
out float v_eye;
void main() {
  v_normal = a_normal; v_place = a_point; v_colour = a_colour; v_eye = a_eye;
  v_uv = vec2(a_uv.x, 1.0 - a_uv.y);
  float sunk = 0.0015 * a_scalp + 0.0010 * a_eye;  // metres
  gl_Position = u_clip_from_head * vec4(a_point - sunk * a_normal, 1.0);
}`;

export const HEAD_FRAGMENT = `#version 300 es
precision highp float;
uniform sampler2D u_skin;      // sRGB, white where there is no picture
uniform vec3 u_eye, u_key;
uniform float u_textured, u_scatter;
in vec3 v_normal, v_place, v_colour;
in vec2 v_uv;
in float v_eye;
out vec4 out_colour;
void main() {
  vec3 n = normalize(v_normal), eye = normalize(u_eye - v_place), key = normalize(u_key);
  vec3 skin = v_colour * mix(vec3(1.0), texture(u_skin, v_uv).rgb, u_textured);
  float soft = 0.35 * u_scatter;
  float wrapped = max((dot(n, key) + soft) / (1.0 + soft), 0.0);
  float white = max(smoothstep(0.0, 0.5, wrapped), 1.0 - u_scatter);
  vec3 warm = mix(vec3(0.9, 0.42, 0.3), vec3(1.0), white);
  float across = max(dot(n, normalize(eye + key)), 0.0);
  float sheen = mix(0.05 * u_scatter * pow(across, 24.0), 1.2 * pow(across, 400.0), v_eye);
  float lids = smoothstep(0.45, 0.95, n.z) * (1.0 - 0.55 * smoothstep(0.0, 0.42, n.y));
  float open_sky = mix(1.0, 0.25 + 0.75 * lids, v_eye);  // eyeballs lie in the shade of their lids
  vec3 colour = open_sky * (skin * (0.3 + 0.08 * n.y + 1.3 * wrapped * warm) + sheen);
  colour += 0.12 * u_scatter * skin * pow(1.0 - max(dot(n, eye), 0.0), 3.0);
  out_colour = vec4(pow(colour / (1.0 + 0.35 * colour), vec3(1.0 / 2.2)), 1.0);
}`;

// One triangle over the whole picture: a wall that is lighter behind the head.
export const WALL_VERTEX = `#version 300 es
out vec2 v_place;
void main() {
  v_place = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
  gl_Position = vec4(v_place, 1.0, 1.0);
}`;

export const WALL_FRAGMENT = `#version 300 es
precision highp float;
in vec2 v_place;
out vec4 out_colour;
void main() {
  float near = exp(-1.1 * dot(v_place - vec2(0.0, 0.15), v_place - vec2(0.0, 0.15)));
  out_colour = vec4(mix(vec3(0.075, 0.087, 0.1), vec3(0.35, 0.385, 0.42), near), 1.0);
}`;
