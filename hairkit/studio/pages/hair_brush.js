// Brushes over the hair: the strokes of the project, their settings, undo and redo.
import { get, make, say, send } from "./api.js";

const FINEST_M = 0.002; // between places of a path
const AMOUNT = "Amount: from 0 to 1, metres or a share; 0.03 is 3 cm";
const KEPT = "undone strokes"; // in the storage of the tab, so that a reload loses none

export class HairBrush {
  constructor() {
    this.path = null; // places of the brush while it is down, metres
    this.strokes = [];
    this.choice = make("select", { "aria-label": "Brush", onchange: () => this.choose() },
      make("option", { value: "" }, "No brush"));
    this.group = make("select", { "aria-label": "Acts on" });
    this.size = make("input", {
      type: "range", min: "0.2", max: "8", step: "0.2", value: "3",
      "aria-label": "Radius of the brush in centimetres",
    });
    this.amount = make("input", {
      type: "number", min: "0", max: "1", step: "any", placeholder: "usual",
      "aria-label": "Amount: metres, or a share", title: AMOUNT,
    });
    this.colour = make("input", {
      type: "color", value: "#7a4a2a", "aria-label": "Colour of the dye",
    });
    this.mirror = make("input", { type: "checkbox", "aria-label": "Both sides" });
    this.undo = make("button", { type: "button", onclick: () => this.back() }, "Undo");
    this.redo = make("button", { type: "button", onclick: () => this.forth() }, "Redo");
    this.settings = [ // of a brush: on a phone there is no room for them without one
      this.group, make("label", {}, "Size", this.size), make("label", {}, "Amount", this.amount),
      make("label", {}, "Both sides", this.mirror), this.colour,
    ];
    for (const setting of this.settings) setting.hidden = true;
    this.controls = [this.choice, ...this.settings, this.undo, this.redo];
    this.load();
  }

  get name() { return this.choice.value; }

  get onSkin() { return this.group.value !== "hair"; }

  get radius() { return Number(this.size.value) / 100; }

  // Lets the studio read the hair before the first stroke, by one that reaches none.
  choose() {
    for (const setting of this.settings) setting.hidden = !this.name;
    this.colour.hidden = this.name !== "dye";
    if (!this.name) return;
    send("POST", "/api/edits/stroke", { stroke: { path: [[9, 9, 9]] } })
      .catch((error) => say(error.message));
  }

  async load() {
    try {
      const { strokes, brushes, groups } = await get("/api/edits");
      this.strokes = strokes;
      this.choice.append(...brushes.map(option));
      this.group.append(...groups.map(option));
    } catch (error) { say(error.message); }
    this.show();
  }

  show() {
    this.undo.disabled = !this.strokes.length;
    this.redo.disabled = !undone().length;
  }

  // Goes on to a place; returns whether it is far enough from the one before.
  draw(at) {
    if (!this.amount.validity.valid) {
      say(AMOUNT);
      return false;
    }
    const last = this.path?.at(-1);
    if (last && Math.hypot(...at.map((v, k) => v - last[k])) < FINEST_M) return false;
    this.path = [...this.path ?? [], at];
    return true;
  }

  // Shows what the stroke does so far, as the studio says; asks once at a time.
  async preview(motion) {
    this.more = Boolean(this.asked);
    if (this.asked) return;
    this.asked = this.stroke();
    const { guides, points, tints } = await send(
      "POST", "/api/edits/stroke", { stroke: this.asked },
    ).catch(() => ({ guides: [] })); // the whole preview says what is wrong
    this.asked = null;
    if (this.path) motion.show(guides, points, tints);
    if (this.path && this.more) this.preview(motion);
  }

  // The stroke as far as it is drawn.
  stroke() {
    const { name: brush, radius, path, amount: { value } } = this;
    const [group, mirror] = [this.group.value, this.mirror.checked];
    const amount = value ? Number(value) : null;
    return { brush, radius, mirror, group, path, amount, colour: this.colour.value };
  }

  drop(motion) {
    this.path = null;
    motion.show([]);
  }

  lift(motion) {
    if (!this.path) return;
    const stroke = this.stroke();
    this.path = null;
    motion.shown.clear(); // what is shown stays until the whole preview comes
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

function option(name) {
  return make("option", { value: name }, name[0].toUpperCase() + name.slice(1));
}

function undone() { return JSON.parse(sessionStorage.getItem(KEPT) ?? "[]"); }

function keep(strokes) { sessionStorage.setItem(KEPT, JSON.stringify(strokes)); }
