// Strands as they are followed in a photo, live with their parameters; colour, width and curl of the hair.
import { get, make, onChange, refill, say, send, state } from "./api.js";

const SETTLED_MS = 120; // after the last move of a slider, before the picture is asked for
const LOOKS = {
  root_colour: { name: "Colour at the roots", type: "color" },
  tip_colour: { name: "Colour at the tips", type: "color" },
  width_mm: { name: "Width of a strand, mm", type: "number", min: 0.01, max: 1, step: 0.005 },
  curl_radius_mm: { name: "Radius of the waves, mm", type: "number", min: 0, max: 50, step: 0.5 },
  curl_pitch_mm: { name: "Length of a wave, mm", type: "number", min: 1, max: 500, step: 1 },
};

export function show(main, argument) {
  let photo = null, choices = null, values = {}, hair = {}, asked = 0, timer = 0, picture = "", known = state.result;
  const image = make("img", { alt: "" });
  const lines = make("img", { alt: "Strands that were found, coloured by direction", class: "lines" });
  const stage = make("section", { class: "stage both", "aria-label": "Photo" }, image, lines);
  const strip = make("div", { class: "strip", role: "group", "aria-label": "Photos" });
  const status = make("p", { role: "status", class: "quiet" });
  const sliders = make("div", { class: "column-of" });
  const looks = make("div", { class: "column-of" });
  const usual = make("button", { onclick: () => { values = Object.fromEntries(choices.options.map((o) => [o.name, o.usual])); keep(); fill(); look(); } }, "Usual parameters");
  main.append(make("div", { class: "split" }, stage, make("section", { class: "side", "aria-label": "Strands" },
    strip, status, make("h2", {}, "How strands are followed"), sliders, usual,
    make("h2", {}, "The hair"), make("p", { class: "quiet" }, "Measured in the photos unless you choose it."), looks)));

  async function load() {
    try {
      choices = await get("/api/choices");
      values = Object.fromEntries(choices.options.map((o) => [o.name, o.value]));
      hair = { ...choices.hair };
      fill();
    } catch (error) { say(error.message); }
  }

  function fill() {
    refill(sliders, ...choices.options.map((option) => {
      const shown = make("output", {}, String(values[option.name]));
      // A wide range is set on a logarithmic scale.
      const log = option.low > 0 && option.high / option.low > 20;
      const to = log ? Math.log : (v) => v, from = log ? Math.exp : (v) => v;
      const input = make("input", {
        type: "range", min: to(option.low), max: to(option.high), value: to(values[option.name]), title: option.doc,
        step: option.whole && !log ? 1 : (to(option.high) - to(option.low)) / 200,
        "aria-label": option.doc, "aria-valuetext": `${values[option.name]} ${option.unit ?? ""}`,
        oninput: () => {
          const value = from(Number(input.value));
          values[option.name] = option.whole ? Math.round(value) : Number(Math.min(option.high, Math.max(option.low, value)).toPrecision(3));
          shown.textContent = values[option.name];
          input.setAttribute("aria-valuetext", `${values[option.name]} ${option.unit ?? ""}`);
          clearTimeout(timer);
          timer = setTimeout(look, SETTLED_MS);
        },
        onchange: keep,
      });
      return make("label", { class: "valued", title: option.name }, option.doc.replace(/\.$/, ""), shown, input);
    }));
    refill(looks, ...Object.entries(LOOKS).map(([key, { name, ...kind }]) => {
      const own = hair[key] != null;
      const input = make("input", { ...kind, "data-key": key, value: hair[key] ?? choices.found?.[key] ?? "", onchange: () => { hair[key] = kind.type === "color" ? input.value : input.value === "" ? null : Number(input.value); keep(); fill(); } });
      const measured = make("button", { class: "plain", disabled: !own, "aria-label": `${name}: as measured`, onclick: () => { hair[key] = null; keep(); fill(); } }, own ? "Measured" : "measured");
      return make("label", { class: "chosen" }, name, make("span", { class: "row" }, input, measured));
    }));
  }

  async function keep() {
    try {
      await send("PUT", "/api/choices", { options: values, hair });
      status.textContent = "Kept; the hair is made again.";
    } catch (error) { say(error.message); status.textContent = error.message; }
  }

  // Only the latest request's picture is shown; one is under way at a time.
  async function look() {
    if (!photo) return;
    asked += 1;
    if (asked > 1) return;
    do {
      asked = 1;
      const of = photo, began = performance.now();
      try {
        const response = await fetch(`/api/photos/${of.id}/strands`, {
          method: "POST", headers: { "Content-Type": "application/json" },
          body: JSON.stringify({ options: values, tone: { brightness: of.tone[0], contrast: of.tone[1] } }),
        });
        if (!response.ok) throw new Error((await response.json()).error);
        const made = URL.createObjectURL(await response.blob());
        if (of === photo) {
          URL.revokeObjectURL(picture);
          lines.src = picture = made;
          stage.dataset.strandsMs = Math.round(performance.now() - began);
          stage.dataset.drawn = Number(stage.dataset.drawn ?? 0) + 1;
        }
      } catch (error) { status.textContent = error.message; }
    } while (asked > 1);
    asked = 0;
  }

  function open(next) {
    photo = next;
    history.replaceState(null, "", `#strands/${photo.id}`);
    image.src = `/api/photos/${photo.id}/large?v=${photo.version}`;
    image.style.filter = `brightness(${photo.tone[0]}) contrast(${photo.tone[1]})`;
    lines.removeAttribute("src");
    thumbnails();
    look();
  }

  function thumbnails() {
    refill(strip, ...state.photos.map((p, i) => make("button", {
      "aria-label": `Photo ${i + 1}`, "aria-pressed": String(p.id === photo?.id), onclick: () => open(p),
    }, make("img", { src: `/api/photos/${p.id}/small?v=${p.version}`, alt: "" }))));
  }

  let loading = false;
  function started() {
    if (photo || loading || !state.photos.length) return;
    loading = true;
    load().then(() => open(state.photos.find((p) => String(p.id) === argument) ?? state.photos[0]));
  }
  const stop = onChange(() => {
    if (state.result !== known) { known = state.result; get("/api/choices").then((found) => { choices = { ...choices, found: found.found }; fill(); }).catch(() => {}); }
    started();
  });
  if (state.photos.length) started();
  else main.replaceChildren(make("div", { class: "empty" }, make("h2", {}, "No photos yet"), make("a", { class: "button primary", href: "#photos" }, "Add photos")));
  return () => { stop(); clearTimeout(timer); URL.revokeObjectURL(picture); };
}
