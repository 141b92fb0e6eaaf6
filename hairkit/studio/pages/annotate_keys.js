// Keys of the mask's page: tools, brush, undo, other photos, zoom, and the cross.
import { state } from "./api.js";
import { TOOLS } from "./strokes.js";

const ZOOM = 1.25, BRUSH = 1.25; // of one press
const WAYS = { arrowleft: [-1, 0], arrowright: [1, 0], arrowup: [0, -1], arrowdown: [0, 1] };

// Listens to keys for the page; returns what ends that.
export function listenToKeys(page) {
  const acts = actsOf(page);
  const key = (event) => {
    if (event.target instanceof HTMLInputElement && !event.ctrlKey && !event.metaKey) return;
    const letter = event.key.toLowerCase();
    if (hold(page, event, letter) || event.type === "keyup") return;
    if (event.ctrlKey || event.metaKey) undo(page, event, letter);
    else if (!event.altKey && !cross(page, event, letter)) acts[letter]?.(event);
  };
  addEventListener("keydown", key);
  addEventListener("keyup", key);
  return () => { removeEventListener("keydown", key); removeEventListener("keyup", key); };
}

// What holds while a key is down: the photo without lines, and its moving.
function hold(page, event, letter) {
  const down = event.type === "keydown";
  if (letter === "h") {
    page.bare = down;
    page.draw();
    return true;
  }
  if (letter !== " " || event.target !== page.stage.canvas) return false;
  page.moving = down;
  event.preventDefault();
  return true;
}

function undo(page, event, letter) {
  const direction = { z: event.shiftKey ? 1 : -1, y: 1 }[letter];
  if (!direction) return;
  event.preventDefault();
  page.step(direction);
}

// Keys of the cross, on the photo; returns whether this was one.
function cross(page, event, letter) {
  if (event.target !== page.stage.canvas) return false;
  const way = page.cross.at && WAYS[letter];
  if (letter !== "enter" && !way) return false;
  event.preventDefault();
  if (way) page.cross.move(way, event.shiftKey);
  else page.cross.press();
  return true;
}

function actsOf(page) {
  const back = (event) => { event.preventDefault(); page.step(-1); };
  const next = (step) => () => {
    const index = state.photos.findIndex((photo) => photo.id === page.photo?.id);
    const photo = state.photos[index + step];
    if (photo) page.open(photo);
  };
  const zoom = (factor) => () => { page.stage.zoomAbout(factor, middle(page)); page.draw(); };
  const choose = (name) => () => page.choose(name);
  const tools = Object.keys(TOOLS).flatMap((name, i) =>
    [[TOOLS[name].key, choose(name)], [String(i + 1), choose(name)]]);
  return {
    ...Object.fromEntries(tools),
    delete: back, backspace: back, escape: () => page.cross.escape(),
    "0": () => { page.stage.showWhole(); page.draw(); },
    "[": () => page.setBrush(page.brush / BRUSH), "]": () => page.setBrush(page.brush * BRUSH),
    d: next(1), arrowright: next(1), a: next(-1), arrowleft: next(-1),
    "+": zoom(ZOOM), "=": zoom(ZOOM), "-": zoom(1 / ZOOM),
  };
}

// What zooming is about: the cross, or the middle of the canvas.
function middle({ cross: { at }, stage }) {
  return at ? stage.toPage(at) : [stage.canvas.clientWidth / 2, stage.canvas.clientHeight / 2];
}
