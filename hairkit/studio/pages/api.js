// Talking to the server: the session, requests, events.

export async function openSession() {
  const token = new URLSearchParams(location.hash.slice(1)).get("t");
  if (!token) return;
  history.replaceState(null, "", location.pathname + "#photos");
  await send("POST", "/api/session", { token });
}

export async function get(path) {
  return answer(await fetch(path));
}

export async function send(method, path, body) {
  const raw = body instanceof Blob;
  return answer(await fetch(path, {
    method,
    body: raw ? body : JSON.stringify(body ?? {}),
    headers: { "Content-Type": raw ? "application/octet-stream" : "application/json" },
  }));
}

// Ask for a file that a link loads at the same time; the error says why there is none.
export async function prepare(path) {
  const response = await fetch(path);
  if (!response.ok) await answer(response);
  await response.body.cancel();
}

async function answer(response) {
  if (response.ok) return response.json();
  const text = await response.text();
  let reason = text;
  try { reason = JSON.parse(text).error; } catch { /* plain text */ }
  throw new Error(reason || `the server answered ${response.status}`);
}

// One state for all pages: what the server said last.
export const state = {
  photos: [], build: { state: "none" }, formats: [], result: "", draft: "", name: "",
};
const listeners = new Set();

export function onChange(listener) {
  listeners.add(listener);
  return () => listeners.delete(listener);
}

function changed(values) {
  Object.assign(state, values);
  for (const listener of listeners) listener(state);
}

export async function refresh() {
  changed(await get("/api/project"));
}

// The first event says how the project stands: an answer to a request could be older than the
// events that came before it.
export function listen() {
  const events = new EventSource("/api/events");
  events.addEventListener("project", (event) => changed(JSON.parse(event.data)));
  events.addEventListener("build", (event) => changed({ build: JSON.parse(event.data) }));
  events.addEventListener("error", () => {
    if (events.readyState === EventSource.CLOSED) {
      say("The studio has ended. Run hairkit studio again and open its link; nothing is lost.");
    }
  });
}

let shown;
export function say(text) {
  const notice = document.getElementById("notice"); // above the page: it covers no control
  notice.textContent = text;
  clearTimeout(shown);
  shown = setTimeout(() => { notice.textContent = ""; }, 7000);
}

// make("button", {class: "primary", onclick: f}, "Text", child)
export function make(name, values = {}, ...children) {
  const svg = ["svg", "path", "line", "text", "circle"].includes(name);
  const element = svg
    ? document.createElementNS("http://www.w3.org/2000/svg", name) : document.createElement(name);
  for (const [key, value] of Object.entries(values)) {
    if (key.startsWith("on")) element.addEventListener(key.slice(2), value);
    else if (value === true) element.setAttribute(key, "");
    else if (value !== false && value != null) element.setAttribute(key, value);
  }
  element.append(...children.filter((child) => child != null));
  return element;
}

// Replaces the children of an element; the keyboard stays where it was, at the control with the
// same data-key, or else at the one in the same place.
export function refill(parent, ...children) {
  const controls = () => [...parent.querySelectorAll("a, button, input, select, canvas")];
  const place = controls().indexOf(document.activeElement);
  const key = document.activeElement?.dataset?.key;
  parent.replaceChildren(...children.filter((child) => child != null));
  if (place < 0) return;
  const now = controls();
  const same = now.findIndex((control) => key && control.dataset.key === key);
  const from = same < 0 ? Math.min(place, now.length - 1) : same;
  const nearest = [...now.slice(from), ...now.slice(0, from).reverse()];
  const free = nearest.find((control) => !control.disabled);
  free?.focus({ preventScroll: true });
}

// Closed curves [[x, y, x, y, ...], ...] as the data of an SVG path.
export function pathOf(curves, closed = true) {
  return curves.map((curve) => {
    let text = "";
    for (let i = 0; i < curve.length; i += 2) text += `${i ? "L" : "M"}${curve[i]} ${curve[i + 1]}`;
    return text + (closed ? "Z" : "");
  }).join("");
}

const outlines = new Map();
export async function outlineOf(photo) {
  const kept = outlines.get(photo.id);
  const version = `${photo.version}/${photo.share}`;
  if (kept && kept.version === version) return kept.facts;
  const facts = await get(`/api/photos/${photo.id}/outline`);
  outlines.set(photo.id, { version, facts });
  return facts;
}

export function forget(id) {
  outlines.delete(id);
}
