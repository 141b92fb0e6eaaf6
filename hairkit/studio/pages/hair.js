// The hair that turns and moves, and its files.
import { get, make, onChange, prepare, refill, say, send, state } from "./api.js";
import { HairBrush } from "./hair_brush.js";
import { showHair } from "./hair_controls.js";

const LEAST_PHOTOS = 1;
const USES = {
  "for-unreal": "Unreal Engine", "for-unity": "Unity", "for-blender": "Blender",
  "for-maya": "Maya, XGen", "for-houdini": "Houdini", "for-hairworks": "HairWorks",
  "for-web": "Web, three.js", hairworks: "guides", alembic: "guides", gltf: "ribbons, head",
  usd: "Omniverse", fbx: "head", maya: "curves", native: "hairkit", obj: "any tool",
  ply: "any tool", tressfx: "TressFX", cyhair: "CyHair", usc_data: "research",
  cards: "Hair cards",
};
const DRAFT = "This is a quick preview of your last change. After a stroke on a photo its cameras "
  + "are those of the hair before, its grid is coarser, and it has fewer guides. The whole hair is "
  + "being made and takes its place here; files are those of the hair before until then.";

export function show(main) {
  let shown = "", side = null;
  const seen = {}, brush = new HairBrush();
  let close = () => {};

  async function draw() {
    if (!state.result) {
      close();
      shown = "";
      main.replaceChildren(absence());
      return;
    }
    const version = state.draft || state.result;
    if (shown === version) {
      side?.follow();
      return;
    }
    shown = version;
    try {
      const packet = await packetOf(version);
      if (shown !== version) return; // newer hair came meanwhile, or the page was left
      close();
      const stage = make("section",
        { class: "stage", id: "hair", "aria-label": "The hair in motion" });
      close = showHair(stage, packet, { seen, brush });
      side = new Side();
      if (astray().length) say(astray().join(" · ")); // on a phone the files are not seen
      refill(main, make("div", { class: "split" }, stage, side.element));
    } catch (error) {
      const now = await get("/api/project").catch(() => state);
      const gone = (now.draft || now.result) !== version; // as a draft when the whole hair comes
      if (shown === version && !gone) say(error.message);
    }
  }

  const stop = onChange(draw);
  draw();
  return () => { stop(); close(); shown = ""; };
}

async function packetOf(version) {
  const response = await fetch(`/api/result/${state.draft ? "draft" : "hair"}?v=${version}`);
  if (!response.ok) throw new Error("the hair could not be read");
  return response.arrayBuffer();
}

// What is shown while there is no hair.
function absence() {
  const running = state.build.state === "running";
  const build = () => send("POST", "/api/build").catch((error) => say(error.message));
  const onward = state.photos.length >= LEAST_PHOTOS
    ? make("button", { class: "primary", onclick: build }, "Make the hair")
    : make("a", { class: "button primary", href: "#photos" }, "Add photos");
  return make("div", { class: "empty" },
    make("h2", {}, running ? "The hair is growing" : "No hair yet"),
    make("p", { class: "quiet" }, running
      ? "It appears here by itself." : "One photo is enough, eight are usual."),
    running ? null : onward);
}

// The files of the hair, and how good it is.
class Side {
  constructor() {
    this.formats = String(state.formats);
    this.element = make("section", { class: "side", "aria-label": "Files" }, ...offers());
  }

  // A studio that has just started learns later in which formats it can write.
  follow() {
    if (this.formats === String(state.formats)) return;
    this.formats = String(state.formats);
    refill(this.element, ...offers());
  }
}

// What is said of strokes that reach no hair any more.
function astray() { return state.build.astray ?? []; }

function offers() {
  const health = (state.build.health ?? []).map(([light, line]) =>
    make("li", { class: light }, line.replace(`${light} `, "").trim()));
  const known = ([format]) => (USES[format] ? 1 : 0);
  const formats = [...state.formats].sort((a, b) => known(b) - known(a));
  const [engines, others] = [true, false].map((zip) =>
    formats.filter(([, suffix]) => suffix.endsWith(".zip") === zip));
  return [
    state.draft ? make("p", { class: "note-box", role: "status" }, DRAFT) : null,
    ...astray().map((line) => make("p", { class: "note-box" }, line)),
    make("h2", {}, "Take it with you"),
    make("a", { class: "button primary", href: "/api/result/page", download: "result.html" },
      "Save result.html"),
    make("p", { class: "quiet" }, "One file that moves in any browser and needs no server."),
    make("div", { class: "tools" }, ...engines.map(download)),
    make("p", { class: "quiet" }, "Single files of the guides, with each format's defaults:"),
    make("div", { class: "tools" }, ...others.map(download)),
    make("a", { href: "/api/result/sheet", target: "_blank" }, "Overview of all steps"),
    health.length ? make("h2", {}, "How good it is") : null,
    make("ul", { class: "lights" }, ...health),
    make("p", { class: "quiet" }, "On this machine: hairkit view PROJECT/result"),
  ];
}

function download([format, suffix]) {
  const link = make("a",
    { href: `/api/result/${format}`, download: `groom${suffix}`, class: "button file" },
    make("strong", {}, suffix.replace("-", "")), make("small", {}, USES[format] ?? format));
  // A browser does not say why a download failed.
  link.addEventListener("click", () => prepare(link.href).catch((error) => say(error.message)));
  return link;
}
