// Head and hair drawn by WebGL 2. Hair: one instanced ribbon a strand, its points in a texture,
// moved by the three guides that it follows.
import {
  HAIR_FRAGMENT, HEAD_FRAGMENT, HEAD_VERTEX, WALL_FRAGMENT, WALL_VERTEX, hairVertex,
} from "./hair_shaders.js";

const COLUMNS = 128; // strands in a row of the texture: 16 points each make 2048 texels
const SKIN = [172, 134, 115, 255]; // until the picture of the skin is decoded
const LEAST_PX = 0.6; // width of a strand, of which samples of a pixel show part
const STILL_M = 1e-4; // a guide that moves by less is not drawn anew
// Moving hair of which a picture takes longer is drawn by half of its strands, wider ones; by twice
// as many where it takes less; by all once nothing has moved for a while.
const SLOW_MS = 100, QUICK_MS = 35, LEAST_SHARE = 1 / 16, FIRST_SHARE = 1 / 4, REST_MS = 300;
const NEAR = 0.05, FAR = 10, VIEW_ANGLE = 0.5; // metres, metres, radians

export function readPacket(buffer) {
  const view = new DataView(buffer);
  if (view.getUint32(0) !== 0x484b5333) { // HKS3
    throw new Error("this hair is of another version of hairkit; make it again on the page Photos");
  }
  const size = view.getUint32(4, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 8, size)));
  const arrays = {};
  for (const [name, { type, shape, at }] of Object.entries(header.arrays)) {
    const kind = { uint32: Uint32Array, uint8: Uint8Array }[type] ?? Float32Array;
    const count = shape.reduce((a, b) => a * b, 1);
    arrays[name] = { shape, data: new kind(buffer, 8 + size + at, count) };
  }
  return { arrays, facts: header.facts };
}

export class HairView {
  constructor(canvas, packet) {
    const gl = canvas.getContext("webgl2", { antialias: true, alpha: false });
    if (!gl) throw new Error("this browser has no WebGL 2");
    this.gl = gl;
    this.canvas = canvas;
    this.packet = packet;
    const { arrays } = packet;
    [this.hairs, this.points] = arrays.hair.shape;
    this.hairProgram = program(gl, hairVertex(packet.facts.shading), HAIR_FRAGMENT);
    this.wallProgram = program(gl, WALL_VERTEX, WALL_FRAGMENT);
    this.headProgram = program(gl, HEAD_VERTEX, HEAD_FRAGMENT);
    this.light = volume(gl, arrays.light);
    this.hair = texture(gl);
    this.moved = texture(gl);
    const width = this.points * COLUMNS, height = Math.ceil(this.hairs / COLUMNS);
    upload(gl, this.hair, width, height, fourWide(arrays.hair.data, width * height));
    this.shift = new Float32Array(4 * this.points * arrays.guides.shape[0]);
    this.shown = null; // size and camera of the picture; null where it is to be drawn
    this.share = FIRST_SHARE; // of the strands, that moving hair is drawn by
    this.drawn = 0; // the share in the picture
    [this.asked, this.stirred] = [-Infinity, -Infinity]; // times of the last draw and motion
    this.hairArray = vertexArray(gl, this.hairProgram, {
      a_carriers: [arrays.carriers.data, 3, 1], a_weights: [arrays.weights.data, 3, 1],
    });
    const solids = ["head", "bust"].filter((name) => arrays[`${name}_points`]);
    this.solids = solids.map((name) => this.solid(name));
    this.skin = texture(gl);
    const plain = new Uint8Array(SKIN);
    gl.texImage2D(
      gl.TEXTURE_2D, 0, gl.SRGB8_ALPHA8, 1, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, plain);
    if (arrays.head_skin) this.showSkin(arrays.head_skin.data);
    this.middle = middleOf(arrays.head_points.data);
    this.target = middleOf(arrays.hair.data).map((value, k) => (value + this.middle[k]) / 2);
    this.azimuth = 0.5;
    this.elevation = 0.08;
    this.distance = 2.6 * reach(arrays.hair.data, arrays.head_points.data, this.target);
  }

  solid(name) {
    const { gl, packet: { arrays } } = this;
    const head = name === "head";
    const of = (part) => arrays[`${name}_${part}`].data;
    const array = vertexArray(gl, this.headProgram, {
      a_point: [of("points"), 3, 0], a_normal: [of("normals"), 3, 0],
      a_colour: [of("colours"), 3, 0], a_uv: [of("uv"), 2, 0],
      ...(head ? { a_eye: [of("eyes"), 1, 0], a_scalp: [of("scalp"), 1, 0] } : {}),
    });
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, of("faces"), gl.STATIC_DRAW);
    gl.bindVertexArray(null);
    const textured = head && arrays.head_skin ? 1 : 0;
    return { array, corners: of("faces").length, textured, scatter: head ? 1 : 0 };
  }

  // The picture is decoded beside the first frames, which show plain skin.
  async showSkin(bytes) {
    const { gl } = this;
    const file = new Blob([bytes], { type: "image/jpeg" });
    const picture = await createImageBitmap(file, { colorSpaceConversion: "none" });
    gl.bindTexture(gl.TEXTURE_2D, this.skin);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.SRGB8_ALPHA8, gl.RGBA, gl.UNSIGNED_BYTE, picture);
    gl.generateMipmap(gl.TEXTURE_2D);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR_MIPMAP_LINEAR);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.LINEAR);
    this.canvas.parentElement.dataset.skin = `${picture.width} x ${picture.height}`;
    this.shown = null;
  }

  camera() {
    const { azimuth, elevation, distance, target } = this;
    const level = Math.cos(elevation);
    const back = [Math.sin(azimuth) * level, Math.sin(elevation), Math.cos(azimuth) * level];
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

  // Draws the picture unless it is as it was: without a graphics card that takes all cores.
  draw(motion) {
    const { gl, canvas } = this;
    const sharp = Math.min(devicePixelRatio || 1, 2);
    const width = Math.round(canvas.clientWidth * sharp);
    const height = Math.round(canvas.clientHeight * sharp);
    if (canvas.width !== width) canvas.width = width;
    if (canvas.height !== height) canvas.height = height;
    const { matrix, eye } = this.camera();
    const shown = [width, height, ...matrix].join();
    if (!this.due(shown !== this.shown || this.moves(motion), performance.now())) return;
    this.shown = shown;
    const { look } = this.packet.facts;
    const seen = { u_clip_from_head: matrix, u_eye: eye };
    gl.viewport(0, 0, width, height);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    gl.disable(gl.DEPTH_TEST);
    gl.bindVertexArray(null);
    gl.useProgram(this.wallProgram);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.enable(gl.DEPTH_TEST);
    this.drawSolids({ ...seen, u_key: look.u_key_direction });
    this.uploadMotion(motion);
    this.drawHair({ ...seen, ...look, u_width: look.u_width / Math.sqrt(this.drawn) }, height);
  }

  drawSolids(seen) {
    const { gl, headProgram } = this;
    this.bind(headProgram, ["u_skin", this.skin]);
    for (const { array, corners, textured, scatter } of this.solids) {
      use(gl, headProgram, { ...seen, u_textured: textured, u_scatter: scatter });
      gl.bindVertexArray(array);
      gl.drawElements(gl.TRIANGLES, corners, gl.UNSIGNED_INT, 0);
    }
  }

  // Returns whether a picture is to be drawn, and sets the share of the strands in it.
  due(moving, now) {
    const taken = now - this.asked, before = this.stirred === this.asked;
    this.asked = now;
    if (moving) {
      if (before && taken > SLOW_MS) this.share = Math.max(this.share / 2, LEAST_SHARE);
      else if (before && taken < QUICK_MS) this.share = Math.min(2 * this.share, 1);
      this.stirred = now;
      this.drawn = this.share;
      return true;
    }
    if (this.drawn === 1 || now - this.stirred < REST_MS) return false;
    this.drawn = 1;
    return true;
  }

  // Returns whether a guide is elsewhere than in the picture, or of another colour.
  moves({ now, captured, tints }) {
    const { shift } = this, bits = new Uint32Array(shift.buffer);
    for (let i = 0, j = 0; i < now.length; i += 3, j += 4) {
      if (bits[j + 3] !== tints[i / 3]) return true;
      for (let k = 0; k < 3; k += 1)
        if (Math.abs(shift[j + k] + captured[i + k] - now[i + k]) > STILL_M) return true;
    }
    return false;
  }

  // Sends how far every point of the guides has moved, and its colour.
  uploadMotion({ now, captured, tints }) {
    const bits = new Uint32Array(this.shift.buffer);
    for (let i = 0, j = 0; i < now.length; i += 3, j += 4) {
      bits[j + 3] = tints[i / 3];
      for (let k = 0; k < 3; k += 1) this.shift[j + k] = now[i + k] - captured[i + k];
    }
    const guides = this.packet.arrays.guides.shape[0];
    upload(this.gl, this.moved, this.points, guides, this.shift);
  }

  drawHair(seen, height) {
    const { gl, hairProgram } = this;
    this.bind(hairProgram, ["u_hair", this.hair], ["u_moved", this.moved],
      ["u_light", this.light, gl.TEXTURE_3D]);
    use(gl, hairProgram, {
      ...seen, u_layout: [this.points, COLUMNS],
      u_pixel: (LEAST_PX * 2 * Math.tan(VIEW_ANGLE / 2)) / Math.max(height, 1),
    });
    gl.bindVertexArray(this.hairArray);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 2 * this.points,
      Math.ceil(this.drawn * this.hairs));
  }

  // Binds textures to a program's samplers.
  bind(made, ...samplers) {
    const { gl } = this;
    gl.useProgram(made);
    samplers.forEach(([name, bound, kind], unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(kind ?? gl.TEXTURE_2D, bound);
      gl.uniform1i(gl.getUniformLocation(made, name), unit);
    });
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
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) {
      throw new Error(gl.getShaderInfoLog(shader));
    }
    gl.attachShader(made, shader);
  }
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
  return made;
}

function texture(gl) {
  const made = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, made);
  for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) {
    gl.texParameteri(gl.TEXTURE_2D, name, gl.NEAREST);
  }
  return made;
}

// A texture of three bytes a cell, (z, y, x, 3), that is interpolated.
function volume(gl, { shape: [deep, high, wide], data }) {
  const made = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_3D, made);
  gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
  gl.texImage3D(
    gl.TEXTURE_3D, 0, gl.RGB8, wide, high, deep, 0, gl.RGB, gl.UNSIGNED_BYTE, data);
  gl.texParameteri(gl.TEXTURE_3D, gl.TEXTURE_MIN_FILTER, gl.LINEAR);
  for (const axis of [gl.TEXTURE_WRAP_R, gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T])
    gl.texParameteri(gl.TEXTURE_3D, axis, gl.CLAMP_TO_EDGE);
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

function reach(hair, head, [x, y, z]) {
  let far = 0;
  for (const points of [hair, head]) {
    for (let i = 0; i < points.length; i += 3) {
      far = Math.max(far, Math.hypot(points[i] - x, points[i + 1] - y, points[i + 2] - z));
    }
  }
  return 1.45 * far;
}
