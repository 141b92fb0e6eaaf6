// The fitted head over every photo, landmarks to drag, and the order of the photos.
import { get, make, onChange, outlineOf, say, send, state } from "./api.js";
import { HeadMove } from "./head_move.js";
import { Landmarks } from "./face_landmarks.js";
import { photoOf, PhotoStage, showNoPhotos } from "./photo_stage.js";
import { TurnOrder } from "./turn_order.js";

const LABEL = "Photo with the fitted head. Arrow keys move the chosen landmark, N chooses the "
  + "next; with the head chosen they move the head, Q and E turn it, R and F nod it, T and G turn "
  + "its face, plus and minus change its size.";
const MOVES_HEAD = "Drag the head; the round handle turns it, the square one changes its size. All "
  + "photos follow.";
const ORDER = "Towards the subject's left. Drag a photo, press ‹ or ›, or hold Alt and press an "
  + "arrow key.";
const NUDGES = [["Nod up", "r"], ["Nod down", "f"], ["Face left", "t"], ["Face right", "g"]];

export function show(main, argument) {
  const page = new PosePage();
  main.append(page.element);
  const first = () => page.open(photoOf(argument));
  const ends = [
    onChange(() => {
      if (state.result !== page.result) page.load();
      if (!page.shown && state.photos.length) first();
      page.order.follow();
    }),
    page.stage.watchSize(() => page.draw()),
    page.order.listen(),
  ];
  page.load();
  if (state.photos.length) first();
  else showNoPhotos(main);
  return () => { for (const end of ends) end(); };
}

class PosePage {
  constructor() {
    this.pose = null; // the fitted head in every photo, as the server drew it
    this.result = ""; // the hair whose pose that is
    this.shown = null;
    this.stage = new PhotoStage(LABEL);
    this.landmarks = new Landmarks(this.stage, () => this.draw());
    this.head = new HeadMove(this);
    this.order = new TurnOrder(this);
    this.tool = this.landmarks; // what pointers and keys move
    this.element = make("div", { class: "split" }, this.stage.element, this.side());
    this.listen();
  }

  side() {
    this.status = make("p", { role: "status", class: "quiet" });
    this.lights = make("ul", { class: "lights" });
    this.residual = make("p", { class: "quiet", "aria-live": "polite" });
    const points = () => this.mark(this.landmarks.points);
    this.keep = make("button", { class: "primary", onclick: points }, "Keep landmarks");
    const drop = make("button", { onclick: () => this.mark(null) }, "Use automatic ones");
    this.modes = [
      this.mode("points", this.landmarks, "Move landmarks"),
      this.mode("head", this.head, "Move the head"),
    ];
    const nudges = NUDGES.map(([name, key]) => make("button",
      { onclick: () => this.head.press(key, 1) }, name,
      make("kbd", { "aria-hidden": "true" }, key.toUpperCase())));
    const fit = () => this.head.place("PUT", {});
    this.fitted = make("button", { onclick: fit }, "As it was fitted");
    this.headTools = make("div", { class: "tools", hidden: true }, ...nudges, this.fitted);
    this.pointTools = make("div", { class: "tools" }, this.keep, drop);
    return make("section", { class: "side", "aria-label": "Pose", id: "head" },
      make("h2", {}, "Head and cameras"), this.status,
      make("div", { class: "tools" }, ...this.modes), this.pointTools, this.headTools,
      this.residual, this.lights, make("h2", {}, "Order of the turn"),
      make("p", { class: "quiet" }, ORDER), this.order.list);
  }

  mode(name, tool, text) {
    return make("button", {
      "aria-pressed": String(tool === this.tool), "data-moving": name,
      onclick: (event) => this.choose(tool, event.currentTarget),
    }, text);
  }

  choose(tool, pressed) {
    this.tool = tool;
    for (const button of this.modes) {
      button.setAttribute("aria-pressed", String(button === pressed));
    }
    this.headTools.hidden = tool !== this.head;
    this.pointTools.hidden = tool === this.head;
    this.stage.canvas.focus({ preventScroll: true });
    this.tell();
    this.draw();
  }

  listen() {
    const { canvas } = this.stage;
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      this.tool.take([event.offsetX, event.offsetY]);
    });
    canvas.addEventListener("pointermove", (event) =>
      this.tool.drag([event.offsetX, event.offsetY]));
    for (const kind of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(kind, () => this.tool.release(kind === "pointerup"));
    }
    canvas.addEventListener("keydown", (event) => this.tool.key(event));
  }

  viewOf(photo) {
    return this.pose?.views.find((view) => view.photo === photo.file) ?? null;
  }

  async load() {
    this.result = state.result;
    if (state.result) {
      try { this.pose = await get("/api/pose"); } catch (error) { say(error.message); }
    }
    this.lights.replaceChildren(...(this.pose?.health ?? []).map(([light, line]) =>
      make("li", { class: light }, line.replace(`${light} `, "").trim())));
    this.order.fill();
    this.tell();
    this.draw();
  }

  async open(photo) {
    this.shown = photo;
    this.landmarks.points = null;
    this.order.press(photo);
    this.stage.open(photo, () => this.draw());
    try {
      const found = await outlineOf(photo);
      if (this.shown !== photo) return;
      this.stage.facts = found;
      this.landmarks.points = found.landmarks?.map((p) => [...p]) ?? null;
      const [presence, yaw] = found.face ?? [0, 0];
      this.status.textContent = this.landmarks.points
        ? `Face found (${Math.round(100 * presence)} % sure), seen from ${Math.round(yaw)}°. `
          + "Drag a point that is wrong."
        : "No face in this photo; none is needed from behind.";
      this.keep.disabled = !this.landmarks.points;
      this.tell();
    } catch (error) { say(error.message); }
    this.draw();
  }

  tell() {
    const miss = this.shown && missed(this.viewOf(this.shown), this.stage.facts);
    this.residual.textContent = miss == null ? ""
      : `The head's landmarks are ${miss.toFixed(1)} mm (root mean square) from those found here.`;
    this.stage.element.dataset.residual = miss == null ? "" : miss.toFixed(2);
    if (this.tool === this.head && this.shown) {
      this.status.textContent = this.viewOf(this.shown)
        ? MOVES_HEAD : "The head appears when the hair has been made.";
    }
    this.fitted.disabled = !this.pose?.moved;
  }

  draw() {
    const context = this.stage.begin();
    if (!this.shown) return;
    this.head.draw(context, this.tool === this.head);
    if (this.tool === this.landmarks) this.landmarks.draw(context);
  }

  async mark(points) {
    if (!this.shown) return;
    try {
      await send("PUT", `/api/photos/${this.shown.id}/landmarks`, { points });
      this.status.textContent = points
        ? "Kept; the hair is made again." : "Automatic landmarks are used.";
    } catch (error) { say(error.message); }
  }
}

// How far the head's landmarks are from those that were found, in millimetres.
function missed(view, found) {
  const seen = found?.landmarks?.slice(-(view?.landmarks.length ?? 0));
  if (!view?.landmarks.length || !seen) return null;
  const squares = view.landmarks.map(([u, v], i) =>
    (u * found.width - seen[i][0]) ** 2 + (v * found.height - seen[i][1]) ** 2);
  return Math.sqrt(squares.reduce((a, b) => a + b, 0) / squares.length) / view.per_mm;
}
