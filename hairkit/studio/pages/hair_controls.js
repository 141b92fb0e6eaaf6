// Turning, dragging, wind and shaking of the hair in a page.
import { HairMotion } from "./hair_motion.js";
import { HairView, readPacket } from "./hair_view.js";

const GRAB_PX = 30; // a strand is taken within this distance
const PULL_M = 0.012; // metres that a key pulls a strand
const SHAKE_S = 2.4, SHAKE_TURNS = 3, SHAKE_RAD = 0.7;

export function showHair(stage, buffer) {
  const element = (name, values, text = "") => {
    const made = document.createElement(name);
    for (const [key, value] of Object.entries(values)) made.setAttribute(key, value);
    made.append(text);
    return made;
  };
  const packet = readPacket(buffer);
  const canvas = element("canvas", { tabindex: "0", role: "img", "aria-label": "Hair on a head. Arrow keys turn it, plus and minus zoom, W is wind, S shakes the head. P takes the strand in the middle: arrow keys pull it, P lets it go." });
  const comb = element("button", { type: "button", "aria-pressed": "false" }, "Pull strands");
  const shake = element("button", { type: "button" }, "Shake head");
  const label = element("label", {}, "Wind");
  const wind = element("input", { type: "range", min: "0", max: "3", step: "0.1", value: "0", "aria-label": "Wind" });
  label.append(wind);
  const controls = element("div", { class: "controls" });
  controls.append(comb, label, shake);
  stage.append(canvas, controls);
  const view = new HairView(canvas, packet);
  const motion = new HairMotion(packet);
  let combing = false, shaken = -1, turnSpeed = 0, ended = false, drawn = 0, last = 0;
  const pointers = new Map();
  let grabbed = null;

  comb.addEventListener("click", () => {
    combing = !combing;
    comb.setAttribute("aria-pressed", String(combing));
  });
  shake.addEventListener("click", () => { shaken = 0; });

  function grab(x, y, within = GRAB_PX) {
    const { matrix, right, up } = view.camera();
    const w = canvas.clientWidth, h = canvas.clientHeight;
    let best = within, depth = Infinity, hit = null;
    for (let g = 0; g < motion.count; g += 1) {
      for (let p = 3; p < motion.points; p += 1) {
        const i = (g * motion.points + p) * 3;
        const clip = [0, 1, 2, 3].map((k) => matrix[k] * motion.now[i] + matrix[4 + k] * motion.now[i + 1] + matrix[8 + k] * motion.now[i + 2] + matrix[12 + k]);
        const away = Math.hypot((clip[0] / clip[3] + 1) * w / 2 - x, (1 - clip[1] / clip[3]) * h / 2 - y);
        if (away < best * 0.7 || (away < best && clip[3] < depth)) {
          best = Math.max(away, 6); depth = clip[3];
          hit = { guide: g, point: p, at: [motion.now[i], motion.now[i + 1], motion.now[i + 2]] };
        }
      }
    }
    return hit && { hit, scale: 2 * depth * Math.tan(0.25) / h, right, up };
  }

  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, [event.offsetX, event.offsetY]);
    if (pointers.size === 1 && (combing || event.shiftKey || event.button === 2)) {
      grabbed = grab(event.offsetX, event.offsetY);
      motion.held = grabbed?.hit ?? null;
    }
  });
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("pointermove", (event) => {
    const before = pointers.get(event.pointerId);
    if (!before) return;
    const dx = event.offsetX - before[0], dy = event.offsetY - before[1];
    if (grabbed) {
      for (let k = 0; k < 3; k += 1) grabbed.hit.at[k] += grabbed.scale * (dx * grabbed.right[k] - dy * grabbed.up[k]);
    } else if (pointers.size === 2) {
      const [a, b] = [...pointers.values()];
      const wide = Math.hypot(a[0] - b[0], a[1] - b[1]);
      before[0] = event.offsetX; before[1] = event.offsetY;
      const [c, d] = [...pointers.values()];
      zoom(wide / Math.max(Math.hypot(c[0] - d[0], c[1] - d[1]), 1));
    } else {
      turn(-0.008 * dx, 0.006 * dy);
    }
    pointers.set(event.pointerId, [event.offsetX, event.offsetY]);
  });
  for (const kind of ["pointerup", "pointercancel"]) {
    canvas.addEventListener(kind, (event) => {
      pointers.delete(event.pointerId);
      grabbed = motion.held = null;
    });
  }
  canvas.addEventListener("wheel", (event) => { event.preventDefault(); zoom(Math.exp(0.001 * event.deltaY)); }, { passive: false });
  function take() {
    grabbed = grabbed ? null : grab(canvas.clientWidth / 2, 0.6 * canvas.clientHeight, canvas.clientHeight);
    motion.held = grabbed?.hit ?? null;
  }

  function pull(right, up) {
    for (let k = 0; k < 3; k += 1) grabbed.hit.at[k] += PULL_M * (right * grabbed.right[k] + up * grabbed.up[k]);
  }

  canvas.addEventListener("keydown", (event) => {
    const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
    if (grabbed && !pointers.size && way) { event.preventDefault(); pull(...way); return; }
    const act = {
      p: take, Escape: () => { grabbed = motion.held = null; },
      ArrowLeft: () => turn(-0.1, 0), ArrowRight: () => turn(0.1, 0), ArrowUp: () => turn(0, 0.1), ArrowDown: () => turn(0, -0.1),
      "+": () => zoom(0.9), "-": () => zoom(1.1), w: () => { wind.value = Number(wind.value) > 0 ? 0 : 1.5; }, s: () => { shaken = 0; },
    }[event.key];
    if (act) { event.preventDefault(); act(); }
  });

  function turn(across, up) {
    view.azimuth += across;
    view.elevation = Math.max(-1.2, Math.min(1.4, view.elevation + up));
  }

  function zoom(factor) {
    view.distance = Math.max(0.3, Math.min(5, view.distance * factor));
  }

  function frame(time) {
    if (ended) return;
    const seconds = Math.min((time - last) / 1000 || 0, 0.1);
    last = time;
    const { right, back } = view.camera();
    const speed = Number(wind.value);
    motion.wind = right.map((value, k) => speed * (0.9 * value - 0.35 * back[k]));
    if (shaken >= 0) {
      shaken += seconds;
      const phase = shaken / SHAKE_S;
      motion.turn = phase < 1 ? SHAKE_RAD * Math.sin(2 * Math.PI * SHAKE_TURNS * phase) * Math.sin(Math.PI * phase) : 0;
      turnSpeed = motion.turn;
      if (phase >= 1) shaken = -1;
    }
    motion.advance(seconds);
    const steady = view.azimuth;
    view.azimuth = steady - motion.turn;
    view.draw(motion);
    view.azimuth = steady;
    drawn += 1;
    stage.dataset.frames = drawn;
    requestAnimationFrame(frame);
  }
  requestAnimationFrame(frame);
  stage.hairMotion = motion; // for scripts that measure the motion
  return () => { ended = true; view.close(); };
}
