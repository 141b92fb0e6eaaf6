// The fitted head over a photo, moved, turned and resized by pointers and keys. All photos follow.
import { get, pathOf, say, send } from "./api.js";
import { dot } from "./photo_stage.js";

const HANDLE_PX = 26; // a handle is taken within this distance: a finger's width
const HEAD = 0.2; // the head is taken within this distance of its middle, over the photo's height
const REACH = { turn: [0, -0.2], size: [0.16, 0.12] }; // handles from there, over that height
const FAST = 5; // presses in one with Shift
const GROWTH = 1.005; // of a press
const KEYS = { // one press, in the photo that is shown: millimetres, degrees, growth
  ArrowLeft: { mm: [-1, 0] }, ArrowRight: { mm: [1, 0] },
  ArrowUp: { mm: [0, -1] }, ArrowDown: { mm: [0, 1] },
  q: { turn: [0, 0, -1] }, e: { turn: [0, 0, 1] }, r: { turn: [-1, 0, 0] }, f: { turn: [1, 0, 0] },
  t: { turn: [0, 1, 0] }, g: { turn: [0, -1, 0] },
  "+": { grow: GROWTH }, "=": { grow: GROWTH }, "-": { grow: 1 / GROWTH },
};
const STILL = { shift: [0, 0], turn_deg: [0, 0, 0], factor: 1 };
const HEAD_COLOUR = "#6fd08c", HANDLE_COLOUR = "#f0b45f", HAIR_COLOUR = "rgb(255 95 168 / 60%)";

export class HeadMove {
  // The page knows the photo that is shown and the pose, and takes a new one.
  constructor(page) {
    this.page = page;
    this.held = null; // what a pointer drags
    this.move = STILL; // how far it was dragged
    this.waiting = null; // a move that is not sent yet
    this.sending = false;
  }

  get view() {
    const { page } = this;
    return page.shown && page.viewOf(page.shown);
  }

  key(event) {
    const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    if (!KEYS[key] || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    this.press(key, event.shiftKey && key !== "+" ? FAST : 1);
  }

  press(key, times) {
    const { mm = [0, 0], turn = [0, 0, 0], grow = 1 } = KEYS[key];
    const { view, page: { stage: { facts } } } = this;
    if (!view || !facts) return;
    const share = times * view.per_mm;
    this.nudge({
      shift: [mm[0] * share / facts.width, mm[1] * share / facts.height],
      turn_deg: turn.map((value) => value * times), factor: grow ** times,
    });
  }

  // Moves are sent one after the other; those made meanwhile are put together.
  async nudge(change) {
    const before = this.waiting ?? STILL;
    this.waiting = {
      shift: before.shift.map((value, k) => value + change.shift[k]),
      turn_deg: before.turn_deg.map((value, k) => value + change.turn_deg[k]),
      factor: before.factor * change.factor, photo: this.page.shown.file,
    };
    if (this.sending) return;
    this.sending = true;
    while (this.waiting) {
      const body = this.waiting;
      this.waiting = null;
      await this.place("POST", body);
    }
    this.sending = false;
  }

  async place(method, body) {
    const { page } = this;
    try {
      const found = await send(method, "/api/head", body);
      page.pose = found.views ? found : await get("/api/pose");
      const { dataset } = page.stage.element;
      dataset.placed = Number(dataset.placed ?? 0) + 1;
    } catch (error) { say(error.message); }
    if (!this.held) this.move = STILL;
    page.tell();
    page.draw();
  }

  // Takes a handle, or the head between them.
  take(place) {
    this.held = null;
    if (!this.view || this.sending) return;
    const { stage } = this.page;
    const places = this.places(this.view);
    const away = (name) => {
      const [x, y] = stage.toPage(places[name]);
      return Math.hypot(x - place[0], y - place[1]);
    };
    const { scale, ph } = stage.placed();
    const near = away("middle") < HEAD * ph * scale ? "shift" : null;
    const kind = ["turn", "size"].find((name) => away(name) < HANDLE_PX) ?? near;
    if (kind) this.held = { kind, middle: places.middle, first: stage.toPhoto(place) };
  }

  drag(place) {
    if (!this.held) return;
    const { kind, first, middle } = this.held;
    const { pw, ph } = this.page.stage.placed();
    const now = this.page.stage.toPhoto(place);
    const [a, b] = [first, now].map((p) => [p[0] - middle[0], p[1] - middle[1]]);
    const turn = ((Math.atan2(b[1], b[0]) - Math.atan2(a[1], a[0])) * 180) / Math.PI;
    const growth = Math.hypot(...b) / Math.max(Math.hypot(...a), 1);
    this.move = { ...STILL, ...{
      shift: { shift: [(now[0] - first[0]) / pw, (now[1] - first[1]) / ph] },
      turn: { turn_deg: [0, 0, turn] },
      size: { factor: Math.max(0.5, Math.min(2, growth)) },
    }[kind] };
    this.page.draw();
  }

  release(kept) {
    if (!this.held) return;
    this.held = null;
    if (kept && this.move !== STILL) {
      this.nudge(this.move);
    } else {
      this.move = STILL;
      this.page.draw();
    }
  }

  // The head's middle as it was dragged, and the handles, in the photo.
  places(view) {
    const { pw, ph } = this.page.stage.placed();
    const middle = view.middle.map((value, k) => (value + this.move.shift[k]) * (k ? ph : pw));
    const of = ([x, y]) => [middle[0] + x * ph, middle[1] + y * ph];
    return { middle, turn: of(REACH.turn), size: of(REACH.size) };
  }

  draw(context, moved) {
    const { view, page: { stage } } = this;
    const { scale } = stage.placed();
    if (view) this.drawHead(context, view, scale);
    if (view && moved) this.drawHandles(context, view, scale);
    if (!moved || !stage.facts?.outline?.length) return;
    context.strokeStyle = HAIR_COLOUR;
    context.lineWidth = 1.2 / scale;
    context.stroke(new Path2D(pathOf(stage.facts.outline)));
  }

  drawHead(context, view, scale) {
    const { pw, ph } = this.page.stage.placed();
    const inPixels = (curve) => curve.map((value, i) => value * (i % 2 ? ph : pw));
    const [u, v] = inPixels(view.middle);
    context.save();
    context.translate(...this.places(view).middle);
    context.rotate((this.move.turn_deg[2] * Math.PI) / 180);
    context.scale(this.move.factor, this.move.factor);
    context.translate(-u, -v);
    context.strokeStyle = context.fillStyle = HEAD_COLOUR;
    context.lineWidth = 2.5 / scale;
    context.stroke(new Path2D(pathOf(view.outline.map(inPixels))));
    for (const point of view.landmarks) dot(context, inPixels(point), 2 / scale);
    context.restore();
  }

  drawHandles(context, view, scale) {
    const { middle, turn, size } = this.places(view);
    context.strokeStyle = context.fillStyle = HANDLE_COLOUR;
    context.lineWidth = 2 / scale;
    context.beginPath();
    context.moveTo(...turn);
    context.lineTo(...middle);
    context.lineTo(...size);
    context.stroke();
    dot(context, middle, 6 / scale);
    dot(context, turn, 11 / scale);
    context.fillRect(size[0] - 10 / scale, size[1] - 10 / scale, 20 / scale, 20 / scale);
  }
}
