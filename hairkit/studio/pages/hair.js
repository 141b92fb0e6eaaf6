// The hair that turns and moves, and its files.
import { make, onChange, refill, refresh, say, send, state } from "./api.js";
import { showHair } from "./hair_controls.js";

const engines = {
  hairworks: "HairWorks", alembic: "Blender, Unreal, Maya", gltf: "Web, Unity", usd: "Houdini, Omniverse",
  fbx: "Unity, Maya", maya: "Maya, XGen", native: "hairkit", obj: "any tool", ply: "any tool",
  tressfx: "TressFX", cyhair: "CyHair", usc_data: "research", cards: "Hair cards",
};

export function show(main) {
  let shown = "";
  let close = () => {};

  async function draw() {
    if (!state.result) {
      close();
      shown = "";
      const running = state.build.state === "running";
      main.replaceChildren(make("div", { class: "empty" },
        make("h2", {}, running ? "The hair is growing" : "No hair yet"),
        make("p", { class: "quiet" }, running
          ? "It appears here by itself." : "Three photos are the least, eight are usual."),
        running ? null : state.photos.length >= 3
          ? make("button", { class: "primary", onclick: () => send("POST", "/api/build").catch((e) => say(e.message)) }, "Make the hair")
          : make("a", { class: "button primary", href: "#photos" }, "Add photos")));
      return;
    }
    const version = state.draft || state.result;
    if (shown === version) return;
    shown = version;
    try {
      const response = await fetch(`/api/result/${state.draft ? "draft" : "hair"}?v=${version}`);
      if (!response.ok) throw new Error("the hair could not be read");
      const packet = await response.arrayBuffer();
      if (shown !== version) return; // newer hair came meanwhile
      close();
      const stage = make("section", { class: "stage", id: "hair", "aria-label": "The hair in motion" });
      close = showHair(stage, packet);
      refill(main, make("div", { class: "split" }, stage, side()));
    } catch (error) {
      await refresh().catch(() => {}); // a draft goes when the whole hair comes
      if (shown === version && (state.draft || state.result) === version) say(error.message);
    }
  }

  function side() {
    const health = (state.build.health ?? []).map(([light, line]) => make("li", { class: light }, line.replace(`${light} `, "").trim()));
    const formats = [...state.formats].sort((a, b) => (engines[b[0]] ? 1 : 0) - (engines[a[0]] ? 1 : 0));
    return make("section", { class: "side", "aria-label": "Files" },
      state.draft ? make("p", { class: "note-box", role: "status" }, "This is a quick preview of your last change: the cameras are those of the hair before, the grid is coarser, and there are fewer guides. The whole hair is being made and takes its place here; files are those of the hair before until then.") : null,
      make("h2", {}, "Take it with you"),
      make("a", { class: "button primary", href: "/api/result/page", download: "result.html" }, "Save result.html"),
      make("p", { class: "quiet" }, "One file that moves in any browser and needs no server."),
      make("div", { class: "tools" }, ...formats.map(([plugin, suffix]) =>
        make("a", { href: `/api/result/${plugin}`, download: `groom${suffix}`, class: "button file" },
          make("strong", {}, suffix), make("small", {}, engines[plugin] ?? plugin)))),
      make("a", { href: "/api/result/sheet", target: "_blank" }, "Overview of all steps"),
      health.length ? make("h2", {}, "How good it is") : null,
      make("ul", { class: "lights" }, ...health),
      make("p", { class: "quiet" }, "On this machine: hairkit view PROJECT/result"));
  }

  const stop = onChange(draw);
  draw();
  return () => { stop(); close(); };
}
