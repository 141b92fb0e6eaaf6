// Turning, dragging, wind and shaking of the hair in a page.
import { HairMotion } from "./hair_motion.js";
import { HairView, readPacket } from "./hair_view.js";

const GRAB_PX = 30; // a strand is taken within this distance
const BRUSH_PX = 25; // hair is under the brush within this distance
const FIRST_POINT = 3; // of a guide that can be taken: those before are at the head
const PULL_M = 0.012; // metres that a key pulls a strand
const SHAKE_S = 2.4, SHAKE_TURNS = 3, SHAKE_RAD = 0.7;
const WIND = 1.5; // of the key, metres in a second
const HAIR_LABEL = "Hair on a head. Arrow keys turn it, plus and minus zoom, W is wind, S shakes "
  + "the head. P takes the strand in the middle: arrow keys pull it, P lets it go. "
  + "With a brush, P puts it down there, arrow keys lead it, and P lifts it.";

// Shows hair in an element of the page; returns what ends that.
// Its view is kept in `seen` from one hair to the next; a `brush` draws on it.
export function showHair(stage, buffer, { seen = {}, brush = null } = {}) {
  const controls = new HairControls(stage, readPacket(buffer), seen, brush);
  [stage.hairMotion, stage.hairView] = [controls.motion, controls.view]; // for scripts that measure
  return () => controls.close();
}

class HairControls {
  constructor(stage, packet, seen, brush) {
    this.stage = stage;
    this.seen = seen;
    this.brush = brush;
    this.canvas = element("canvas", { tabindex: "0", role: "img", "aria-label": HAIR_LABEL });
    stage.append(this.canvas, this.buttons());
    this.view = new HairView(this.canvas, packet);
    Object.assign(this.view, seen);
    this.motion = new HairMotion(packet);
    this.combing = false; // pointers pull strands
    this.grabbed = null; // the strand that is pulled
    this.shaken = -1; // seconds since the head began to shake, negative at rest
    this.ended = false;
    [this.drawn, this.last] = [0, 0]; // frames, and the time of the last one
    this.pointers = new Map();
    this.listen();
    requestAnimationFrame((time) => this.frame(time));
  }

  close() {
    const { azimuth, elevation, distance, share } = this.view;
    Object.assign(this.seen, { azimuth, elevation, distance, share });
    this.ended = true;
    this.view.close();
  }

  buttons() {
    const comb = element("button", { type: "button", "aria-pressed": "false" }, "Pull strands");
    const shake = element("button", { type: "button" }, "Shake head");
    const label = element("label", {}, "Wind");
    this.wind = element("input", {
      type: "range", min: "0", max: "3", step: "0.1", value: "0", "aria-label": "Wind",
    });
    label.append(this.wind);
    comb.addEventListener("click", () => {
      this.combing = !this.combing;
      comb.setAttribute("aria-pressed", String(this.combing));
    });
    shake.addEventListener("click", () => { this.shaken = 0; });
    for (const part of [comb, label, shake]) part.classList.add("motion");
    const made = element("div", { class: "controls" });
    made.append(comb, label, shake, ...(this.brush?.controls ?? []));
    return made;
  }

  listen() {
    const listen = (kind, act, options) =>
      this.canvas.addEventListener(kind, (event) => act.call(this, event), options);
    listen("pointerdown", this.down);
    listen("pointermove", this.move);
    listen("pointerup", this.up);
    listen("pointercancel", this.up);
    listen("contextmenu", (event) => event.preventDefault());
    listen("wheel", (event) => {
      event.preventDefault();
      this.zoom(Math.exp(0.001 * event.deltaY));
    }, { passive: false });
    listen("keydown", this.key);
  }

  down(event) {
    if (!this.pointers.size) this.kind = event.pointerType;
    else if (event.pointerType !== this.kind) return; // a hand beside its pen
    this.canvas.setPointerCapture(event.pointerId);
    this.pointers.set(event.pointerId, [event.offsetX, event.offsetY]);
    if (this.pointers.size !== 1) {
      this.brush?.drop(this.motion); // two fingers zoom
      return;
    }
    if (this.brush?.name) {
      this.stroke(event.offsetX, event.offsetY);
      return;
    }
    if (this.combing || event.shiftKey || event.button === 2) {
      this.hold(this.grab(event.offsetX, event.offsetY, GRAB_PX));
    }
  }

  move(event) {
    const before = this.pointers.get(event.pointerId);
    if (!before) return;
    const wide = this.reach();
    const dx = event.offsetX - before[0], dy = event.offsetY - before[1];
    this.pointers.set(event.pointerId, [event.offsetX, event.offsetY]);
    if (this.brush?.path) this.stroke(event.offsetX, event.offsetY);
    else if (this.grabbed) this.pull(this.grabbed.scale * dx, -this.grabbed.scale * dy);
    else if (this.pointers.size === 2) this.zoom(wide / Math.max(this.reach(), 1));
    else this.turn(-0.008 * dx, 0.006 * dy);
  }

  up(event) {
    this.pointers.delete(event.pointerId);
    this.brush?.lift(this.motion);
    this.hold(null);
  }

  // Pixels between the first two pointers.
  reach() {
    const [a, b = a] = [...this.pointers.values()];
    return Math.hypot(a[0] - b[0], a[1] - b[1]);
  }

  key(event) {
    const way = {
      ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1],
    }[event.key];
    const act = way ? () => this.arrow(...way) : {
      p: () => this.press(), Escape: () => { this.brush?.drop(this.motion); this.hold(null); },
      "+": () => this.zoom(0.9), "-": () => this.zoom(1.1),
      w: () => { this.wind.value = Number(this.wind.value) > 0 ? 0 : WIND; },
      s: () => { this.shaken = 0; },
    }[event.key];
    if (!act) return;
    event.preventDefault();
    act();
  }

  arrow(right, up) {
    if (this.brush?.path) this.goOn(PULL_M * right, PULL_M * up);
    else if (this.grabbed && !this.pointers.size) this.pull(PULL_M * right, PULL_M * up);
    else this.turn(0.1 * right, 0.1 * up);
  }

  // Takes the strand that comes nearest to a point of the canvas, in pixels, in front of others.
  grab(x, y, within) {
    const { motion: { count, points, now }, canvas } = this;
    const { matrix, right, up } = this.view.camera();
    const w = canvas.clientWidth, h = canvas.clientHeight;
    let best = within, depth = Infinity, hit = null;
    for (let guide = 0; guide < count; guide += 1) {
      for (let point = FIRST_POINT; point < points; point += 1) {
        const i = (guide * points + point) * 3;
        const at = [now[i], now[i + 1], now[i + 2]];
        const [cx, cy, , cw] = clip(matrix, at);
        const away = Math.hypot((cx / cw + 1) * w / 2 - x, (1 - cy / cw) * h / 2 - y);
        if (away < best * 0.7 || (away < best && cw < depth)) {
          best = Math.max(away, 6);
          depth = cw;
          hit = { guide, point, at };
        }
      }
    }
    return hit && { hit, scale: 2 * depth * Math.tan(0.25) / h, right, up };
  }

  // Holds a strand that was taken, or lets it go.
  hold(grabbed) {
    this.grabbed = grabbed;
    this.motion.held = grabbed?.hit ?? null;
  }

  // Puts the brush down in the middle, or lifts it; without one takes a strand, or lets it go.
  press() {
    const { clientWidth: w, clientHeight: h } = this.canvas;
    if (this.brush?.path) this.brush.lift(this.motion);
    else if (this.brush?.name) this.stroke(w / 2, 0.4 * h);
    else this.take();
  }

  // Leads the brush to a point of the canvas, in pixels, on the hair that is seen there.
  stroke(x, y) {
    const hit = this.under(x, y);
    if (hit) this.draw(hit);
  }

  // Leads the brush on by metres across and upwards.
  goOn(across, upwards) {
    const { right, up } = this.view.camera(), last = this.brush.path.at(-1);
    this.draw(last.map((value, k) => value + across * right[k] + upwards * up[k]));
  }

  draw(at) {
    if (this.brush.draw(at)) this.brush.preview(this.motion);
  }

  // Returns the place on the foremost hair, or skin, under a point of the canvas, in pixels. A
  // stroke goes along it: no farther in depth than across, at its own depth where there is none.
  under(x, y) {
    const { canvas: { clientWidth: w, clientHeight: h } } = this;
    const now = this.brush.onSkin ? this.view.packet.arrays.head_points.data : this.motion.now;
    const { matrix, eye, right, up, back } = this.view.camera(), slope = Math.tan(0.25);
    const ray = right.map((v, k) =>
      (2 * x / w - 1) * slope * (w / h) * v + (1 - 2 * y / h) * slope * up[k] - back[k]);
    const at = (depth) => eye.map((v, k) => v + depth * ray[k]);
    let depth = Infinity;
    for (let i = 0; i < now.length; i += 3) {
      const [cx, cy, , cw] = clip(matrix, [now[i], now[i + 1], now[i + 2]]);
      const away = Math.hypot((cx / cw + 1) * w / 2 - x, (1 - cy / cw) * h / 2 - y);
      if (away < BRUSH_PX) depth = Math.min(depth, cw);
    }
    const last = this.brush.path?.at(-1);
    if (last) {
      const before = clip(matrix, last)[3];
      const most = Math.hypot(...at(before).map((v, k) => v - last[k]));
      if (depth === Infinity) depth = before;
      depth = Math.max(before - most, Math.min(before + most, depth));
    }
    return depth < Infinity ? at(depth) : null;
  }

  take() {
    const { clientWidth: w, clientHeight: h } = this.canvas;
    this.hold(this.grabbed ? null : this.grab(w / 2, 0.6 * h, h));
  }

  pull(across, upwards) {
    const { hit: { at }, right, up } = this.grabbed;
    for (let k = 0; k < 3; k += 1) at[k] += across * right[k] + upwards * up[k];
  }

  turn(across, up) {
    this.view.azimuth += across;
    this.view.elevation = Math.max(-1.2, Math.min(1.4, this.view.elevation + up));
  }

  zoom(factor) {
    this.view.distance = Math.max(0.3, Math.min(5, this.view.distance * factor));
  }

  frame(time) {
    if (this.ended) return;
    const { view, motion } = this;
    const seconds = Math.min((time - this.last) / 1000 || 0, 0.1);
    this.last = time;
    const { right, back } = view.camera();
    const speed = Number(this.wind.value);
    motion.wind = right.map((value, k) => speed * (0.9 * value - 0.35 * back[k]));
    if (this.shaken >= 0) this.shake(seconds);
    motion.advance(seconds);
    const steady = view.azimuth;
    view.azimuth = steady - motion.turn;
    view.draw(motion);
    view.azimuth = steady;
    this.drawn += 1;
    this.stage.dataset.frames = this.drawn;
    requestAnimationFrame((next) => this.frame(next));
  }

  shake(seconds) {
    this.shaken += seconds;
    const phase = this.shaken / SHAKE_S;
    const swing = Math.sin(2 * Math.PI * SHAKE_TURNS * phase) * Math.sin(Math.PI * phase);
    this.motion.turn = phase < 1 ? SHAKE_RAD * swing : 0;
    if (phase >= 1) this.shaken = -1;
  }
}

// `make` of the other pages: `result.html` has this file without them.
function element(name, values, text = "") {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(values)) made.setAttribute(key, value);
  made.append(text);
  return made;
}

function clip(matrix, [x, y, z]) {
  return [0, 1, 2, 3].map((k) =>
    matrix[k] * x + matrix[4 + k] * y + matrix[8 + k] * z + matrix[12 + k]);
}
