// A guided turn with a camera: an outline to fill, a ring that fills, an automatic shutter.
import { get, make, say, send, state } from "./api.js";
import { Camera } from "./camera.js";
import { Compass } from "./compass.js";
import { difference, measure } from "./picture_light.js";
import {
  direction, drawOutline, drawRing, exampleItems, makeOutline, makeRing,
} from "./turn_guides.js";
import { Voice } from "./voice.js";

const COUNTS = [8, 12, 16, 24];
const READY_S = 0.7; // seconds for which all must be right before the shutter releases itself
const CHECK_MS = 160;
const LOOKED_MS = 3000; // how long the server's word about a picture counts
const SHOWN_MS = 1500; // the word after a shot stays this long, so that it can be read
const NAMED_VIEWS = 9; // of turns with as many guides or fewer photos keep the view's name
const HELP = "Head into the outline, top of the hair below the dashed line, the same distance all "
  + "around. Good: window light, plain wall, hair loose. Bad: lamp behind, zoom, a hat.";
const ALONE = "Only this machine can open the studio now. End it with Ctrl-C and start it with "
  + "--lan; then the code is here.";

export function show(main) {
  const page = new CapturePage();
  main.append(page.element);
  const key = (event) => {
    const { target } = event;
    const control = target instanceof HTMLButtonElement || target instanceof HTMLSelectElement;
    if (event.key !== " " || control) return;
    event.preventDefault();
    page.press();
  };
  addEventListener("keydown", key);
  const deaf = page.compass.listen();
  send("PUT", "/api/hold", { held: true }).catch(() => {});
  page.load().then(() => { if (!page.camera.left) page.start(); });
  return () => {
    page.leave();
    deaf();
    removeEventListener("keydown", key);
    send("PUT", "/api/hold", { held: false }).catch(() => {});
  };
}

class CapturePage {
  constructor() {
    this.guides = []; // the views of the turn
    this.at = 0; // index of the next one
    this.taken = new Map(); // photos by index of their view
    [this.advice, this.limits] = [{}, {}];
    this.goodFor = 0; // seconds
    this.shownUntil = 0; // milliseconds of performance.now()
    this.busy = false; // a photo is being taken
    this.automatic = true;
    this.pressed = false; // the turn has begun
    this.before = null; // grey levels of the last picture
    this.looking = false;
    this.looked = { at: -1, time: 0, found: [] }; // what the server said last
    this.camera = new Camera();
    this.compass = new Compass();
    this.voice = new Voice("Starting the camera…");
    this.element = make("div", { class: "split" }, this.makeStage(), this.makeSide());
  }

  makeStage() {
    this.guide = makeOutline();
    this.ring = makeRing();
    const shutter = make("button", {
      class: "shutter", "aria-label": "Take the photo", title: "Space",
      onclick: () => this.press(),
    });
    this.stage = make("section", { class: "stage", "aria-label": "Camera" },
      make("div", { class: "finder" }, this.camera.video, this.guide), this.voice.hint,
      make("div", { class: "overlay" }, shutter), this.ring);
    return this.stage;
  }

  makeSide() {
    this.count = make("select", { onchange: () => this.load() },
      ...COUNTS.map((n) => make("option", { value: n }, `${n} views`)));
    this.cameras = make("select", { onchange: () => this.start(this.cameras.value) });
    const cameras = make("label", { hidden: true }, "Camera", this.cameras);
    const retake = make("button", { onclick: () => this.skip(-1) }, "Back one");
    const skip = make("button", { onclick: () => this.skip(1) }, "Next view");
    this.finish = make("a", { class: "button primary", href: "#photos" }, "Done");
    const phone = make("button", { onclick: () => this.pair() }, "Use a phone");
    this.paired = make("div", { class: "code" });
    this.examples = make("ul", { class: "examples", "aria-label": "Right and wrong pictures" });
    return make("section", { class: "side", "aria-label": "The turn", id: "turn" },
      make("div", { class: "row" }, make("label", {}, "Turn", this.count), cameras),
      make("div", { class: "tools" }, toggle("Automatic", (on) => { this.automatic = on; }),
        toggle("Voice", (on) => { this.voice.aloud = on; }), retake, skip),
      make("div", { class: "pair" }, this.finish, phone), this.paired,
      make("p", { class: "quiet" }, HELP), this.examples);
  }

  async load() {
    try {
      const guides = get(`/api/guides/${this.count.value}?above`);
      const [found, said] = await Promise.all([guides, get("/api/feedback")]);
      this.guides = found.guides;
      ({ advice: this.advice, limits: this.limits } = said);
      this.examples.replaceChildren(...exampleItems(said.examples, said.advice));
      this.taken = new Map(this.guides.flatMap(({ name }, i) => {
        const photo = state.photos.find((each) => each.view === name);
        return photo ? [[i, photo.id]] : [];
      }));
      this.at = Math.max(0, this.guides.findIndex((_, i) => !this.taken.has(i)));
      this.ready();
    } catch (error) { say(error.message); }
  }

  // Shows the next view, and says which it is, after a word about the last.
  ready(word = "") {
    const view = this.guides[this.at];
    if (!view) return;
    this.goodFor = 0;
    drawOutline(this.guide, view);
    const all = drawRing(this.ring, this.guides, this.taken, this.at);
    this.finish.textContent = all ? "Done: make the hair" : "Done";
    this.voice.tell(word + direction(view), undefined, true);
  }

  skip(step) {
    this.at = (this.at + this.guides.length + step) % this.guides.length;
    this.ready();
  }

  async start(device) {
    clearInterval(this.timer);
    try {
      const found = await this.camera.start(device);
      if (!found) return;
      this.cameras.replaceChildren(...found.map(({ deviceId, label }, i) =>
        make("option", { value: deviceId }, label || `Camera ${i + 1}`)));
      this.cameras.parentElement.hidden = found.length < 2;
      this.timer = setInterval(() => this.check(), CHECK_MS);
    } catch (error) { this.showMissing(error.message); }
  }

  showMissing(text) {
    this.stage.replaceChildren(make("div", { class: "empty" }, make("h2", {}, "No camera"),
      make("p", { class: "quiet" }, text),
      make("a", { class: "button primary", href: "#photos" }, "Choose photos")));
  }

  leave() {
    clearInterval(this.timer);
    this.camera.leave();
    this.voice.end();
  }

  // What is wrong with the picture of this moment, as far as the page can tell.
  judge() {
    const { camera, limits } = this;
    const { grey, mean, sharp } = measure(camera.video, camera.crop(), limits.width);
    const moved = difference(grey, this.before);
    this.before = grey;
    const { azimuth, elevation } = this.guides[this.at];
    const off = elevation === 0 ? this.compass.away(azimuth) : null;
    if (off !== null) this.stage.dataset.compass = Math.round(off);
    return Object.entries({
      too_dark: mean < limits.dark, too_bright: mean > limits.bright, moving: moved > limits.still,
      blurred: sharp < limits.sharp, wrong_angle: Math.abs(off) > 3 * limits.yaw,
    }).filter(([, wrong]) => wrong).map(([name]) => name);
  }

  // Faces and framing are judged by the server, from a small picture that it does not keep.
  async look() {
    this.looking = true;
    const at = this.at;
    const { azimuth, elevation } = this.guides[at];
    const picture = await this.camera.small();
    try {
      const { feedback } = await send("POST", `/api/look/${Math.round(azimuth)}`, picture);
      this.looked = { at, time: performance.now(), found: elevation ? [] : feedback };
    } catch { /* the next picture may do */ }
    this.looking = false;
  }

  check() {
    const resting = this.busy || document.hidden || performance.now() < this.shownUntil;
    if (resting || !this.camera.running || !this.guides.length) return;
    const found = this.judge();
    if (!found.length && !this.looking) this.look();
    const known = this.looked.at === this.at && performance.now() - this.looked.time < LOOKED_MS;
    if (known) found.push(...this.looked.found);
    const good = known && !found.length;
    this.guide.classList.toggle("right", good);
    this.guide.classList.toggle("above", found.includes("above_line"));
    this.stage.dataset.feedback = found.join(" ");
    for (const item of this.examples.children) {
      item.classList.toggle("now", item.dataset.example === (good ? "good" : found[0]));
    }
    if (good) { this.wait(); return; }
    this.goodFor = 0;
    if (found.length) this.voice.tell(...this.advice[found[0]]);
  }

  // All is right, the server agrees: releases the shutter when it has been so for a while.
  wait() {
    this.goodFor += CHECK_MS / 1000;
    const level = !this.guides[this.at].elevation;
    const alone = this.automatic && this.pressed && level;
    this.voice.tell(alone ? "Good, hold still" : "Good: press the shutter", "Good");
    if (alone && this.goodFor > READY_S && !this.taken.has(this.at)) this.take();
  }

  // The first shot is always the user's: it says that the turn begins.
  press() {
    this.pressed = true;
    return this.take();
  }

  async take() {
    if (this.busy || !this.camera.running) return;
    this.busy = true;
    this.voice.tell("Hold still…", "");
    const picture = await this.camera.sharpest(this.limits.width);
    this.compass.begin(this.guides[this.at].azimuth);
    try {
      await this.keep(picture, this.at);
      this.shownUntil = performance.now() + SHOWN_MS;
      this.stage.dataset.shots = Number(this.stage.dataset.shots ?? 0) + 1;
    } catch (error) { say(error.message); }
    this.goodFor = -1;
    this.busy = false;
  }

  // Sends the photo of a view and goes on to the next view that has none.
  async keep(picture, index) {
    const known = this.taken.get(index);
    const name = this.guides.length <= NAMED_VIEWS ? this.guides[index].name : "";
    const found = known
      ? await send("PUT", `/api/photos/${known}`, picture)
      : await send("POST", `/api/photos?view=${encodeURIComponent(name)}`, picture);
    this.taken.set(index, found.id);
    const wrong = (found.feedback ?? [])[0];
    const next = this.guides.findIndex((_, i) => i !== index && !this.taken.has(i));
    this.at = next < 0 ? index : next;
    const word = next < 0 ? "All views taken. " : "Taken. ";
    this.ready(wrong ? `Taken, but: ${this.advice[wrong][0]}. ` : word);
  }

  async pair() {
    try {
      const { link, qr } = await send("POST", "/api/pairing");
      const code = new DOMParser().parseFromString(qr, "image/svg+xml").documentElement;
      const local = /^https?:\/\/(127\.|localhost)/.test(link);
      this.paired.replaceChildren(...(local
        ? [make("p", { class: "quiet" }, ALONE)]
        : [code, make("p", { class: "address" }, link)]));
    } catch (error) { say(error.message); }
  }
}

function toggle(text, set) {
  const button = make("button", {
    "aria-pressed": "true",
    onclick: () => {
      const on = button.getAttribute("aria-pressed") !== "true";
      button.setAttribute("aria-pressed", String(on));
      set(on);
    },
  }, text);
  return button;
}
