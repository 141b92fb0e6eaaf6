// A guided turn with a camera: an outline to fill, a ring that fills, a shutter that releases itself.
import { get, make, onChange, pathOf, say, send, state } from "./api.js";

const COUNTS = [8, 12, 16, 24];
const READY_S = 0.7; // seconds for which all must be right before the shutter releases itself
const AGAIN_S = 2.2; // seconds between two spoken prompts
const CHECK_MS = 160;
const BURST = 3, BURST_MS = 110; // pictures of which the sharpest is taken, and the time between two
const LOOK_WIDTH = 300, LOOKED_MS = 3000; // small pictures for the server, and how long its word counts
const SHOWN_MS = 1500; // the word after a shot stays this long, so that it can be read
const directions = {
  front: "look at the camera", left: "left side to the camera", back: "back to the camera",
  right: "right side to the camera", top: "from above the forehead",
};

export function show(main) {
  let stream = null, guides = [], at = 0, taken = new Map(), advice = {}, limits = {}, timer = 0;
  let goodFor = 0, shownUntil = 0, lastSpoken = 0, lastText = "", busy = false, before = null, automatic = true, aloud = true;
  let looking = false, left = false, pressed = false, looked = { at: -1, time: 0, found: [] };
  let heading = null, headingAtFront = null, zeroOffset = 0;

  const video = make("video", { playsinline: true, muted: true, autoplay: true, "aria-label": "Picture of the camera" });
  video.muted = true;
  const guide = make("svg", { class: "guide", viewBox: "0 0 3 4", preserveAspectRatio: "xMidYMid meet", "aria-hidden": "true" });
  const hint = make("p", { class: "hint", role: "status", "aria-live": "polite" }, "Starting the camera…");
  const shutter = make("button", { class: "shutter", "aria-label": "Take the photo", title: "Space", onclick: () => press() });
  const ring = make("svg", { class: "ring", viewBox: "0 0 200 200", role: "img", "aria-label": "Views taken" });
  const finder = make("div", { class: "finder" }, video, guide);
  const stage = make("section", { class: "stage", "aria-label": "Camera" }, finder, hint, make("div", { class: "overlay" }, shutter), ring);
  const count = make("select", { onchange: () => load() }, ...COUNTS.map((n) => make("option", { value: n }, `${n} views`)));
  const auto = make("button", { "aria-pressed": "true", onclick: () => { automatic = !automatic; auto.setAttribute("aria-pressed", String(automatic)); } }, "Automatic");
  const voice = make("button", { "aria-pressed": "true", onclick: () => { aloud = !aloud; voice.setAttribute("aria-pressed", String(aloud)); } }, "Voice");
  const cameras = make("select", { hidden: true, onchange: () => start(cameras.value) });
  const retake = make("button", { onclick: () => { at = (at + guides.length - 1) % guides.length; ready(); } }, "Back one");
  const skip = make("button", { onclick: () => { at = (at + 1) % guides.length; ready(); } }, "Next view");
  const finish = make("a", { class: "button primary", href: "#photos" }, "Done");
  const phone = make("button", { onclick: pair }, "Use a phone");
  const paired = make("div", { class: "code" });
  const examples = make("ul", { class: "examples", "aria-label": "Right and wrong pictures" });
  main.append(make("div", { class: "split" }, stage, make("section", { class: "side", "aria-label": "The turn", id: "turn" },
    make("div", { class: "row" }, make("label", {}, "Turn", count), make("label", {}, "Camera", cameras)),
    make("div", { class: "tools" }, auto, voice, retake, skip), make("div", { class: "pair" }, finish, phone), paired,
    make("p", { class: "quiet" }, "Head into the outline, top of the hair below the dashed line, the same distance all around. Good: window light, plain wall, hair loose. Bad: lamp behind, zoom, a hat."), examples)));

  async function load() {
    try {
      const [found, said] = await Promise.all([get(`/api/guides/${count.value}?above`), get("/api/feedback")]);
      guides = found.guides;
      ({ advice, limits } = said);
      examples.replaceChildren(...said.examples.map((name) => make("li", { "data-example": name, class: name === "good" ? "right" : "" },
        make("img", { src: `/example-${name}.jpg`, alt: "", width: 90, height: 120 }),
        make("span", {}, name === "good" ? "✓ Right" : `✗ ${advice[name][0].split(":")[0]}`))));
      taken = new Map(guides.flatMap((g, i) => {
        const photo = state.photos.find((p) => p.view === g.name);
        return photo ? [[i, photo.id]] : [];
      }));
      at = Math.max(0, guides.findIndex((_, i) => !taken.has(i)));
      ready();
    } catch (error) { say(error.message); }
  }

  // Shows the next view, and says which it is, after a word about the last.
  function ready(word = "") {
    const view = guides[at];
    if (!view) return;
    goodFor = 0;
    guide.replaceChildren(
      ...view.outline.map((curve) => make("path", { d: pathOf([curve.map((v, i) => v * (i % 2 ? 4 : 3))], false) })),
      make("line", { x1: 0.3, x2: 2.7, y1: 4 * view.top, y2: 4 * view.top }));
    drawRing();
    const next = `${view.name}: ${directions[view.name] ?? "turn to the outline"}`;
    tell(word + next[0].toUpperCase() + next.slice(1), undefined, true);
  }

  function drawRing() {
    const turn = guides.filter((g) => !g.elevation);
    const place = (angle, radius) => `${100 + radius * Math.sin(angle)} ${100 + radius * Math.cos(angle)}`;
    ring.replaceChildren(...turn.map((g, i) => {
      const half = Math.PI / turn.length - 0.05, angle = (g.azimuth * Math.PI) / 180;
      return make("path", {
        class: taken.has(i) ? "taken" : i === at ? "next" : "",
        d: `M${place(angle - half, 84)}A84 84 0 0 0 ${place(angle + half, 84)}`,
      });
    }));
    const number = make("text", { x: 100, y: 108 }, `${taken.size} / ${turn.length}`);
    const name = make("text", { class: "small", x: 100, y: 130 }, guides[at]?.name ?? "");
    ring.append(number, name);
    ring.setAttribute("aria-label", `${taken.size} of ${turn.length} views taken, next: ${guides[at]?.name}`);
    finish.textContent = taken.size >= turn.length ? "Done: make the hair" : "Done";
  }

  // What is said of the next view is not held back, and ends what is being said.
  function tell(text, spoken = text, atOnce = false) {
    if (hint.textContent !== text) hint.textContent = text;
    const now = performance.now() / 1000;
    if (aloud && spoken && window.speechSynthesis && (atOnce || (spoken !== lastText && now - lastSpoken > AGAIN_S))) {
      if (atOnce) speechSynthesis.cancel();
      speechSynthesis.speak(new SpeechSynthesisUtterance(spoken));
      lastText = spoken;
      lastSpoken = now;
    }
  }

  async function start(device) {
    stopStream();
    if (!window.isSecureContext || !navigator.mediaDevices) {
      missing("This page was opened over plain HTTP from another machine, and browsers give such pages no camera. Start the studio with --lan and scan its code, or choose photos.");
      return;
    }
    try {
      stream = await navigator.mediaDevices.getUserMedia({
        audio: false,
        video: { facingMode: { ideal: "environment" }, width: { ideal: 1920 }, height: { ideal: 1440 }, ...(device ? { deviceId: { exact: device } } : {}) },
      });
      video.srcObject = stream;
      await video.play();
      const found = (await navigator.mediaDevices.enumerateDevices()).filter((d) => d.kind === "videoinput");
      if (left) { stopStream(); return; } // the page was left before the camera had started
      cameras.replaceChildren(...found.map((d, i) => make("option", { value: d.deviceId }, d.label || `Camera ${i + 1}`)));
      cameras.parentElement.hidden = found.length < 2;
      cameras.hidden = false;
      timer = setInterval(check, CHECK_MS);
    } catch (error) {
      if (left) { stopStream(); return; }
      const reasons = {
        NotAllowedError: "The camera is blocked for this page. Allow it beside the address, or choose photos.",
        NotFoundError: "This machine has no camera. Use a phone, or choose photos.",
        NotReadableError: "Another program uses the camera. Close it, or choose photos.",
      };
      missing(reasons[error.name] ?? `The camera does not start (${error.message}).`);
    }
  }

  function missing(text) {
    stage.replaceChildren(make("div", { class: "empty" }, make("h2", {}, "No camera"), make("p", { class: "quiet" }, text),
      make("a", { class: "button primary", href: "#photos" }, "Choose photos")));
  }

  // The middle of the picture with sides 3 : 4, which is what is taken and where the outline is.
  function crop() {
    const w = video.videoWidth, h = video.videoHeight;
    const wide = w / h > 3 / 4;
    const width = wide ? Math.round((h * 3) / 4) : w, height = wide ? h : Math.round((w * 4) / 3);
    return [Math.round((w - width) / 2), Math.round((h - height) / 2), width, height];
  }

  const small = make("canvas");
  // Light and sharpness of a picture, and its grey levels, at the width that the limits are for.
  function measure(source, [x, y, w, h]) {
    small.width = limits.width;
    small.height = Math.round((limits.width * h) / w);
    const context = small.getContext("2d", { willReadFrequently: true });
    context.drawImage(source, x, y, w, h, 0, 0, small.width, small.height);
    const { data } = context.getImageData(0, 0, small.width, small.height);
    const grey = new Float32Array(small.width * small.height);
    let sum = 0;
    for (let i = 0; i < grey.length; i += 1) {
      grey[i] = 0.299 * data[4 * i] + 0.587 * data[4 * i + 1] + 0.114 * data[4 * i + 2];
      sum += grey[i];
    }
    let edges = 0, squares = 0, count = 0;
    for (let v = 1; v < small.height - 1; v += 1) {
      for (let u = 1; u < small.width - 1; u += 1) {
        const i = v * small.width + u;
        const edge = grey[i - 1] + grey[i + 1] + grey[i - small.width] + grey[i + small.width] - 4 * grey[i];
        edges += edge; squares += edge * edge; count += 1;
      }
    }
    return { grey, mean: sum / grey.length, sharp: squares / count - (edges / count) ** 2 };
  }

  // The sharpest of a few pictures in a row.
  async function sharpest() {
    let best = null;
    for (let k = 0; k < BURST; k += 1) {
      if (k) await new Promise((done) => { setTimeout(done, BURST_MS); });
      const [x, y, w, h] = crop();
      const picture = make("canvas", { width: w, height: h });
      picture.getContext("2d").drawImage(video, x, y, w, h, 0, 0, w, h);
      const { sharp } = measure(picture, [0, 0, w, h]);
      if (!best || sharp > best.sharp) best = { picture, sharp };
    }
    return new Promise((done) => { best.picture.toBlob(done, "image/jpeg", 0.95); });
  }

  function judge() {
    const { grey, mean, sharp } = measure(video, crop());
    const moved = before?.length === grey.length ? grey.reduce((sum, value, i) => sum + Math.abs(value - before[i]), 0) / grey.length : Infinity;
    before = grey;
    const found = [];
    if (mean < limits.dark) found.push("too_dark");
    if (mean > limits.bright) found.push("too_bright");
    if (moved > limits.still) found.push("moving");
    if (sharp < limits.sharp) found.push("blurred");
    const wanted = guides[at]?.azimuth ?? 0;
    if (heading !== null && headingAtFront !== null && guides[at]?.elevation === 0) {
      const off = ((heading - headingAtFront - zeroOffset + wanted + 540) % 360) - 180;
      stage.dataset.compass = Math.round(off);
      if (Math.abs(off) > 3 * limits.yaw) found.push("wrong_angle");
    }
    return found;
  }

  // Faces and framing are judged by the server, from a small picture that it does not keep.
  async function look() {
    looking = true;
    const index = at, [x, y, w, h] = crop();
    const picture = make("canvas", { width: LOOK_WIDTH, height: Math.round((LOOK_WIDTH * h) / w) });
    picture.getContext("2d").drawImage(video, x, y, w, h, 0, 0, picture.width, picture.height);
    const blob = await new Promise((done) => { picture.toBlob(done, "image/jpeg", 0.8); });
    try {
      const { feedback } = await send("POST", `/api/look/${Math.round(guides[index].azimuth)}`, blob);
      looked = { at: index, time: performance.now(), found: guides[index].elevation ? [] : feedback };
    } catch { /* the next picture may do */ }
    looking = false;
  }

  function check() {
    if (busy || !video.videoWidth || !guides.length || document.hidden || performance.now() < shownUntil) return;
    const found = judge();
    const known = looked.at === at && performance.now() - looked.time < LOOKED_MS;
    if (!found.length && !looking) look();
    if (looked.at === at) found.push(...looked.found);
    guide.classList.toggle("right", !found.length);
    guide.classList.toggle("above", found.includes("above_line"));
    stage.dataset.feedback = found.join(" ");
    for (const item of examples.children) item.classList.toggle("now", item.dataset.example === (found[0] ?? "good"));
    if (found.length) {
      goodFor = 0;
      const [shown, spoken] = advice[found[0]];
      tell(shown, spoken);
      return;
    }
    goodFor += CHECK_MS / 1000;
    tell(automatic && pressed && !guides[at].elevation ? "Good, hold still" : "Good: press the shutter", "Good");
    if (automatic && goodFor > READY_S && known && pressed && !guides[at].elevation && !taken.has(at)) take();
  }

  // The first shot is always the user's: it says that the turn begins.
  function press() {
    pressed = true;
    return take();
  }

  async function take() {
    if (busy || !video.videoWidth) return;
    busy = true;
    tell("Hold still…", "");
    const blob = await sharpest();
    const view = guides[at], index = at;
    if (headingAtFront === null && heading !== null) { headingAtFront = heading; zeroOffset = view.azimuth; }
    try {
      const known = taken.get(index);
      const found = known
        ? await send("PUT", `/api/photos/${known}`, blob)
        : await send("POST", `/api/photos?view=${encodeURIComponent(guides.length <= 9 ? view.name : "")}`, blob);
      taken.set(index, found.id);
      const wrong = (found.feedback ?? [])[0];
      const next = guides.findIndex((_, i) => i !== index && !taken.has(i));
      at = next < 0 ? index : next;
      ready(wrong ? `Taken, but: ${advice[wrong][0]}. ` : next < 0 ? "All views taken. " : "Taken. ");
      shownUntil = performance.now() + SHOWN_MS;
      stage.dataset.shots = Number(stage.dataset.shots ?? 0) + 1;
    } catch (error) { say(error.message); }
    goodFor = -1;
    busy = false;
  }

  async function pair() {
    try {
      const { link, qr } = await send("POST", "/api/pairing");
      const code = new DOMParser().parseFromString(qr, "image/svg+xml").documentElement;
      const local = /^https?:\/\/(127\.|localhost)/.test(link);
      paired.replaceChildren(...(local
        ? [make("p", { class: "quiet" }, "Only this machine can open the studio now. End it with Ctrl-C and start it with --lan; then the code is here.")]
        : [code, make("p", { class: "address" }, link)]));
    } catch (error) { say(error.message); }
  }

  function turned(event) {
    if (event.webkitCompassHeading != null) heading = event.webkitCompassHeading;
    else if (event.alpha != null && event.beta != null && event.gamma != null) heading = compass(event);
  }

  function key(event) {
    if (event.key === " " && !(event.target instanceof HTMLButtonElement) && !(event.target instanceof HTMLSelectElement)) {
      event.preventDefault();
      press();
    }
  }
  addEventListener("deviceorientation", turned);
  addEventListener("keydown", key);
  send("PUT", "/api/hold", { held: true }).catch(() => {});
  cameras.parentElement.hidden = true;
  load().then(() => { if (!left) start(); });
  const stop = onChange(() => {});

  function stopStream() {
    clearInterval(timer);
    for (const track of stream?.getTracks() ?? []) track.stop();
    stream = null;
  }

  return () => {
    left = true;
    stop();
    stopStream();
    removeEventListener("deviceorientation", turned);
    removeEventListener("keydown", key);
    window.speechSynthesis?.cancel();
    send("PUT", "/api/hold", { held: false }).catch(() => {});
  };
}

// The direction of the camera's axis over the ground, degrees (W3C, Device Orientation, A.1).
function compass({ alpha, beta, gamma }) {
  const [a, b, g] = [alpha, beta, gamma].map((v) => (v * Math.PI) / 180);
  const x = -Math.cos(a) * Math.sin(g) - Math.sin(a) * Math.sin(b) * Math.cos(g);
  const y = -Math.sin(a) * Math.sin(g) + Math.cos(a) * Math.sin(b) * Math.cos(g);
  return ((Math.atan2(x, y) * 180) / Math.PI + 360) % 360;
}
