// Masks corrected by a few strokes, which are kept in labelme's shape; the mask follows from them.
import { listenToKeys } from "./annotate_keys.js";
import { Pointers } from "./annotate_pointers.js";
import { forget, get, make, onChange, outlineOf, pathOf, say, send, state } from "./api.js";
import { Cross } from "./cross.js";
import { fillStrip, photoOf, PhotoStage, showNoPhotos } from "./photo_stage.js";
import { Strokes, TOOLS } from "./strokes.js";

const NEAR_PX = 14; // a stroke is removed within this distance
const BRUSH = { least: 0.005, most: 0.12, usual: 0.03 }; // radius over the photo's height
const LABEL = "Photo with the outline of the hair. Draw with the pointer, or press Enter for a "
  + "cross: arrow keys move it, Enter lowers and lifts the pen, Escape takes the cross away. "
  + "Letters choose tools.";
const HELP = "Correct only what is wrong: three strokes are usually enough. An edge brush paints "
  + "up to the strongest edge under it. Scroll or pinch to zoom, hold Space to move, H to see the "
  + "bare photo. Without a pointer: Enter on the photo shows a cross, arrow keys move it, Enter "
  + "lowers and lifts the pen. Strands are followed in the photo with this brightness and "
  + "contrast.";

export function show(main, argument) {
  const page = new MaskPage();
  main.append(page.element);
  const started = () => {
    if (!page.photo && state.photos.length) page.open(photoOf(argument));
  };
  const ends = [
    onChange(() => { started(); if (page.stage.facts) page.tell(); }),
    page.stage.watchSize(() => page.draw()),
    listenToKeys(page),
  ];
  page.choose(page.tool);
  started();
  if (!page.photo) showNoPhotos(main);
  return () => { for (const end of ends) end(); };
}

class MaskPage {
  constructor() {
    this.photo = null;
    this.tool = "foreground";
    this.brush = BRUSH.usual;
    [this.bright, this.contrast] = [1, 1];
    this.bare = false; // the photo is shown without lines
    this.moving = false; // pointers move the photo
    this.strokes = new Strokes();
    this.stage = new PhotoStage(LABEL);
    this.cross = new Cross(this);
    this.element = make("div", { class: "split" }, this.stage.element, this.side());
    this.pointers = new Pointers(this);
  }

  side() {
    this.status = make("p", { role: "status", class: "quiet" });
    this.buttons = Object.entries(TOOLS).map(([key, tool]) => this.button(key, tool));
    this.undo = make("button", { onclick: () => this.step(-1), title: "Ctrl+Z" }, "Undo");
    this.redo = make("button", { onclick: () => this.step(1), title: "Ctrl+Shift+Z" }, "Redo");
    this.size = this.slider("Brush size  [ ]", BRUSH.least, BRUSH.most, 0.005, "brush");
    const keep = () => this.keepTone();
    this.brightness = this.slider("Brightness", 0.5, 2, 0.05, "bright", keep);
    this.contrasts = this.slider("Contrast", 0.5, 2, 0.05, "contrast", keep);
    this.strip = make("div", { class: "strip", role: "group", "aria-label": "Photos" });
    return make("section", { class: "side", "aria-label": "Tools" }, this.strip,
      make("div", { class: "tools" }, ...this.buttons),
      make("div", { class: "tools" }, this.undo, this.redo), this.status,
      this.size, this.brightness, this.contrasts, make("p", { class: "quiet" }, HELP));
  }

  button(key, { name, key: letter }) {
    return make("button", {
      "aria-pressed": String(key === this.tool), "data-tool": key,
      title: `Key ${letter.toUpperCase()}`, onclick: () => this.choose(key),
    }, name, make("kbd", { "aria-hidden": "true" }, letter.toUpperCase()));
  }

  slider(name, min, max, step, field, keep) {
    const input = make("input", {
      type: "range", min, max, step, value: this[field],
      oninput: () => { this[field] = Number(input.value); this.draw(); },
      onchange: () => keep?.(),
    });
    return make("label", {}, name, input);
  }

  setBrush(radius) {
    this.brush = Math.max(BRUSH.least, Math.min(BRUSH.most, radius));
    this.size.lastChild.value = this.brush;
  }

  // The stage that follows strands sees the photo as it is shown here.
  async keepTone() {
    const tone = { brightness: this.bright, contrast: this.contrast };
    try {
      await send("PUT", `/api/photos/${this.photo.id}/tone`, tone);
    } catch (error) { say(error.message); }
  }

  choose(tool) {
    this.tool = tool;
    for (const button of this.buttons) {
      button.setAttribute("aria-pressed", String(button.dataset.tool === tool));
    }
    this.stage.canvas.style.cursor = tool === "erase" ? "pointer" : "crosshair";
  }

  async open(photo) {
    const { stage } = this;
    const strokes = this.strokes = new Strokes();
    this.photo = photo;
    history.replaceState(null, "", `#annotate/${photo.id}`);
    this.cross.at = null;
    [this.bright, this.contrast] = photo.tone ?? [1, 1];
    this.brightness.lastChild.value = this.bright;
    this.contrasts.lastChild.value = this.contrast;
    fillStrip(this.strip, photo, (next) => this.open(next));
    this.status.textContent = "Looking for hair…";
    stage.open(photo, () => this.draw());
    try {
      const kept = get(`/api/photos/${photo.id}/strokes`);
      const [document, facts] = await Promise.all([kept, outlineOf(photo)]);
      if (strokes !== this.strokes) return;
      strokes.shapes = document.shapes ?? [];
      strokes.recall(photo.id);
      stage.facts = facts;
      this.tell();
    } catch (error) { say(error.message); }
    this.draw();
  }

  tell() {
    const { shapes, undone } = this.strokes;
    const now = state.photos.find((photo) => photo.id === this.photo.id);
    const count = `${shapes.length} stroke${shapes.length > 1 ? "s" : ""}`;
    this.status.textContent = now?.problem ?? this.stage.facts?.problem
      ?? (shapes.length ? count : "Found automatically");
    this.undo.disabled = !shapes.length;
    this.redo.disabled = !undone.length;
  }

  draw() {
    const { stage } = this;
    const context = stage.begin(`brightness(${this.bright}) contrast(${this.contrast})`);
    const { scale, ph } = stage.placed();
    if (stage.facts?.outline?.length && !this.bare) {
      const path = new Path2D(pathOf(stage.facts.outline));
      context.fillStyle = "rgb(255 95 168 / 26%)";
      context.fill(path, "evenodd");
      context.strokeStyle = "#ff5fa8";
      context.lineWidth = 1.8 / scale;
      context.stroke(path);
    }
    if (!this.bare) this.strokes.draw(context, scale, ph);
    if (this.cross.at) this.cross.draw(context, scale);
  }

  // A point in the photo, to a tenth of a pixel.
  inside(point) {
    const { pw, ph } = this.stage.placed();
    return point.map((value, k) =>
      Math.round(10 * Math.max(0, Math.min(k ? ph : pw, value))) / 10);
  }

  begin(point) {
    const { stage, strokes } = this;
    if (this.tool !== "erase") {
      const radius = Math.round(10 * this.brush * stage.facts.height) / 10;
      strokes.begin(this.tool, point, radius);
    } else if (strokes.erase(point, NEAR_PX / stage.placed().scale)) {
      this.save();
      this.draw();
    }
  }

  end(kept) {
    const { strokes } = this;
    if (!strokes.current) return;
    if (!kept) strokes.current = null;
    else if (strokes.end()) this.save();
    this.draw();
  }

  step(direction) {
    if (!this.strokes.step(direction)) return;
    this.save();
    this.draw();
  }

  // One request of a photo at a time; what is drawn meanwhile goes with the next.
  async save() {
    this.strokes.keep(this.photo.id);
    const { photo, strokes, stage: { facts } } = this;
    this.tell();
    strokes.unsaved = true;
    if (strokes.saving) return;
    strokes.saving = true;
    while (strokes.unsaved) {
      strokes.unsaved = false;
      if (strokes === this.strokes) this.status.textContent = "…";
      await this.send(photo, strokes, facts).catch((error) => say(error.message));
    }
    strokes.saving = false;
  }

  async send(photo, strokes, { width, height }) {
    const { stage } = this;
    const began = performance.now();
    const found = await send("PUT", `/api/photos/${photo.id}/strokes`, {
      version: "5.0.0", flags: { corrects: true }, shapes: strokes.shapes,
      imagePath: photo.file, imageData: null, imageWidth: width, imageHeight: height,
    });
    forget(photo.id);
    if (strokes !== this.strokes) return;
    stage.facts = { ...stage.facts, problem: undefined, ...found };
    stage.element.dataset.outlineMs = Math.round(performance.now() - began);
    this.tell();
    this.draw();
  }
}
