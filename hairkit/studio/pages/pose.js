// The fitted head over every photo, landmarks to drag, and the order of the photos.
import { get, make, onChange, outlineOf, pathOf, say, send, state } from "./api.js";

const PARTS = [[0, 17], [17, 22], [22, 27], [27, 31], [31, 36], [36, 42], [42, 48], [48, 60], [60, 68]];
const CLOSED = new Set([36, 42, 48, 60]);
const NEAR_PX = 18;

export function show(main, argument) {
  let pose = null, shown = null, points = null, facts = null, image = null, dragged = -1, chosen = 30, had = "";
  const canvas = make("canvas", { tabindex: "0", role: "img", "aria-label": "Photo with the fitted head. Arrow keys move the chosen landmark, N chooses the next." });
  const stage = make("section", { class: "stage", "aria-label": "Photo" }, canvas);
  const list = make("ul", { class: "grid", "aria-label": "Order of the turn" });
  const status = make("p", { role: "status", class: "quiet" });
  const lights = make("ul", { class: "lights" });
  const keep = make("button", { class: "primary", onclick: save }, "Keep landmarks");
  const drop = make("button", { onclick: () => mark(null) }, "Use automatic ones");
  main.append(make("div", { class: "split" }, stage, make("section", { class: "side", "aria-label": "Pose" },
    make("h2", {}, "Head and cameras"), status, make("div", { class: "tools" }, keep, drop), lights,
    make("h2", {}, "Order of the turn"),
    make("p", { class: "quiet" }, "Towards the subject's left. Drag a photo, or move it by Alt and the arrow keys."), list)));

  async function load() {
    had = state.result;
    if (state.result) {
      try { pose = await get("/api/pose"); } catch (error) { say(error.message); }
    }
    lights.replaceChildren(...(pose?.health ?? []).map(([light, line]) => make("li", { class: light }, line)));
    order();
    draw();
  }

  function order() {
    list.replaceChildren(...state.photos.map((photo, index) => {
      const view = viewOf(photo);
      const item = make("li", { class: "card", draggable: "true" },
        make("button", { class: "frame", "aria-label": `Photo ${index + 1}${view ? `, ${view.name}` : ""}`, "aria-pressed": String(photo.id === shown?.id), onclick: () => open(photo) },
          make("img", { src: `/api/photos/${photo.id}/small?v=${photo.version}`, alt: "", draggable: "false" })),
        make("div", { class: "note" }, view ? `${view.name} ${Math.round(view.azimuth)}°` : `${index + 1}`));
      item.addEventListener("dragstart", (event) => { event.dataTransfer.setData("text/plain", String(photo.id)); item.classList.add("dragged"); });
      item.addEventListener("dragend", () => item.classList.remove("dragged"));
      item.addEventListener("dragover", (event) => event.preventDefault());
      item.addEventListener("drop", (event) => {
        event.preventDefault();
        move(Number(event.dataTransfer.getData("text/plain")), index);
      });
      item.addEventListener("keydown", (event) => {
        const step = { ArrowLeft: -1, ArrowUp: -1, ArrowRight: 1, ArrowDown: 1 }[event.key];
        if (event.altKey && step) { event.preventDefault(); move(photo.id, index + step); }
      });
      return item;
    }));
  }

  async function move(id, to) {
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
    } catch (error) { say(error.message); }
    order();
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
      context.stroke(new Path2D(pathOf(view.outline.map(inPixels))));
      context.fillStyle = "#6fd08c";
      for (const [u, v] of view.landmarks) dot(context, u * pw, v * ph, 2 / scale);
    }
    if (!points) return;
    context.strokeStyle = context.fillStyle = "#f0b45f";
    context.lineWidth = 1.5 / scale;
    for (const [first, last] of PARTS) {
      const line = points.slice(first, last).flat();
      context.stroke(new Path2D(pathOf([line], CLOSED.has(first))));
    }
    points.forEach((p, i) => dot(context, p[0], p[1], (i === chosen ? 5 : 3) / scale));
  }

  function dot(context, u, v, radius) {
    context.beginPath();
    context.arc(u, v, radius, 0, 2 * Math.PI);
    context.fill();
  }

  canvas.addEventListener("pointerdown", (event) => {
    if (!points) return;
    canvas.setPointerCapture(event.pointerId);
    const { scale, x, y } = placed();
    const away = points.map((p) => Math.hypot(p[0] * scale + x - event.offsetX, p[1] * scale + y - event.offsetY));
    const nearest = away.indexOf(Math.min(...away));
    if (away[nearest] < NEAR_PX) { dragged = chosen = nearest; draw(); }
  });
  canvas.addEventListener("pointermove", (event) => {
    if (dragged < 0) return;
    const { scale, x, y } = placed();
    points[dragged] = [(event.offsetX - x) / scale, (event.offsetY - y) / scale];
    draw();
  });
  for (const kind of ["pointerup", "pointercancel"]) canvas.addEventListener(kind, () => { dragged = -1; });
  canvas.addEventListener("keydown", (event) => {
    const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
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

  const sized = new ResizeObserver(draw);
  sized.observe(canvas);
  const stop = onChange(() => {
    if (state.result !== had) load();
    if (!shown && state.photos.length) open(state.photos.find((p) => String(p.id) === argument) ?? state.photos[0]);
    const now = state.photos.map((p) => p.id).join();
    if (list.dataset.order !== now) { list.dataset.order = now; order(); }
  });
  load();
  if (state.photos.length) open(state.photos.find((p) => String(p.id) === argument) ?? state.photos[0]);
  else main.replaceChildren(make("div", { class: "empty" }, make("h2", {}, "No photos yet"), make("a", { class: "button primary", href: "#photos" }, "Add photos")));
  return () => { stop(); sized.disconnect(); };
}
