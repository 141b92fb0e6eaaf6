// Brushes over the hair: the strokes of the project, their settings, undo and redo.
import { get, make, say, send } from "./api.js";

const BRUSHES = {
  comb: "Comb", part: "Part", puff: "Puff up", smooth: "Smooth", curl: "Curl", cut: "Cut",
  lengthen: "Lengthen",
};
const FINEST_M = 0.002; // between places of a path
const KEPT = "undone strokes"; // in the storage of the tab, so that a reload loses none

export class HairBrush {
  constructor() {
    this.path = null; // places of the brush while it is down, metres
    this.strokes = [];
    const choose = ([name, words]) => make("option", { value: name }, words);
    this.choice = make("select", { "aria-label": "Brush" },
      make("option", { value: "" }, "No brush"), ...Object.entries(BRUSHES).map(choose));
    this.size = make("input", {
      type: "range", min: "1", max: "8", step: "0.5", value: "3",
      "aria-label": "Radius of the brush in centimetres",
    });
    this.mirror = make("input", { type: "checkbox", "aria-label": "Both sides" });
    this.undo = make("button", { type: "button", onclick: () => this.back() }, "Undo");
    this.redo = make("button", { type: "button", onclick: () => this.forth() }, "Redo");
    this.controls = [
      this.choice, make("label", {}, "Size", this.size),
      make("label", {}, "Both sides", this.mirror), this.undo, this.redo,
    ];
    this.load();
  }

  get name() { return this.choice.value; }

  get radius() { return Number(this.size.value) / 100; }

  async load() {
    try { this.strokes = (await get("/api/edits")).strokes; } catch (error) { say(error.message); }
    this.show();
  }

  show() {
    this.undo.disabled = !this.strokes.length;
    this.redo.disabled = !undone().length;
  }

  // Goes on to a place; returns where it was before and the way from there, null if too near.
  draw(at) {
    const last = this.path?.at(-1), way = last && at.map((v, k) => v - last[k]);
    if (way && Math.hypot(...way) < FINEST_M) return null;
    this.path = [...this.path ?? [], at];
    return way ? { last, way } : null;
  }

  drop() { this.path = null; }

  lift() {
    if (!this.path) return;
    const stroke = {
      brush: this.name, radius: this.radius, mirror: this.mirror.checked, path: this.path,
    };
    this.path = null;
    keep([]);
    this.send([...this.strokes, stroke]);
  }

  back() {
    keep([...undone(), this.strokes.at(-1)]);
    this.send(this.strokes.slice(0, -1));
  }

  forth() {
    const again = undone();
    const stroke = again.pop();
    keep(again);
    this.send([...this.strokes, stroke]);
  }

  async send(strokes) {
    const before = this.strokes;
    this.strokes = strokes;
    this.show();
    try {
      await send("PUT", "/api/edits", { strokes });
    } catch (error) {
      this.strokes = before;
      this.show();
      say(error.message);
    }
  }
}

function undone() { return JSON.parse(sessionStorage.getItem(KEPT) ?? "[]"); }

function keep(strokes) { sessionStorage.setItem(KEPT, JSON.stringify(strokes)); }
