// Masks corrected by a few strokes. Strokes are kept in labelme's shape; the mask follows from them.
import { forget, get, make, onChange, outlineOf, pathOf, refill, say, send, state } from "./api.js";

const tools = {
  foreground: { name: "Hair", key: "f", label: "foreground", type: "linestrip", colour: "#ff5fa8" },
  background: { name: "Not hair", key: "b", label: "background", type: "linestrip", colour: "#64b5ff" },
  hairArea: { name: "Hair area", key: "g", label: "foreground", type: "polygon", colour: "#ff5fa8" },
  restArea: { name: "Other area", key: "n", label: "background", type: "polygon", colour: "#64b5ff" },
  edgeHair: { name: "Edge: hair", key: "w", label: "foreground", type: "linestrip", colour: "#ff5fa8", brush: true },
  edgeRest: { name: "Edge: rest", key: "s", label: "background", type: "linestrip", colour: "#64b5ff", brush: true },
  rectangle: { name: "Rectangle", key: "r", label: "rectangle", type: "rectangle", colour: "#f0b45f" },
  parting: { name: "Parting", key: "p", label: "parting", type: "linestrip", colour: "#f0b45f" },
  erase: { name: "Remove", key: "e", colour: "#eceef0" },
};
const NEAR_PX = 14; // a stroke is removed within this distance
const LEAST_STEP_PX = 2.5; // between two points of a stroke
const CROSS_PX = 22, PEN_PX = 3, FAST_PX = 18; // the cross for the keyboard: its arms, and steps of it
const BRUSH = { least: 0.005, most: 0.12, usual: 0.03 }; // radius over the photo's height

export function show(main, argument) {
  let photo = null, image = null, facts = null, shapes = [], undone = [], stroke = null;
  let tool = "foreground", zoom = 1, shift = [0, 0], bright = 1, contrast = 1, turn = 0, saving = null;
  let pinch = null, brush = BRUSH.usual, bare = false, pen = null;
  const pointers = new Map();

  const canvas = make("canvas", { tabindex: "0", role: "img", "aria-label": "Photo with the outline of the hair. Draw with the pointer, or press Enter for a cross: arrow keys move it, Enter lowers and lifts the pen, Escape takes the cross away. Letters choose tools." });
  const status = make("p", { role: "status", class: "quiet" });
  const buttons = Object.entries(tools).map(([key, { name, key: letter }]) => make("button", {
    "aria-pressed": String(key === tool), "data-tool": key, title: `Key ${letter.toUpperCase()}`, onclick: () => choose(key),
  }, name, make("kbd", { "aria-hidden": "true" }, letter.toUpperCase())));
  const undo = make("button", { onclick: () => step(-1), title: "Ctrl+Z" }, "Undo");
  const redo = make("button", { onclick: () => step(1), title: "Ctrl+Shift+Z" }, "Redo");
  const size = slider("Brush size  [ ]", BRUSH.least, BRUSH.most, 0.005, (value) => { brush = value; });
  const brightness = slider("Brightness", 0.5, 2, 0.05, (value) => { bright = value; }, tone);
  const contrasts = slider("Contrast", 0.5, 2, 0.05, (value) => { contrast = value; }, tone);
  size.lastChild.value = brush;
  const strip = make("div", { class: "strip", role: "group", "aria-label": "Photos" });
  const stage = make("section", { class: "stage", "aria-label": "Photo" }, canvas);
  main.append(make("div", { class: "split" }, stage, make("section", { class: "side", "aria-label": "Tools" },
    strip, make("div", { class: "tools" }, ...buttons), make("div", { class: "tools" }, undo, redo), status,
    size, brightness, contrasts,
    make("p", { class: "quiet" }, "Correct only what is wrong: three strokes are usually enough. An edge brush paints up to the strongest edge under it. Scroll or pinch to zoom, hold Space to move, H to see the bare photo. Without a pointer: Enter on the photo shows a cross, arrow keys move it, Enter lowers and lifts the pen. Strands are followed in the photo with this brightness and contrast."))));

  function slider(name, min, max, step, set, keep) {
    const input = make("input", { type: "range", min, max, step, value: "1", oninput: () => { set(Number(input.value)); draw(); }, onchange: () => keep?.() });
    return make("label", {}, name, input);
  }

  // The stage that follows strands sees the photo as it is shown here.
  async function tone() {
    try { await send("PUT", `/api/photos/${photo.id}/tone`, { brightness: bright, contrast }); } catch (error) { say(error.message); }
  }

  function choose(key) {
    tool = key;
    for (const button of buttons) button.setAttribute("aria-pressed", String(button.dataset.tool === key));
    canvas.style.cursor = key === "erase" ? "pointer" : "crosshair";
  }

  async function open(next) {
    photo = next;
    history.replaceState(null, "", `#annotate/${photo.id}`);
    const order = ++turn;
    zoom = 1; shift = [0, 0]; shapes = []; undone = []; facts = null; image = null; pen = stroke = null;
    [bright, contrast] = photo.tone ?? [1, 1];
    brightness.lastChild.value = bright;
    contrasts.lastChild.value = contrast;
    thumbnails();
    status.textContent = "Looking for hair…";
    const picture = new Image();
    picture.onload = () => { if (order === turn) { image = picture; draw(); } };
    picture.src = `/api/photos/${photo.id}/large?v=${photo.version}`;
    try {
      const [document, found] = await Promise.all([get(`/api/photos/${photo.id}/strokes`), outlineOf(photo)]);
      if (order !== turn) return;
      shapes = document.shapes ?? [];
      facts = found;
      tell();
    } catch (error) { say(error.message); }
    draw();
  }

  function tell() {
    const problem = state.photos.find((p) => p.id === photo.id)?.problem ?? facts?.problem;
    status.textContent = problem ?? (shapes.length ? `${shapes.length} stroke${shapes.length > 1 ? "s" : ""}` : "Found automatically");
    undo.disabled = !shapes.length;
    redo.disabled = !undone.length;
  }

  function thumbnails() {
    refill(strip, ...state.photos.map((p, i) => make("button", {
      "aria-label": `Photo ${i + 1}`, "aria-pressed": String(p.id === photo?.id), onclick: () => open(p),
    }, make("img", { src: `/api/photos/${p.id}/small?v=${p.version}`, alt: "" }))));
  }

  // The photo's pixels to the canvas: scale and shift.
  function placed() {
    const w = canvas.clientWidth, h = canvas.clientHeight;
    const [pw, ph] = facts ? [facts.width, facts.height] : [image?.naturalWidth ?? 1, image?.naturalHeight ?? 1];
    const scale = zoom * Math.min(w / pw, h / ph);
    return { scale, x: (w - pw * scale) / 2 + shift[0], y: (h - ph * scale) / 2 + shift[1], pw, ph };
  }

  function draw() {
    const sharp = Math.min(devicePixelRatio || 1, 2);
    canvas.width = Math.round(canvas.clientWidth * sharp);
    canvas.height = Math.round(canvas.clientHeight * sharp);
    const context = canvas.getContext("2d");
    const { scale, x, y, pw, ph } = placed();
    context.setTransform(sharp * scale, 0, 0, sharp * scale, sharp * x, sharp * y);
    if (image) {
      context.filter = `brightness(${bright}) contrast(${contrast})`;
      context.drawImage(image, 0, 0, pw, ph);
      context.filter = "none";
    }
    if (facts?.outline?.length && !bare) {
      const path = new Path2D(pathOf(facts.outline));
      context.fillStyle = "rgb(255 95 168 / 26%)";
      context.fill(path, "evenodd");
      context.strokeStyle = "#ff5fa8";
      context.lineWidth = 1.8 / scale;
      context.stroke(path);
    }
    for (const shape of stroke ? [...shapes, stroke] : shapes) if (!bare) drawShape(context, shape, scale, ph);
    if (pen) drawCross(context, scale);
  }

  function drawCross(context, scale) {
    const [u, v] = pen, reach = CROSS_PX / scale;
    for (const [colour, width] of [["#000", 5], [tools[tool].colour, 2]]) {
      context.strokeStyle = colour;
      context.lineWidth = width / scale;
      context.beginPath();
      for (const [x, y] of [[reach, 0], [0, reach]]) {
        for (const side of [-1, 1]) {
          context.moveTo(u + (side * x) / 4, v + (side * y) / 4);
          context.lineTo(u + side * x, v + side * y);
        }
      }
      context.stroke();
    }
  }

  function drawShape(context, shape, scale, height) {
    const colour = shape.label === "foreground" ? "#ff9fcb" : ["rectangle", "parting"].includes(shape.label) ? "#f0b45f" : "#9fd1ff";
    const [first, ...rest] = shape.points;
    context.strokeStyle = colour;
    context.lineJoin = context.lineCap = "round";
    context.lineWidth = shape.shape_type === "linestrip" ? Math.max(0.0083 * height, 3 / scale) : 2 / scale;
    context.globalAlpha = 1;
    if (shape.radius) {
      if (shape === stroke) { context.globalAlpha = 0.45; context.lineWidth = 2 * shape.radius; }
      else context.setLineDash([3 * context.lineWidth, 2 * context.lineWidth]);
    }
    context.beginPath();
    if (shape.shape_type === "rectangle") {
      const [a, b] = shape.points;
      context.rect(a[0], a[1], b[0] - a[0], b[1] - a[1]);
    } else {
      context.moveTo(...first);
      for (const point of rest.length ? rest : [first]) context.lineTo(...point);
      if (shape.shape_type === "polygon") {
        context.closePath();
        context.fillStyle = `${colour}66`;
        context.fill();
      }
    }
    context.stroke();
    context.globalAlpha = 1;
    context.setLineDash([]);
  }

  function at(event) {
    const { scale, x, y } = placed();
    return inside([(event.offsetX - x) / scale, (event.offsetY - y) / scale]);
  }

  function inside(point) {
    const { pw, ph } = placed();
    return point.map((value, k) => Math.round(10 * Math.max(0, Math.min(k ? ph : pw, value))) / 10);
  }

  function begin(point) {
    if (tool === "erase") { erase(point); return; }
    const { label, type } = tools[tool];
    stroke = { label, shape_type: type, points: type === "rectangle" ? [point, point] : [point], group_id: null, flags: {} };
    if (tools[tool].brush) stroke.radius = Math.round(10 * brush * facts.height) / 10;
  }

  function lead(point) {
    if (stroke.shape_type === "rectangle") stroke.points[1] = point;
    else stroke.points.push(point);
  }

  function end(kept) {
    if (!stroke) return;
    const done = kept && finished(stroke);
    stroke = null;
    if (done) { shapes = [...shapes, done]; undone = []; save(); }
    draw();
  }

  // The cross for the keyboard: Enter shows it, then lowers and lifts the pen there.
  function press() {
    if (!facts) return;
    if (!pen) {
      const { scale, x, y } = placed();
      pen = inside([(canvas.clientWidth / 2 - x) / scale, (canvas.clientHeight / 2 - y) / scale]);
      status.textContent = "Arrow keys move the cross, Shift faster; Enter lowers the pen, Escape leaves.";
    } else if (stroke) end(true);
    else {
      begin([...pen]);
      if (stroke) status.textContent = "Pen down: arrow keys draw, Enter lifts it.";
    }
    draw();
  }

  function movePen([dx, dy], fast) {
    const step = (fast ? FAST_PX : PEN_PX) / placed().scale;
    pen = inside([pen[0] + dx * step, pen[1] + dy * step]);
    if (stroke) lead([...pen]);
    const { scale, x, y } = placed();
    const seen = [pen[0] * scale + x, pen[1] * scale + y];
    const size = [canvas.clientWidth, canvas.clientHeight];
    shift = shift.map((value, k) => value + Math.max(0, CROSS_PX - seen[k]) - Math.max(0, seen[k] - size[k] + CROSS_PX));
    draw();
  }

  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    canvas.focus({ preventScroll: true });
    pointers.set(event.pointerId, [event.offsetX, event.offsetY]);
    if (pointers.size === 2) { stroke = null; pinch = null; draw(); return; }
    if (event.button === 1 || moving || !facts) return;
    pen = null;
    begin(at(event));
  });
  canvas.addEventListener("pointermove", (event) => {
    const before = pointers.get(event.pointerId);
    if (!before) return;
    const now = [event.offsetX, event.offsetY];
    if (pointers.size === 2) {
      pointers.set(event.pointerId, now);
      const [a, b] = [...pointers.values()];
      const wide = Math.hypot(a[0] - b[0], a[1] - b[1]), middle = [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2];
      if (pinch) { scaleAbout(wide / pinch.wide, middle); shift = shift.map((v, k) => v + middle[k] - pinch.middle[k]); }
      pinch = { wide, middle };
    } else if (!stroke) {
      if (tool !== "erase" || moving) shift = shift.map((value, k) => value + now[k] - before[k]);
      pointers.set(event.pointerId, now);
    } else if (stroke.shape_type === "rectangle" || Math.hypot(now[0] - before[0], now[1] - before[1]) >= LEAST_STEP_PX) {
      lead(at(event));
      pointers.set(event.pointerId, now);
    }
    draw();
  });
  for (const kind of ["pointerup", "pointercancel"]) {
    canvas.addEventListener(kind, (event) => {
      pointers.delete(event.pointerId);
      pinch = null;
      end(kind === "pointerup");
    });
  }

  function finished(shape) {
    const { points } = shape;
    if (shape.shape_type === "linestrip" && points.length === 1) return { ...shape, shape_type: "point" };
    if (shape.shape_type === "polygon") {
      const hull = convexHull(points);
      return hull.length > 2 ? { ...shape, points: hull } : null;
    }
    if (shape.shape_type === "rectangle" && (points[0][0] === points[1][0] || points[0][1] === points[1][1])) return null;
    if (shape.label === "rectangle") shapes = shapes.filter((other) => other.label !== "rectangle");
    return shape;
  }

  function erase(point) {
    const near = NEAR_PX / placed().scale;
    const away = (shape) => Math.min(...shape.points.map((p) => Math.hypot(p[0] - point[0], p[1] - point[1])));
    const hit = shapes.find((shape) => away(shape) < near);
    if (hit) { shapes = shapes.filter((shape) => shape !== hit); save(); draw(); }
  }

  function step(direction) {
    if (direction < 0 && shapes.length) undone = [...undone, shapes.at(-1)], shapes = shapes.slice(0, -1);
    else if (direction > 0 && undone.length) shapes = [...shapes, undone.at(-1)], undone = undone.slice(0, -1);
    else return;
    save();
    draw();
  }

  // One request at a time; what is drawn meanwhile goes with the next.
  async function save() {
    tell();
    if (saving) { saving = "again"; return; }
    const mine = photo, order = turn;
    do {
      saving = "now";
      const document = {
        version: "5.0.0", flags: { corrects: true }, shapes, imagePath: mine.file, imageData: null,
        imageWidth: facts.width, imageHeight: facts.height,
      };
      status.textContent = "…";
      const began = performance.now();
      try {
        const found = await send("PUT", `/api/photos/${mine.id}/strokes`, document);
        forget(mine.id);
        if (order === turn) { facts = { ...facts, problem: undefined, ...found }; stage.dataset.outlineMs = Math.round(performance.now() - began); tell(); draw(); }
      } catch (error) { say(error.message); }
    } while (saving === "again" && order === turn);
    saving = null;
  }

  function scaleAbout(factor, [px, py]) {
    const before = placed();
    zoom = Math.max(1, Math.min(12, zoom * factor));
    const after = placed();
    const fx = (px - before.x) / before.scale, fy = (py - before.y) / before.scale;
    shift = zoom === 1 ? [0, 0] : [shift[0] + px - (after.x + fx * after.scale), shift[1] + py - (after.y + fy * after.scale)];
  }
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    scaleAbout(Math.exp(-0.0015 * event.deltaY), [event.offsetX, event.offsetY]);
    draw();
  }, { passive: false });

  // What zooming by keys is about: the cross, or the middle of the page's picture.
  function middle() {
    const { scale, x, y } = placed();
    return pen ? [pen[0] * scale + x, pen[1] * scale + y] : [canvas.clientWidth / 2, canvas.clientHeight / 2];
  }

  let moving = false;
  function key(event) {
    if (event.target instanceof HTMLInputElement && !event.ctrlKey && !event.metaKey) return;
    const letter = event.key.toLowerCase();
    if (letter === "h") { bare = event.type === "keydown"; draw(); return; }
    if (event.key === " " && event.target === canvas) { moving = event.type === "keydown"; event.preventDefault(); return; }
    if (event.type === "keyup") return;
    if (event.ctrlKey || event.metaKey) {
      if (letter === "z") { event.preventDefault(); step(event.shiftKey ? 1 : -1); }
      if (letter === "y") { event.preventDefault(); step(1); }
      return;
    }
    if (event.altKey) return;
    if (letter === "delete" || letter === "backspace") { event.preventDefault(); step(-1); }
    if (letter === "escape" && (stroke || pen)) { if (!stroke) pen = null; stroke = null; tell(); draw(); }
    if (event.target === canvas && letter === "enter") { event.preventDefault(); press(); return; }
    const way = { arrowleft: [-1, 0], arrowright: [1, 0], arrowup: [0, -1], arrowdown: [0, 1] }[letter];
    if (pen && way && event.target === canvas) { event.preventDefault(); movePen(way, event.shiftKey); return; }
    if (letter === "0") { zoom = 1; shift = [0, 0]; draw(); }
    const wider = { "[": 0.8, "]": 1.25 }[letter];
    if (wider) { brush = Math.max(BRUSH.least, Math.min(BRUSH.most, brush * wider)); size.lastChild.value = brush; }
    const chosen = Object.keys(tools).find((name, i) => tools[name].key === letter || letter === String(i + 1));
    if (chosen) choose(chosen);
    const index = state.photos.findIndex((p) => p.id === photo?.id);
    const next = { arrowright: index + 1, arrowleft: index - 1, d: index + 1, a: index - 1 }[letter];
    if (next !== undefined && state.photos[next]) open(state.photos[next]);
    if (letter === "+" || letter === "=") scaleAbout(1.25, middle()), draw();
    if (letter === "-") scaleAbout(0.8, middle()), draw();
  }
  addEventListener("keydown", key);
  addEventListener("keyup", key);
  const sized = new ResizeObserver(draw);
  sized.observe(canvas);

  const started = () => {
    if (photo || !state.photos.length) return;
    open(state.photos.find((p) => String(p.id) === argument) ?? state.photos[0]);
  };
  const stop = onChange(() => { started(); if (facts) tell(); });
  choose(tool);
  started();
  if (!photo) {
    main.replaceChildren(make("div", { class: "empty" }, make("h2", {}, "No photos yet"),
      make("a", { class: "button primary", href: "#photos" }, "Add photos")));
  }
  return () => { stop(); sized.disconnect(); removeEventListener("keydown", key); removeEventListener("keyup", key); };
}

function convexHull(points) {
  const sorted = [...points].sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  const half = (list) => {
    const hull = [];
    for (const p of list) {
      while (hull.length > 1) {
        const [a, b] = hull.slice(-2);
        if ((b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) > 0) break;
        hull.pop();
      }
      hull.push(p);
    }
    return hull.slice(0, -1);
  };
  return [...half(sorted), ...half(sorted.reverse())];
}
