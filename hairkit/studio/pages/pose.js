// The fitted head over every photo, landmarks to drag, and the order of the photos.
import { get, make, onChange, outlineOf, pathOf, refill, say, send, state } from "./api.js";

const PARTS = [[0, 17], [17, 22], [22, 27], [27, 31], [31, 36], [36, 42], [42, 48], [48, 60], [60, 68]];
const CLOSED = new Set([36, 42, 48, 60]);
const NEAR_PX = 18;
const HANDLE_PX = 26; // a handle is taken within this distance: a finger's width
const REACH = { turn: [0, -0.2], size: [0.16, 0.12] }; // handles from the head's middle, over the photo's height
const KEYS = { // one press, in the photo that is shown: millimetres, degrees, growth
  ArrowLeft: { mm: [-1, 0] }, ArrowRight: { mm: [1, 0] }, ArrowUp: { mm: [0, -1] }, ArrowDown: { mm: [0, 1] },
  q: { turn: [0, 0, -1] }, e: { turn: [0, 0, 1] }, r: { turn: [-1, 0, 0] }, f: { turn: [1, 0, 0] },
  t: { turn: [0, 1, 0] }, g: { turn: [0, -1, 0] }, "+": { grow: 1.005 }, "=": { grow: 1.005 }, "-": { grow: 1 / 1.005 },
};
const STILL = { shift: [0, 0], turn_deg: [0, 0, 0], factor: 1 };

export function show(main, argument) {
  let pose = null, shown = null, points = null, facts = null, image = null, dragged = -1, chosen = 30, had = "";
  let moving = "points", held = null, move = STILL, waiting = null, sending = false, pressed = false, late = false;
  const canvas = make("canvas", { tabindex: "0", role: "img", "aria-label": "Photo with the fitted head. Arrow keys move the chosen landmark, N chooses the next; with the head chosen they move the head, Q and E turn it, R and F nod it, T and G turn its face, plus and minus change its size." });
  const stage = make("section", { class: "stage", "aria-label": "Photo" }, canvas);
  const list = make("ul", { class: "grid", "aria-label": "Order of the turn" });
  const status = make("p", { role: "status", class: "quiet" });
  const lights = make("ul", { class: "lights" });
  const keep = make("button", { class: "primary", onclick: save }, "Keep landmarks");
  const drop = make("button", { onclick: () => mark(null) }, "Use automatic ones");
  const modes = ["points", "head"].map((mode) => make("button", {
    "aria-pressed": String(mode === moving), "data-moving": mode, onclick: () => choose(mode),
  }, mode === "points" ? "Move landmarks" : "Move the head"));
  const nudges = [["Nod up", "r"], ["Nod down", "f"], ["Face left", "t"], ["Face right", "g"]].map(([name, key]) =>
    make("button", { onclick: () => press(key, 1) }, name, make("kbd", { "aria-hidden": "true" }, key.toUpperCase())));
  const fitted = make("button", { onclick: () => place("PUT", {}) }, "As it was fitted");
  const headTools = make("div", { class: "tools", hidden: true }, ...nudges, fitted);
  const pointTools = make("div", { class: "tools" }, keep, drop);
  const residual = make("p", { class: "quiet", "aria-live": "polite" });
  main.append(make("div", { class: "split" }, stage, make("section", { class: "side", "aria-label": "Pose", id: "head" },
    make("h2", {}, "Head and cameras"), status, make("div", { class: "tools" }, ...modes), pointTools, headTools, residual, lights,
    make("h2", {}, "Order of the turn"),
    make("p", { class: "quiet" }, "Towards the subject's left. Drag a photo, press ‹ or ›, or hold Alt and press an arrow key."), list)));

  function choose(mode) {
    moving = mode;
    for (const button of modes) button.setAttribute("aria-pressed", String(button.dataset.moving === mode));
    headTools.hidden = mode !== "head";
    pointTools.hidden = mode === "head";
    canvas.focus({ preventScroll: true });
    tell();
    draw();
  }

  // How far the head's landmarks are from those that were found, in millimetres.
  function missed(photo, found) {
    const view = viewOf(photo);
    const seen = found?.landmarks?.slice(-(view?.landmarks.length ?? 0));
    if (!view?.landmarks.length || !seen) return null;
    const squares = view.landmarks.map(([u, v], i) => (u * found.width - seen[i][0]) ** 2 + (v * found.height - seen[i][1]) ** 2);
    return Math.sqrt(squares.reduce((a, b) => a + b, 0) / squares.length) / view.per_mm;
  }

  function tell() {
    const miss = shown && missed(shown, facts);
    residual.textContent = miss == null ? "" : `The head's landmarks are ${miss.toFixed(1)} mm (root mean square) from those found here.`;
    stage.dataset.residual = miss == null ? "" : miss.toFixed(2);
    if (moving === "head" && shown) {
      status.textContent = viewOf(shown)
        ? "Drag the head; the round handle turns it, the square one changes its size. All photos follow." : "The head appears when the hair has been made.";
    }
    fitted.disabled = !pose?.moved;
  }

  // Moves are sent one after the other; those made meanwhile are put together.
  function press(key, times) {
    const { mm = [0, 0], turn = [0, 0, 0], grow = 1 } = KEYS[key];
    const view = shown && viewOf(shown);
    if (!view || !facts) return;
    nudge({ shift: [mm[0] * times * view.per_mm / facts.width, mm[1] * times * view.per_mm / facts.height], turn_deg: turn.map((v) => v * times), factor: grow ** times });
  }

  async function nudge(change) {
    const before = waiting ?? STILL;
    waiting = {
      shift: before.shift.map((v, k) => v + change.shift[k]), turn_deg: before.turn_deg.map((v, k) => v + change.turn_deg[k]),
      factor: before.factor * change.factor, photo: shown.file,
    };
    if (sending) return;
    sending = true;
    while (waiting) {
      const body = waiting;
      waiting = null;
      await place("POST", body);
    }
    sending = false;
  }

  async function place(method, body) {
    try {
      const found = await send(method, "/api/head", body);
      pose = found.views ? found : await get("/api/pose");
      stage.dataset.placed = Number(stage.dataset.placed ?? 0) + 1;
    } catch (error) { say(error.message); }
    if (!held) move = STILL;
    tell();
    draw();
  }

  async function load() {
    had = state.result;
    if (state.result) {
      try { pose = await get("/api/pose"); } catch (error) { say(error.message); }
    }
    lights.replaceChildren(...(pose?.health ?? []).map(([light, line]) => make("li", { class: light }, line.replace(`${light} `, "").trim())));
    order();
    tell();
    draw();
  }

  // Fills the strip of thumbnails. Under a pressed pointer it stays as it is until the pointer lets
  // go: a thumbnail that is replaced can be neither clicked nor dragged.
  function order() {
    late = pressed;
    if (pressed) return;
    list.dataset.order = numbers();
    refill(list, ...state.photos.map((photo, index) => {
      const view = viewOf(photo);
      const item = make("li", { class: "card", draggable: "true" },
        make("button", { class: "frame", "data-key": `open ${photo.id}`, "aria-label": `Photo ${index + 1}${view ? `, ${view.name}` : ""}`, "aria-pressed": String(photo.id === shown?.id), onclick: () => open(photo) },
          make("img", { src: `/api/photos/${photo.id}/small?v=${photo.version}`, alt: "", draggable: "false" })),
        make("span", { class: "name" }, view ? `${view.name} ${Math.round(view.azimuth)}°` : `${index + 1}`),
        make("div", { class: "note" },
          make("button", { class: "plain step", "data-key": `earlier ${photo.id}`, "aria-label": `Photo ${index + 1} earlier in the turn`, disabled: !index, onclick: () => reorder(photo.id, index - 1) }, "‹"),
          make("button", { class: "plain step", "data-key": `later ${photo.id}`, "aria-label": `Photo ${index + 1} later in the turn`, disabled: index + 1 === state.photos.length, onclick: () => reorder(photo.id, index + 1) }, "›")));
      item.addEventListener("dragstart", (event) => { event.dataTransfer.setData("text/plain", String(photo.id)); item.classList.add("dragged"); });
      item.addEventListener("dragend", () => item.classList.remove("dragged"));
      item.addEventListener("dragover", (event) => event.preventDefault());
      item.addEventListener("drop", (event) => {
        event.preventDefault();
        reorder(Number(event.dataTransfer.getData("text/plain")), index);
      });
      item.addEventListener("keydown", (event) => {
        const step = { ArrowLeft: -1, ArrowUp: -1, ArrowRight: 1, ArrowDown: 1 }[event.key];
        if (event.altKey && step) { event.preventDefault(); reorder(photo.id, index + step); }
      });
      return item;
    }));
  }

  function numbers() { return state.photos.map((photo) => photo.id).join(); }

  async function reorder(id, to) {
    const ids = state.photos.map((photo) => photo.id).filter((other) => other !== id);
    ids.splice(Math.max(0, Math.min(ids.length, to)), 0, id);
    try { await send("PUT", "/api/order", { order: ids }); } catch (error) { say(error.message); }
  }

  function viewOf(photo) {
    return pose?.views.find((view) => view.photo === photo.file) ?? null;
  }

  async function open(photo) {
    shown = photo;
    points = null; image = null; facts = null;
    for (const button of list.querySelectorAll(".frame")) button.setAttribute("aria-pressed", String(button.dataset.key === `open ${photo.id}`));
    const picture = new Image();
    picture.onload = () => { if (shown === photo) { image = picture; draw(); } };
    picture.src = `/api/photos/${photo.id}/large?v=${photo.version}`;
    try {
      const found = await outlineOf(photo);
      if (shown !== photo) return;
      facts = found;
      points = found.landmarks?.map((p) => [...p]) ?? null;
      const [presence, yaw] = found.face ?? [0, 0];
      status.textContent = points ? `Face found (${Math.round(100 * presence)} % sure), seen from ${Math.round(yaw)}°. Drag a point that is wrong.` : "No face in this photo; none is needed from behind.";
      keep.disabled = !points;
      tell();
    } catch (error) { say(error.message); }
    draw();
  }

  function placed() {
    const w = canvas.clientWidth, h = canvas.clientHeight;
    const pw = facts?.width ?? image?.naturalWidth ?? 1, ph = facts?.height ?? image?.naturalHeight ?? 1;
    const scale = Math.min(w / pw, h / ph);
    return { scale, x: (w - pw * scale) / 2, y: (h - ph * scale) / 2, pw, ph };
  }

  function draw() {
    const sharp = Math.min(devicePixelRatio || 1, 2);
    canvas.width = Math.round(canvas.clientWidth * sharp);
    canvas.height = Math.round(canvas.clientHeight * sharp);
    const context = canvas.getContext("2d");
    if (!shown) return;
    const { scale, x, y, pw, ph } = placed();
    context.setTransform(sharp * scale, 0, 0, sharp * scale, sharp * x, sharp * y);
    if (image) context.drawImage(image, 0, 0, pw, ph);
    const view = viewOf(shown);
    if (view) {
      const inPixels = (curve) => curve.map((value, i) => value * (i % 2 ? ph : pw));
      context.strokeStyle = "#6fd08c";
      context.lineWidth = 2.5 / scale;
      const [mu, mv] = middleOf(view, pw, ph);
      context.save();
      context.translate(mu + move.shift[0] * pw, mv + move.shift[1] * ph);
      context.rotate((move.turn_deg[2] * Math.PI) / 180);
      context.scale(move.factor, move.factor);
      context.translate(-mu, -mv);
      context.stroke(new Path2D(pathOf(view.outline.map(inPixels))));
      context.fillStyle = "#6fd08c";
      for (const [u, v] of view.landmarks) dot(context, u * pw, v * ph, 2 / scale);
      context.restore();
      if (moving === "head") handles(context, view, scale, pw, ph);
    }
    if (facts?.outline?.length && moving === "head") {
      context.strokeStyle = "rgb(255 95 168 / 60%)";
      context.lineWidth = 1.2 / scale;
      context.stroke(new Path2D(pathOf(facts.outline)));
    }
    if (!points || moving === "head") return;
    context.strokeStyle = context.fillStyle = "#f0b45f";
    context.lineWidth = 1.5 / scale;
    for (const [first, last] of PARTS) {
      const line = points.slice(first, last).flat();
      context.stroke(new Path2D(pathOf([line], CLOSED.has(first))));
    }
    points.forEach((p, i) => dot(context, p[0], p[1], (i === chosen ? 5 : 3) / scale));
  }

  function middleOf(view, pw, ph) { return [view.middle[0] * pw, view.middle[1] * ph]; }

  function placesOf(view, pw, ph) {
    const middle = middleOf(view, pw, ph).map((value, k) => value + move.shift[k] * (k ? ph : pw));
    const of = ([x, y]) => [middle[0] + x * ph, middle[1] + y * ph];
    return { middle, turn: of(REACH.turn), size: of(REACH.size) };
  }

  function handles(context, view, scale, pw, ph) {
    const { middle, turn, size } = placesOf(view, pw, ph);
    context.strokeStyle = context.fillStyle = "#f0b45f";
    context.lineWidth = 2 / scale;
    context.beginPath();
    context.moveTo(...turn); context.lineTo(...middle); context.lineTo(...size);
    context.stroke();
    dot(context, ...middle, 6 / scale);
    dot(context, ...turn, 11 / scale);
    context.fillRect(size[0] - 10 / scale, size[1] - 10 / scale, 20 / scale, 20 / scale);
  }

  // What a pointer takes: a handle, or the head between them.
  function taken(event) {
    const view = shown && viewOf(shown);
    if (!view) return null;
    const { scale, x, y, pw, ph } = placed();
    const places = placesOf(view, pw, ph);
    const away = ([u, v]) => Math.hypot(u * scale + x - event.offsetX, v * scale + y - event.offsetY);
    const kind = ["turn", "size"].find((name) => away(places[name]) < HANDLE_PX) ?? (away(places.middle) < 0.2 * ph * scale ? "shift" : null);
    return kind && { kind, view, middle: places.middle, first: [(event.offsetX - x) / scale, (event.offsetY - y) / scale] };
  }

  function drag(event) {
    const { scale, x, y, pw, ph } = placed();
    const now = [(event.offsetX - x) / scale, (event.offsetY - y) / scale];
    const [a, b] = [held.first, now].map((p) => [p[0] - held.middle[0], p[1] - held.middle[1]]);
    if (held.kind === "shift") move = { ...STILL, shift: [(now[0] - held.first[0]) / pw, (now[1] - held.first[1]) / ph] };
    if (held.kind === "turn") move = { ...STILL, turn_deg: [0, 0, ((Math.atan2(b[1], b[0]) - Math.atan2(a[1], a[0])) * 180) / Math.PI] };
    if (held.kind === "size") move = { ...STILL, factor: Math.max(0.5, Math.min(2, Math.hypot(...b) / Math.max(Math.hypot(...a), 1))) };
    draw();
  }

  function dot(context, u, v, radius) {
    context.beginPath();
    context.arc(u, v, radius, 0, 2 * Math.PI);
    context.fill();
  }

  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    if (moving === "head") { held = sending ? null : taken(event); return; }
    if (!points) return;
    const { scale, x, y } = placed();
    const away = points.map((p) => Math.hypot(p[0] * scale + x - event.offsetX, p[1] * scale + y - event.offsetY));
    const nearest = away.indexOf(Math.min(...away));
    if (away[nearest] < NEAR_PX) { dragged = chosen = nearest; draw(); }
  });
  canvas.addEventListener("pointermove", (event) => {
    if (held) { drag(event); return; }
    if (dragged < 0) return;
    const { scale, x, y } = placed();
    points[dragged] = [(event.offsetX - x) / scale, (event.offsetY - y) / scale];
    draw();
  });
  for (const kind of ["pointerup", "pointercancel"]) canvas.addEventListener(kind, () => {
    dragged = -1;
    if (!held) return;
    held = null;
    if (kind === "pointerup" && move !== STILL) nudge(move);
    else { move = STILL; draw(); }
  });
  canvas.addEventListener("keydown", (event) => {
    const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    if (moving === "head") {
      const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
      if (KEYS[key] && !event.ctrlKey && !event.metaKey && !event.altKey) { event.preventDefault(); press(key, event.shiftKey && key !== "+" ? 5 : 1); }
      return;
    }
    if (!points) return;
    if (step) { event.preventDefault(); points[chosen] = points[chosen].map((value, k) => value + step[k] * (event.shiftKey ? 10 : 1)); }
    if (event.key === "n") chosen = (chosen + 1) % points.length;
    if (event.key === "p") chosen = (chosen + points.length - 1) % points.length;
    draw();
  });

  function save() { return mark(points); }

  async function mark(value) {
    if (!shown) return;
    try {
      await send("PUT", `/api/photos/${shown.id}/landmarks`, { points: value });
      status.textContent = value ? "Kept; the hair is made again." : "Automatic landmarks are used.";
    } catch (error) { say(error.message); }
  }

  function release(event) {
    if (!pressed || (event.type === "pointercancel" && list.querySelector(".dragged"))) return;
    setTimeout(() => { pressed = false; if (late) order(); });
  }

  list.addEventListener("pointerdown", () => { pressed = true; });
  for (const end of ["pointerup", "pointercancel", "dragend"]) window.addEventListener(end, release);
  const sized = new ResizeObserver(draw);
  sized.observe(canvas);
  const stop = onChange(() => {
    if (state.result !== had) load();
    if (!shown && state.photos.length) open(state.photos.find((p) => String(p.id) === argument) ?? state.photos[0]);
    if (list.dataset.order !== numbers()) order();
  });
  load();
  if (state.photos.length) open(state.photos.find((p) => String(p.id) === argument) ?? state.photos[0]);
  else main.replaceChildren(make("div", { class: "empty" }, make("h2", {}, "No photos yet"), make("a", { class: "button primary", href: "#photos" }, "Add photos")));
  return () => {
    stop();
    sized.disconnect();
    for (const end of ["pointerup", "pointercancel", "dragend"]) window.removeEventListener(end, release);
  };
}
