// Photos by picker or drop, their masks, what is wrong with them.
import { get, make, onChange, outlineOf, pathOf, refill, refresh, say, send, state } from "./api.js";

const videos = /^video\//;
let advice = {};

export function show(main) {
  const picker = make("input", {
    type: "file", accept: "image/*,video/*,.heic,.heif", multiple: true, hidden: true,
    id: "picker", onchange: () => add([...picker.files]),
  });
  const drop = make("div", { class: "drop", id: "drop" },
    make("h2", {}, "Photos from all around a head"),
    make("p", { class: "quiet" }, "Eight are usual, every 45 degrees, in any order. Or a video of one turn."),
    make("div", { class: "row pair" },
      make("button", { class: "primary", onclick: () => picker.click() }, "Choose photos"),
      make("a", { class: "button", href: "#capture" }, "Take them now")),
    make("p", { class: "quiet" }, "They stay on this machine; place and time are removed from the files."),
    picker);
  const progress = make("p", { role: "status", class: "quiet" });
  const list = make("ul", { class: "grid", "aria-label": "Photos of the project" });
  const next = make("div", { class: "row spread" });
  main.append(make("div", { class: "column" }, drop, progress, list, next));

  for (const kind of ["dragenter", "dragover"]) {
    main.addEventListener(kind, over);
  }
  main.addEventListener("dragleave", out);
  main.addEventListener("drop", dropped);

  function over(event) { event.preventDefault(); drop.classList.add("over"); }
  function out() { drop.classList.remove("over"); }
  function dropped(event) { event.preventDefault(); out(); add([...event.dataTransfer.files]); }

  async function add(files) {
    files.sort((a, b) => a.name.localeCompare(b.name, "en", { numeric: true }));
    let done = 0;
    for (const file of files) {
      progress.textContent = `Adding ${done + 1} of ${files.length}`;
      try {
        if (videos.test(file.type)) {
          progress.textContent = "Choosing the best pictures of the video";
          await send("POST", "/api/video", file);
        } else {
          await send("POST", `/api/photos?view=${encodeURIComponent(viewOf(file.name))}`, file);
        }
        done += 1;
      } catch (error) {
        say(`${file.name}: ${error.message}`);
      }
    }
    progress.textContent = done ? `${done} added` : "";
    picker.value = "";
  }

  function draw() {
    drop.classList.toggle("small", state.photos.length > 0);
    drop.querySelector("h2").textContent =
      state.photos.length ? "Add more photos" : "Photos from all around a head";
    refill(list, ...state.photos.map((photo) => card(photo)));
    const count = state.photos.length;
    const enough = count >= 3;
    refill(next,
      make("p", { class: "quiet" }, count === 0 ? "" : enough
        ? `${count} photos. The hair is made by itself; correct a mask only where it is wrong.`
        : `${count} of at least 3 photos`),
      ...(enough ? [state.result
        ? make("a", { class: "button primary", href: "#hair" }, "See the hair move")
        : make("button", {
          class: "primary", disabled: state.build.state === "running",
          onclick: () => send("POST", "/api/build").catch((error) => say(error.message)),
        }, state.build.state === "running" ? "Making hair…" : "Make the hair")] : []));
  }

  let before = "";
  const stop = onChange(() => {
    const now = JSON.stringify([state.photos, state.result, state.build.state]);
    if (now !== before) { before = now; draw(); }
  });
  get("/api/feedback").then((found) => { advice = found.advice; draw(); }).catch(() => {});
  draw();
  return () => {
    stop();
    for (const kind of ["dragenter", "dragover"]) main.removeEventListener(kind, over);
    main.removeEventListener("dragleave", out);
    main.removeEventListener("drop", dropped);
  };
}

// The name of a view, where the file's name tells it: the server checks it against its own list.
function viewOf(name) {
  return name.replace(/\.[^.]*$/, "").replace(/^\d+[-_. ]*/, "").toLowerCase().replaceAll("_", "-");
}

function card(photo) {
  const number = state.photos.indexOf(photo) + 1;
  const name = `Photo ${number}${photo.view ? `, ${photo.view}` : ""}`;
  const frame = make("a", { class: "frame", "data-key": `mask ${photo.id}`, href: `#annotate/${photo.id}`, "aria-label": `${name}: correct the mask` },
    make("img", { src: `/api/photos/${photo.id}/small?v=${photo.version}`, alt: "", loading: "lazy" }));
  const problem = photo.problem ? "no hair found" : (photo.feedback ?? []).map((code) => advice[code]?.[0])[0];
  const note = problem ?? (photo.share ? (photo.drawn ? "corrected" : "hair found") : "looking for hair…");
  if (photo.share) {
    outlineOf(photo).then((facts) => frame.append(hairPath(facts))).catch(() => {});
  }
  return make("li", { class: "card" }, frame, make("div", { class: "note" },
    make("span", { class: problem ? "bad" : photo.share ? "good" : "quiet" }, note),
    make("button", {
      class: "plain remove", "data-key": `remove ${photo.id}`, "aria-label": `Remove ${name}`,
      onclick: () => send("DELETE", `/api/photos/${photo.id}`).then(refresh).catch((error) => say(error.message)),
    }, "✕")));
}

export function hairPath(facts) {
  const svg = make("svg", { viewBox: `0 0 ${facts.width} ${facts.height}`, "aria-hidden": "true" });
  svg.append(make("path", { class: "hair", d: pathOf(facts.outline) }));
  return svg;
}
