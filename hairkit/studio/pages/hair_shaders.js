// Shaders of head, hair and wall. Hair is shaded after Kajiya and Kay (1989).

export const HAIR_VERTEX = `#version 300 es
precision highp float;
precision highp sampler2D;
uniform sampler2D u_hair;      // (points * columns, rows) rest positions
uniform sampler2D u_moved;     // (points, guides) displacement of every guide's points
uniform mat4 u_clip_from_head;
uniform vec3 u_eye;
uniform vec2 u_layout;         // points of a strand, strands in a row of u_hair
uniform float u_width, u_pixel;
in vec3 a_carriers, a_weights;
out vec3 v_tangent, v_place;
out float v_share, v_strand, v_side;

vec3 place(int point) {
  int points = int(u_layout.x), columns = int(u_layout.y);
  ivec2 at = ivec2(gl_InstanceID % columns * points + point, gl_InstanceID / columns);
  vec3 rest = texelFetch(u_hair, at, 0).xyz;
  for (int k = 0; k < 3; ++k)
    rest += a_weights[k] * texelFetch(u_moved, ivec2(point, int(a_carriers[k])), 0).xyz;
  return rest;
}

void main() {
  int points = int(u_layout.x), point = gl_VertexID / 2;
  vec3 here = place(point);
  vec3 along = place(min(point + 1, points - 1)) - place(max(point - 1, 0));
  v_tangent = normalize(along + vec3(0.0, 1e-9, 0.0));
  v_share = float(point) / float(points - 1);
  v_strand = fract(float(gl_InstanceID) * 0.61803399);
  vec3 side = normalize(cross(v_tangent, u_eye - here));
  float depth = (u_clip_from_head * vec4(here, 1.0)).w;
  float width = max(u_width * (1.0 - 0.75 * v_share * v_share), u_pixel * depth);
  v_side = gl_VertexID % 2 == 0 ? -1.0 : 1.0;
  v_place = here;
  gl_Position = u_clip_from_head * vec4(here + 0.5 * v_side * width * side, 1.0);
}`;

export const HAIR_FRAGMENT = `#version 300 es
precision highp float;
uniform vec3 u_eye, u_key, u_root, u_tip, u_middle;
in vec3 v_tangent, v_place;
in float v_share, v_strand, v_side;
out vec4 out_colour;

float along(vec3 tangent, vec3 direction) {
  float c = dot(tangent, direction);
  return sqrt(max(1.0 - c * c, 0.0));
}

void main() {
  vec3 t = normalize(v_tangent), eye = normalize(u_eye - v_place), key = normalize(u_key);
  vec3 out_of_head = normalize(v_place - u_middle);
  vec3 base = mix(u_root, u_tip, v_share) * (0.72 + 0.56 * v_strand);
  float facing = 0.5 + 0.5 * dot(out_of_head, key);
  float depth = mix(0.42, 1.0, smoothstep(0.0, 0.35, v_share));
  vec3 half_way = normalize(eye + key);
  float shift = 0.10 * (v_strand - 0.5);
  float white = pow(along(normalize(t + (0.06 + shift) * out_of_head), half_way), 90.0);
  float tinted = pow(along(normalize(t - (0.10 + shift) * out_of_head), half_way), 22.0);
  float rim = pow(1.0 - abs(dot(out_of_head, eye)), 3.0);
  vec3 colour = base * (0.42 + 1.1 * along(t, key) * facing) * depth;
  colour += facing * depth * (0.035 * white + 0.8 * tinted * base) + rim * (0.35 * base + 0.02);
  colour *= 1.0 - 0.25 * v_side * v_side;
  out_colour = vec4(pow(colour / (1.0 + 0.35 * colour), vec3(1.0 / 2.2)), 1.0);
}`;

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
