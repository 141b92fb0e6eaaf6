// Photos by picker or drop, their masks, what is wrong with them.
import {
  get, make, onChange, outlineOf, pathOf, refill, refresh, say, send, state,
} from "./api.js";
import { thumbnail } from "./photo_stage.js";

const LEAST_PHOTOS = 1, MEANWHILE = 6; // photos from which hair can be, and is, made
const VIDEO = /^video\//;
let advice = {};

export function show(main) {
  const page = new PhotosPage();
  main.append(page.element);
  let before = "";
  const ends = [
    listenToDrops(main, page),
    onChange(() => {
      const now = JSON.stringify([state.photos, state.result, state.build.state]);
      if (now === before) return;
      before = now;
      page.draw();
    }),
  ];
  get("/api/feedback").then((found) => { advice = found.advice; page.draw(); }).catch(() => {});
  page.draw();
  return () => { for (const end of ends) end(); };
}

// Listens to files that are dropped on the page; returns what ends that.
function listenToDrops(main, page) {
  const over = (event) => { event.preventDefault(); page.drop.classList.add("over"); };
  const out = () => page.drop.classList.remove("over");
  const dropped = (event) => {
    event.preventDefault();
    out();
    page.add([...event.dataTransfer.files]);
  };
  const kinds = { dragenter: over, dragover: over, dragleave: out, drop: dropped };
  for (const [kind, act] of Object.entries(kinds)) main.addEventListener(kind, act);
  return () => {
    for (const [kind, act] of Object.entries(kinds)) main.removeEventListener(kind, act);
  };
}

class PhotosPage {
  constructor() {
    this.picker = make("input", {
      type: "file", accept: "image/*,video/*,.heic,.heif", multiple: true, hidden: true,
      id: "picker", onchange: () => this.add([...this.picker.files]),
    });
    this.title = make("h2", {});
    this.drop = make("div", { class: "drop", id: "drop" }, this.title,
      make("p", { class: "quiet" },
        "Eight are usual, every 45 degrees, in any order. Or a video of one turn."),
      make("div", { class: "row pair" },
        make("button", { class: "primary", onclick: () => this.picker.click() }, "Choose photos"),
        make("a", { class: "button", href: "#capture" }, "Take them now")),
      make("p", { class: "quiet" },
        "They stay on this machine; place and time are removed from the files."), this.picker);
    this.progress = make("p", { role: "status", class: "quiet" });
    this.list = make("ul", { class: "grid", "aria-label": "Photos of the project" });
    this.next = make("div", { class: "row spread" });
    this.element = make("div", { class: "column" },
      this.drop, this.progress, this.list, this.next);
  }

  async add(files) {
    files.sort((a, b) => a.name.localeCompare(b.name, "en", { numeric: true }));
    let done = 0;
    for (const file of files) {
      this.progress.textContent = `Adding ${done + 1} of ${files.length}`;
      try {
        if (VIDEO.test(file.type)) {
          this.progress.textContent = "Choosing the best pictures of the video";
          await send("POST", "/api/video", file);
        } else {
          await send("POST", `/api/photos?view=${encodeURIComponent(viewOf(file.name))}`, file);
        }
        done += 1;
      } catch (error) {
        say(`${file.name}: ${error.message}`);
      }
    }
    this.progress.textContent = done ? `${done} added` : "";
    this.picker.value = "";
  }

  draw() {
    const count = state.photos.length;
    this.drop.classList.toggle("small", count > 0);
    this.title.textContent = count ? "Add more photos" : "Photos from all around a head";
    refill(this.list, ...state.photos.map((photo) => card(photo)));
    const enough = count >= LEAST_PHOTOS;
    const photos = count === 1 ? "1 photo" : `${count} photos`;
    const text = count >= MEANWHILE
      ? `${photos}. The hair is made by itself; correct a mask only where it is wrong.`
      : `${photos}. More of them make the hair better.`;
    refill(this.next, make("p", { class: "quiet" }, count ? text : ""), enough ? onward() : null);
  }
}

// The way to the hair, or what makes it.
function onward() {
  if (state.result) {
    return make("a", { class: "button primary", href: "#hair" }, "See the hair move");
  }
  const running = state.build.state === "running";
  return make("button", {
    class: "primary", disabled: running,
    onclick: () => send("POST", "/api/build").catch((error) => say(error.message)),
  }, running ? "Making hair…" : "Make the hair");
}

// The name of a view, where the file's name tells it: the server checks it against its own list.
function viewOf(name) {
  return name.replace(/\.[^.]*$/, "").replace(/^\d+[-_. ]*/, "").toLowerCase().replaceAll("_", "-");
}

function card(photo) {
  const number = state.photos.indexOf(photo) + 1;
  const name = `Photo ${number}${photo.view ? `, ${photo.view}` : ""}`;
  const frame = make("a", {
    class: "frame", "data-key": `mask ${photo.id}`, href: `#annotate/${photo.id}`,
    "aria-label": `${name}: correct the mask`,
  }, thumbnail(photo, { loading: "lazy" }));
  if (photo.share) {
    outlineOf(photo).then((facts) => frame.append(hairPath(facts))).catch(() => {});
  }
  const remove = () => send("DELETE", `/api/photos/${photo.id}`).then(refresh)
    .catch((error) => say(error.message));
  return make("li", { class: "card" }, frame, make("div", { class: "note" }, noteOf(photo),
    make("button", {
      class: "plain remove", "data-key": `remove ${photo.id}`, "aria-label": `Remove ${name}`,
      onclick: remove,
    }, "✕")));
}

// What is wrong with a photo, or else how far its mask is.
function noteOf(photo) {
  const faults = (photo.feedback ?? []).map((code) => advice[code]?.[0]);
  const problem = photo.problem ? "no hair found" : faults[0];
  const found = photo.drawn ? "corrected" : "hair found";
  return make("span", { class: problem ? "bad" : photo.share ? "good" : "quiet" },
    problem ?? (photo.share ? found : "looking for hair…"));
}

function hairPath(facts) {
  const svg = make("svg", {
    viewBox: `0 0 ${facts.width} ${facts.height}`, "aria-hidden": "true",
  });
  svg.append(make("path", { class: "hair", d: pathOf(facts.outline) }));
  return svg;
}
