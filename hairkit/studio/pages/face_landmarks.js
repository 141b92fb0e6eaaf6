// The 68 landmarks of a face, moved by pointers and keys.
import { pathOf } from "./api.js";
import { dot } from "./photo_stage.js";

const PARTS = [
  [0, 17], [17, 22], [22, 27], [27, 31], [31, 36], [36, 42], [42, 48], [48, 60], [60, 68],
]; // jaw, brows, nose, eyes, lips
const CLOSED = new Set([36, 42, 48, 60]);
const NOSE = 30; // its tip
const NEAR_PX = 18; // a landmark is taken within this distance
const COLOUR = "#f0b45f";
const WAYS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

export class Landmarks {
  constructor(stage, redraw) {
    this.stage = stage;
    this.redraw = redraw;
    this.points = null; // [[u, v], ...] in the photo, or null where no face is found
    this.chosen = NOSE;
    this.dragged = -1;
  }

  take(place) {
    if (!this.points) return;
    const away = this.points.map((point) => {
      const [x, y] = this.stage.toPage(point);
      return Math.hypot(x - place[0], y - place[1]);
    });
    const nearest = away.indexOf(Math.min(...away));
    if (away[nearest] >= NEAR_PX) return;
    this.dragged = this.chosen = nearest;
    this.redraw();
  }

  drag(place) {
    if (this.dragged < 0) return;
    this.points[this.dragged] = this.stage.toPhoto(place);
    this.redraw();
  }

  release() {
    this.dragged = -1;
  }

  key(event) {
    const { points } = this;
    if (!points) return;
    const way = WAYS[event.key];
    if (way) {
      event.preventDefault();
      const pixels = event.shiftKey ? 10 : 1;
      points[this.chosen] = points[this.chosen].map((value, k) => value + way[k] * pixels);
    }
    const next = { n: 1, p: points.length - 1 }[event.key] ?? 0;
    this.chosen = (this.chosen + next) % points.length;
    this.redraw();
  }

  draw(context) {
    if (!this.points) return;
    const { scale } = this.stage.placed();
    context.strokeStyle = context.fillStyle = COLOUR;
    context.lineWidth = 1.5 / scale;
    for (const [first, last] of PARTS) {
      const line = this.points.slice(first, last).flat();
      context.stroke(new Path2D(pathOf([line], CLOSED.has(first))));
    }
    this.points.forEach((p, i) => dot(context, p, (i === this.chosen ? 5 : 3) / scale));
  }
}
