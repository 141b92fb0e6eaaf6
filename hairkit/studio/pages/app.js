// The frame of all pages: which page is shown, and how far the hair is.
import { listen, onChange, openSession, refresh, say } from "./api.js";
import * as photos from "./photos.js";
import * as capture from "./capture.js";
import * as annotate from "./annotate.js";
import * as pose from "./pose.js";
import * as strands from "./strands.js";
import * as hair from "./hair.js";

const pages = { photos, capture, annotate, pose, strands, hair };
let leave = () => {}, ready = false; // with a session, without which pages are refused

function show() {
  const [name, argument] = location.hash.slice(1).split("/");
  const page = pages[name] ? name : "photos";
  leave();
  for (const link of document.querySelectorAll("nav a")) {
    if (link.hash === `#${page}`) link.setAttribute("aria-current", "page");
    else link.removeAttribute("aria-current");
  }
  const main = document.getElementById("page");
  main.replaceChildren();
  document.title = `${page[0].toUpperCase()}${page.slice(1)} – hairkit studio`;
  leave = pages[page].show(main, argument) ?? (() => {});
}

function showBuild(state) {
  document.getElementById("name").textContent = state.name || "hairkit studio";
  const { state: phase, words, share, reason } = state.build;
  const text = {
    running: words ? `Making hair: ${words}` : "Making hair",
    waiting: "Changed: the hair is made again", done: "Hair is ready", failed: reason,
  }[phase] ?? "";
  const place = document.getElementById("build-text");
  if (place.textContent !== text) place.textContent = text;
  place.className = phase === "failed" ? "bad" : phase === "done" ? "good" : "";
  const bar = document.getElementById("build-share");
  bar.hidden = phase !== "running";
  bar.value = share ?? 0;
}

// A new link of a studio that was started again, opened in the same tab, changes the hash alone.
function follow() {
  if (new URLSearchParams(location.hash.slice(1)).has("t")) location.reload();
  else if (ready) show();
}

async function start() {
  onChange(showBuild);
  addEventListener("hashchange", follow);
  try {
    await openSession();
    await refresh();
  } catch (error) {
    say(error.message);
    const text = document.createElement("p");
    text.textContent = error.message;
    text.className = "empty";
    document.getElementById("page").append(text);
    return;
  }
  ready = true;
  listen();
  show();
}

start();
