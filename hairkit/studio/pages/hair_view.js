// Head and hair drawn by WebGL 2. Hair: one instanced ribbon a strand, its points in a texture,
// moved by the three guides that it follows; shaded after Kajiya and Kay (1989).

const HAIR_VERTEX = `#version 300 es
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

const HAIR_FRAGMENT = `#version 300 es
precision highp float;
uniform vec3 u_eye, u_key, u_root, u_tip, u_middle;
in vec3 v_tangent, v_place;
in float v_share, v_strand, v_side;
out vec4 out_colour;

float along(vec3 tangent, vec3 direction) { float c = dot(tangent, direction); return sqrt(max(1.0 - c * c, 0.0)); }

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

const HEAD_VERTEX = `#version 300 es
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
  gl_Position = u_clip_from_head * vec4(a_point - (0.0015 * a_scalp + 0.0010 * a_eye) * a_normal, 1.0);
}`;

const HEAD_FRAGMENT = `#version 300 es
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
  vec3 warm = mix(vec3(0.9, 0.42, 0.3), vec3(1.0), max(smoothstep(0.0, 0.5, wrapped), 1.0 - u_scatter));
  float across = max(dot(n, normalize(eye + key)), 0.0);
  float sheen = mix(0.05 * u_scatter * pow(across, 24.0), 1.2 * pow(across, 400.0), v_eye);
  float lids = smoothstep(0.45, 0.95, n.z) * (1.0 - 0.55 * smoothstep(0.0, 0.42, n.y));
  float open_sky = mix(1.0, 0.25 + 0.75 * lids, v_eye);  // eyeballs lie in the shade of their lids
  vec3 colour = open_sky * (skin * (0.3 + 0.08 * n.y + 1.3 * wrapped * warm) + sheen);
  colour += 0.12 * u_scatter * skin * pow(1.0 - max(dot(n, eye), 0.0), 3.0);
  out_colour = vec4(pow(colour / (1.0 + 0.35 * colour), vec3(1.0 / 2.2)), 1.0);
}`;

// One triangle over the whole picture: a wall that is lighter behind the head.
const WALL_VERTEX = `#version 300 es
out vec2 v_place;
void main() {
  v_place = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
  gl_Position = vec4(v_place, 1.0, 1.0);
}`;

const WALL_FRAGMENT = `#version 300 es
precision highp float;
in vec2 v_place;
out vec4 out_colour;
void main() {
  float near = exp(-1.1 * dot(v_place - vec2(0.0, 0.15), v_place - vec2(0.0, 0.15)));
  out_colour = vec4(mix(vec3(0.075, 0.087, 0.1), vec3(0.35, 0.385, 0.42), near), 1.0);
}`;

const COLUMNS = 128; // strands in a row of the texture: 16 points each make 2048 texels
const SKIN = [172, 134, 115, 255]; // until the picture of the skin is decoded
const SHOWN_WIDTH = 0.0007; // metres: few strands stand for a hundred thousand
const NEAR = 0.05, FAR = 10, VIEW_ANGLE = 0.5; // metres, metres, radians

export function readPacket(buffer) {
  const view = new DataView(buffer);
  if (view.getUint32(0) !== 0x484b5331) throw new Error("no hair in this file");
  const size = view.getUint32(4, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 8, size)));
  const arrays = {};
  for (const [name, { type, shape, at }] of Object.entries(header.arrays)) {
    const kind = { uint32: Uint32Array, uint8: Uint8Array }[type] ?? Float32Array;
    arrays[name] = { shape, data: new kind(buffer, 8 + size + at, shape.reduce((a, b) => a * b, 1)) };
  }
  return { arrays, facts: header.facts };
}

export class HairView {
  constructor(canvas, packet) {
    const gl = canvas.getContext("webgl2", { antialias: true, alpha: false, preserveDrawingBuffer: false });
    if (!gl) throw new Error("this browser has no WebGL 2");
    this.gl = gl;
    this.canvas = canvas;
    this.packet = packet;
    const { arrays } = packet;
    [this.hairs, this.points] = arrays.hair.shape;
    this.hairProgram = program(gl, HAIR_VERTEX, HAIR_FRAGMENT);
    this.wallProgram = program(gl, WALL_VERTEX, WALL_FRAGMENT);
    this.headProgram = program(gl, HEAD_VERTEX, HEAD_FRAGMENT);
    this.hair = texture(gl, this.points * COLUMNS, Math.ceil(this.hairs / COLUMNS));
    this.moved = texture(gl, this.points, arrays.guides.shape[0]);
    upload(gl, this.hair, this.points * COLUMNS, Math.ceil(this.hairs / COLUMNS), fourWide(arrays.hair.data, this.points * COLUMNS * Math.ceil(this.hairs / COLUMNS)));
    this.shift = new Float32Array(4 * this.points * arrays.guides.shape[0]);
    this.hairArray = vertexArray(gl, this.hairProgram, { a_carriers: [arrays.carriers.data, 3, 1], a_weights: [arrays.weights.data, 3, 1] });
    this.solids = ["head", "bust"].filter((name) => arrays[`${name}_points`]).map((name) => this.solid(name));
    this.skin = texture(gl);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, 1, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(SKIN));
    this.skinShown = arrays.head_skin ? this.showSkin(arrays.head_skin.data) : Promise.resolve();
    this.middle = middleOf(arrays.head_points.data);
    this.target = middleOf(arrays.hair.data).map((value, k) => (value + this.middle[k]) / 2);
    this.azimuth = 0.5;
    this.elevation = 0.08;
    this.distance = 2.6 * reach(arrays.hair.data, arrays.head_points.data, this.target);
  }

  solid(name) {
    const { gl, packet: { arrays } } = this;
    const of = (part) => arrays[`${name}_${part}`].data;
    const array = vertexArray(gl, this.headProgram, {
      a_point: [of("points"), 3, 0], a_normal: [of("normals"), 3, 0], a_colour: [of("colours"), 3, 0], a_uv: [of("uv"), 2, 0],
      ...(name === "head" ? { a_eye: [of("eyes"), 1, 0], a_scalp: [of("scalp"), 1, 0] } : {}),
    });
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, of("faces"), gl.STATIC_DRAW);
    gl.bindVertexArray(null);
    return { array, corners: of("faces").length, textured: name === "head" && arrays.head_skin ? 1 : 0, scatter: name === "head" ? 1 : 0 };
  }

  // The picture is decoded beside the first frames, which show plain skin.
  async showSkin(bytes) {
    const { gl } = this;
    const picture = await createImageBitmap(new Blob([bytes], { type: "image/jpeg" }), { colorSpaceConversion: "none" });
    gl.bindTexture(gl.TEXTURE_2D, this.skin);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.SRGB8_ALPHA8, gl.RGBA, gl.UNSIGNED_BYTE, picture);
    gl.generateMipmap(gl.TEXTURE_2D);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR_MIPMAP_LINEAR);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.LINEAR);
    this.canvas.parentElement.dataset.skin = `${picture.width} x ${picture.height}`;
  }

  camera() {
    const { azimuth, elevation, distance, target } = this;
    const back = [Math.sin(azimuth) * Math.cos(elevation), Math.sin(elevation), Math.cos(azimuth) * Math.cos(elevation)];
    const right = [Math.cos(azimuth), 0, -Math.sin(azimuth)];
    const up = cross(back, right);
    const aspect = this.canvas.width / Math.max(this.canvas.height, 1);
    const far = distance * Math.max(1, 0.82 / aspect);
    const eye = target.map((value, k) => value + far * back[k]);
    const scale = 1 / Math.tan(VIEW_ANGLE / 2);
    const dot = (a) => -(a[0] * eye[0] + a[1] * eye[1] + a[2] * eye[2]);
    const depth = (FAR + NEAR) / (NEAR - FAR), shift = (2 * FAR * NEAR) / (NEAR - FAR);
    const x = scale / aspect;
    const matrix = new Float32Array(16);
    for (let k = 0; k < 3; k += 1) {
      matrix[4 * k] = x * right[k]; matrix[4 * k + 1] = scale * up[k];
      matrix[4 * k + 2] = depth * back[k]; matrix[4 * k + 3] = -back[k];
    }
    matrix[12] = x * dot(right); matrix[13] = scale * dot(up);
    matrix[14] = depth * dot(back) + shift; matrix[15] = -dot(back);
    return { matrix, eye, right, up, back };
  }

  draw(motion) {
    const { gl, canvas } = this;
    const sharp = Math.min(devicePixelRatio || 1, 2);
    const width = Math.round(canvas.clientWidth * sharp), height = Math.round(canvas.clientHeight * sharp);
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    for (let i = 0, j = 0; i < motion.now.length; i += 3, j += 4) {
      for (let k = 0; k < 3; k += 1) this.shift[j + k] = motion.now[i + k] - motion.rest[i + k];
    }
    upload(gl, this.moved, this.points, this.packet.arrays.guides.shape[0], this.shift);
    const view = this.camera();
    const { facts } = this.packet;
    const key = view.right.map((value, k) => 0.55 * value + 0.75 * view.up[k] + 0.6 * view.back[k]);
    gl.viewport(0, 0, width, height);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    gl.disable(gl.DEPTH_TEST);
    gl.bindVertexArray(null);
    gl.useProgram(this.wallProgram);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.enable(gl.DEPTH_TEST);
    gl.activeTexture(gl.TEXTURE0); gl.bindTexture(gl.TEXTURE_2D, this.skin);
    for (const { array, corners, textured, scatter } of this.solids) {
      use(gl, this.headProgram, { u_clip_from_head: view.matrix, u_eye: view.eye, u_key: key, u_textured: textured, u_scatter: scatter });
      gl.uniform1i(gl.getUniformLocation(this.headProgram, "u_skin"), 0);
      gl.bindVertexArray(array);
      gl.drawElements(gl.TRIANGLES, corners, gl.UNSIGNED_INT, 0);
    }
    use(gl, this.hairProgram, {
      u_clip_from_head: view.matrix, u_eye: view.eye, u_key: key, u_root: facts.root_colour,
      u_tip: facts.tip_colour, u_middle: this.middle, u_layout: [this.points, COLUMNS],
      u_width: SHOWN_WIDTH, u_pixel: (1.1 * 2 * Math.tan(VIEW_ANGLE / 2)) / Math.max(height, 1),
    });
    gl.activeTexture(gl.TEXTURE0); gl.bindTexture(gl.TEXTURE_2D, this.hair);
    gl.activeTexture(gl.TEXTURE1); gl.bindTexture(gl.TEXTURE_2D, this.moved);
    gl.uniform1i(gl.getUniformLocation(this.hairProgram, "u_hair"), 0);
    gl.uniform1i(gl.getUniformLocation(this.hairProgram, "u_moved"), 1);
    gl.bindVertexArray(this.hairArray);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 2 * this.points, this.hairs);
  }

  close() {
    this.gl.getExtension("WEBGL_lose_context")?.loseContext();
  }
}

function program(gl, vertex, fragment) {
  const made = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(made, shader);
  }
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
  return made;
}

function texture(gl) {
  const made = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, made);
  for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, name, gl.NEAREST);
  return made;
}

function upload(gl, name, width, height, data) {
  gl.bindTexture(gl.TEXTURE_2D, name);
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, width, height, 0, gl.RGBA, gl.FLOAT, data);
}

function fourWide(three, texels) {
  const four = new Float32Array(4 * texels);
  for (let i = 0, j = 0; i < three.length; i += 3, j += 4) four.set(three.subarray(i, i + 3), j);
  return four;
}

function vertexArray(gl, made, attributes) {
  const array = gl.createVertexArray();
  gl.bindVertexArray(array);
  for (const [name, [data, size, divisor]] of Object.entries(attributes)) {
    const place = gl.getAttribLocation(made, name);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
    gl.enableVertexAttribArray(place);
    gl.vertexAttribPointer(place, size, gl.FLOAT, false, 0, 0);
    gl.vertexAttribDivisor(place, divisor);
  }
  gl.bindVertexArray(null);
  return array;
}

function use(gl, made, uniforms) {
  gl.useProgram(made);
  for (const [name, value] of Object.entries(uniforms)) {
    const place = gl.getUniformLocation(made, name);
    if (typeof value === "number") gl.uniform1f(place, value);
    else if (value.length === 2) gl.uniform2fv(place, value);
    else if (value.length === 3) gl.uniform3fv(place, value);
    else gl.uniformMatrix4fv(place, false, value);
  }
}

function cross(a, b) {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}

function middleOf(points) {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; i < points.length; i += 1) {
    low[i % 3] = Math.min(low[i % 3], points[i]);
    high[i % 3] = Math.max(high[i % 3], points[i]);
  }
  return low.map((value, k) => (value + high[k]) / 2);
}

function reach(hair, head, middle) {
  let far = 0;
  for (const points of [hair, head]) {
    for (let i = 0; i < points.length; i += 3) {
      far = Math.max(far, Math.hypot(points[i] - middle[0], points[i + 1] - middle[1], points[i + 2] - middle[2]));
    }
  }
  return 1.45 * far;
}
