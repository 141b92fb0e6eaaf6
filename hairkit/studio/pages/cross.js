// A cross that draws without a pointer: keys move it and lower and lift its pen.
import { TOOLS } from "./strokes.js";

const REACH_PX = 22; // of its arms
const STEP_PX = 3, FAST_PX = 18; // of a key, alone and with Shift

export class Cross {
  // The page tells the tool and draws the stroke.
  constructor(page) {
    this.page = page;
    this.at = null; // the photo's point, or null where there is no cross
  }

  // Shows the cross, then lowers and lifts the pen there.
  press() {
    const { page } = this;
    const { canvas, facts } = page.stage;
    if (!facts) return;
    if (!this.at) {
      this.at = page.inside(page.stage.toPhoto([canvas.clientWidth / 2, canvas.clientHeight / 2]));
      page.status.textContent =
        "Arrow keys move the cross, Shift faster; Enter lowers the pen, Escape leaves.";
    } else if (page.strokes.current) {
      page.end(true);
    } else {
      page.begin([...this.at]);
      if (page.strokes.current) {
        page.status.textContent = "Pen down: arrow keys draw, Enter lifts it.";
      }
    }
    page.draw();
  }

  // Ends the stroke that is being drawn, or else takes the cross away.
  escape() {
    const { page } = this;
    if (!page.strokes.current && !this.at) return;
    if (!page.strokes.current) this.at = null;
    page.strokes.current = null;
    page.tell();
    page.draw();
  }

  // Moves the cross; the photo moves along where the cross would leave the page.
  move(way, fast) {
    const { page } = this;
    const { stage } = page;
    const step = (fast ? FAST_PX : STEP_PX) / stage.placed().scale;
    this.at = page.inside(this.at.map((value, k) => value + way[k] * step));
    if (page.strokes.current) page.strokes.lead([...this.at]);
    const seen = stage.toPage(this.at);
    const size = [stage.canvas.clientWidth, stage.canvas.clientHeight];
    stage.shift = stage.shift.map((value, k) =>
      value + Math.max(0, REACH_PX - seen[k]) - Math.max(0, seen[k] - size[k] + REACH_PX));
    page.draw();
  }

  draw(context, scale) {
    const [u, v] = this.at, reach = REACH_PX / scale;
    for (const [colour, width] of [["#000", 5], [TOOLS[this.page.tool].colour, 2]]) {
      context.strokeStyle = colour;
      context.lineWidth = width / scale;
      context.beginPath();
      for (const [x, y] of [[reach, 0], [-reach, 0], [0, reach], [0, -reach]]) {
        context.moveTo(u + x / 4, v + y / 4);
        context.lineTo(u + x, v + y);
      }
      context.stroke();
    }
  }
}
