// Strands as they are followed in a photo, live with their parameters; colour, width and curl.
import { get, make, onChange, refill, say, send, state } from "./api.js";
import { fillStrip, photoOf, showNoPhotos } from "./photo_stage.js";

const SETTLED_MS = 120; // after the last move of a slider, before the picture is asked for
const WIDE = 20; // a range with bounds of this ratio is set on a logarithmic scale
const LOOKS = {
  root_colour: { name: "Colour at the roots", type: "color" },
  tip_colour: { name: "Colour at the tips", type: "color" },
  width_mm: { name: "Width of a strand, mm", type: "number", min: 0.01, max: 1, step: 0.005 },
  curl_radius_mm: { name: "Radius of the waves, mm", type: "number", min: 0, max: 50, step: 0.5 },
  curl_pitch_mm: { name: "Length of a wave, mm", type: "number", min: 1, max: 500, step: 1 },
};

export function show(main, argument) {
  const page = new StrandsPage();
  main.append(page.element);
  const started = () => { if (!page.started && state.photos.length) page.start(argument); };
  const stop = onChange(() => { page.follow(); started(); });
  if (state.photos.length) started();
  else showNoPhotos(main);
  return () => { stop(); page.leave(); };
}

class StrandsPage {
  constructor() {
    this.photo = null;
    this.choices = null; // the options with their bounds, and what was measured
    this.values = {}; // of the options
    this.hair = {}; // what is chosen of it; null is as measured
    this.known = state.result; // the hair that `choices` were measured in
    this.asked = 0; // pictures that were asked for since the last one came
    this.picture = ""; // its address
    this.started = false;
    this.image = make("img", { alt: "" });
    this.lines = make("img",
      { alt: "Strands that were found, coloured by direction", class: "lines" });
    this.stage = make("section", { class: "stage both", "aria-label": "Photo" },
      this.image, this.lines);
    this.element = make("div", { class: "split" }, this.stage, this.side());
  }

  side() {
    this.strip = make("div", { class: "strip", role: "group", "aria-label": "Photos" });
    this.status = make("p", { role: "status", class: "quiet" });
    this.sliders = make("div", { class: "column-of" });
    this.looks = make("div", { class: "column-of" });
    const usual = make("button", { onclick: () => this.takeUsual() }, "Usual parameters");
    return make("section", { class: "side", "aria-label": "Strands" }, this.strip, this.status,
      make("h2", {}, "How strands are followed"), this.sliders, usual, make("h2", {}, "The hair"),
      make("p", { class: "quiet" }, "Measured in the photos unless you choose it."), this.looks);
  }

  async start(argument) {
    this.started = true;
    try {
      this.choices = await get("/api/choices");
      this.values = this.optionsBy("value");
      this.hair = { ...this.choices.hair };
      this.fill();
    } catch (error) { say(error.message); }
    this.open(photoOf(argument));
  }

  leave() {
    clearTimeout(this.timer);
    URL.revokeObjectURL(this.picture);
  }

  optionsBy(field) {
    return Object.fromEntries(this.choices.options.map((option) => [option.name, option[field]]));
  }

  // New hair was measured anew.
  async follow() {
    if (state.result === this.known) return;
    this.known = state.result;
    try {
      const { found } = await get("/api/choices");
      this.choices = { ...this.choices, found };
      this.fill();
    } catch { /* the next hair may do */ }
  }

  takeUsual() {
    this.values = this.optionsBy("usual");
    this.keep();
    this.fill();
    this.look();
  }

  fill() {
    refill(this.sliders, ...this.choices.options.map((option) => this.slider(option)));
    refill(this.looks, ...Object.entries(LOOKS).map(([key, look]) => this.chooser(key, look)));
  }

  slider(option) {
    const { name, doc, low, high, whole } = option;
    const shown = make("output", {}, String(this.values[name]));
    const spoken = () => `${this.values[name]} ${option.unit ?? ""}`;
    const log = low > 0 && high / low > WIDE;
    const to = log ? Math.log : (v) => v, from = log ? Math.exp : (v) => v;
    const input = make("input", {
      type: "range", min: to(low), max: to(high), value: to(this.values[name]), title: doc,
      step: whole && !log ? 1 : (to(high) - to(low)) / 200,
      "aria-label": doc, "aria-valuetext": spoken(),
      oninput: () => {
        const value = from(Number(input.value));
        const inside = Math.min(high, Math.max(low, value));
        this.values[name] = whole ? Math.round(value) : Number(inside.toPrecision(3));
        shown.textContent = this.values[name];
        input.setAttribute("aria-valuetext", spoken());
        clearTimeout(this.timer);
        this.timer = setTimeout(() => this.look(), SETTLED_MS);
      },
      onchange: () => this.keep(),
    });
    return make("label", { class: "valued", title: name }, doc.replace(/\.$/, ""), shown, input);
  }

  chooser(key, { name, ...kind }) {
    const chosen = this.hair[key];
    const set = (value) => { this.hair[key] = value; this.keep(); this.fill(); };
    const read = () => (kind.type === "color" ? input.value
      : input.value === "" ? null : Number(input.value));
    const input = make("input", {
      ...kind, "data-key": key, value: chosen ?? this.choices.found?.[key] ?? "",
      onchange: () => set(read()),
    });
    const measured = make("button", {
      class: "plain", disabled: chosen == null, "aria-label": `${name}: as measured`,
      onclick: () => set(null),
    }, chosen == null ? "measured" : "Measured");
    return make("label", { class: "chosen" }, name,
      make("span", { class: "row" }, input, measured));
  }

  async keep() {
    try {
      await send("PUT", "/api/choices", { options: this.values, hair: this.hair });
      this.status.textContent = "Kept; the hair is made again.";
    } catch (error) {
      say(error.message);
      this.status.textContent = error.message;
    }
  }

  // Only the latest request's picture is shown; one is under way at a time.
  async look() {
    if (!this.photo) return;
    this.asked += 1;
    if (this.asked > 1) return;
    do {
      this.asked = 1;
      await this.draw(this.photo).catch((error) => { this.status.textContent = error.message; });
    } while (this.asked > 1);
    this.asked = 0;
  }

  async draw(photo) {
    const began = performance.now();
    const [brightness, contrast] = photo.tone;
    const response = await fetch(`/api/photos/${photo.id}/strands`, {
      method: "POST", headers: { "Content-Type": "application/json" },
      body: JSON.stringify({ options: this.values, tone: { brightness, contrast } }),
    });
    if (!response.ok) throw new Error((await response.json()).error);
    const made = URL.createObjectURL(await response.blob());
    if (photo !== this.photo) return;
    URL.revokeObjectURL(this.picture);
    this.lines.src = this.picture = made;
    const { dataset } = this.stage;
    dataset.strandsMs = Math.round(performance.now() - began);
    dataset.drawn = Number(dataset.drawn ?? 0) + 1;
  }

  open(photo) {
    this.photo = photo;
    history.replaceState(null, "", `#strands/${photo.id}`);
    this.image.src = `/api/photos/${photo.id}/large?v=${photo.version}`;
    this.image.style.filter = `brightness(${photo.tone[0]}) contrast(${photo.tone[1]})`;
    this.lines.removeAttribute("src");
    fillStrip(this.strip, photo, (next) => this.open(next));
    this.look();
  }
}
