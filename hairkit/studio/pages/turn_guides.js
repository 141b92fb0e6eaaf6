// What leads through a turn: the outline of the next view, the ring of views, right and wrong.
import { make, pathOf } from "./api.js";

const DIRECTIONS = {
  front: "look at the camera", left: "left side to the camera", back: "back to the camera",
  right: "right side to the camera", top: "from above the forehead",
};
const MIDDLE = 100, RADIUS = 84, GAP = 0.05; // of the ring: units, and half of a gap in radians

// "Front: look at the camera"
export function direction({ name }) {
  const text = `${name}: ${DIRECTIONS[name] ?? "turn to the outline"}`;
  return text[0].toUpperCase() + text.slice(1);
}

export function makeOutline() {
  return make("svg", {
    class: "guide", viewBox: "0 0 3 4", preserveAspectRatio: "xMidYMid meet", "aria-hidden": "true",
  });
}

// Draws the head of a view, and the line below which the top of the hair stays.
export function drawOutline(svg, { outline, top }) {
  svg.replaceChildren(
    ...outline.map((curve) =>
      make("path", { d: pathOf([curve.map((v, i) => v * (i % 2 ? 4 : 3))], false) })),
    make("line", { x1: 0.3, x2: 2.7, y1: 4 * top, y2: 4 * top }));
}

export function makeRing() {
  return make("svg", {
    class: "ring", viewBox: "0 0 200 200", role: "img", "aria-label": "Views taken",
  });
}

// Draws an arc for each level view, by the indices of those that were taken; returns whether all
// were.
export function drawRing(ring, guides, taken, at) {
  const turn = guides.filter((guide) => !guide.elevation);
  const name = guides[at]?.name;
  ring.replaceChildren(
    ...turn.map(({ azimuth }, i) => make("path", {
      class: taken.has(i) ? "taken" : i === at ? "next" : "",
      d: arc((azimuth * Math.PI) / 180, Math.PI / turn.length - GAP),
    })),
    make("text", { x: MIDDLE, y: 108 }, `${taken.size} / ${turn.length}`),
    make("text", { class: "small", x: MIDDLE, y: 130 }, name ?? ""));
  ring.setAttribute("aria-label",
    `${taken.size} of ${turn.length} views taken, next: ${name}`);
  return taken.size >= turn.length;
}

function arc(angle, half) {
  const place = (a) => `${MIDDLE + RADIUS * Math.sin(a)} ${MIDDLE + RADIUS * Math.cos(a)}`;
  return `M${place(angle - half)}A${RADIUS} ${RADIUS} 0 0 0 ${place(angle + half)}`;
}

// Items for the pictures of a right photo and of faults, with their first words.
export function exampleItems(names, advice) {
  return names.map((name) => {
    const right = name === "good";
    const text = right ? "✓ Right" : `✗ ${advice[name][0].split(":")[0]}`;
    return make("li", { "data-example": name, class: right ? "right" : "" },
      make("img", { src: `/example-${name}.jpg`, alt: "", width: 90, height: 120 }),
      make("span", {}, text));
  });
}
