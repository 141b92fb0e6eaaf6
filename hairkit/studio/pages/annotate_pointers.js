// Pointers on the mask's page: one draws or moves the photo, two zoom, and so does the wheel.

const LEAST_STEP_PX = 2.5; // between two points of a stroke
const WHEEL_ZOOM = 0.0015; // logarithm of the zoom for a pixel of the wheel

export class Pointers {
  constructor(page) {
    this.page = page;
    this.places = new Map(); // the pointers that are down, in pixels of the page
    this.pinch = null; // distance and middle of two pointers
    const { canvas } = page.stage;
    const listen = (kind, act, options) =>
      canvas.addEventListener(kind, (event) => act.call(this, event), options);
    listen("pointerdown", this.down);
    listen("pointermove", this.move);
    listen("pointerup", this.up);
    listen("pointercancel", this.up);
    listen("wheel", this.wheel, { passive: false });
  }

  down(event) {
    const { page, places } = this;
    page.stage.canvas.setPointerCapture(event.pointerId);
    page.stage.canvas.focus({ preventScroll: true });
    places.set(event.pointerId, placeOf(event));
    if (places.size === 2) {
      page.strokes.current = this.pinch = null;
      page.draw();
    } else if (event.button !== 1 && !page.moving && page.stage.facts) {
      page.cross.at = null;
      page.begin(page.inside(page.stage.toPhoto(placeOf(event))));
    }
  }

  move(event) {
    const { page, places } = this;
    const before = places.get(event.pointerId);
    if (!before) return;
    const now = placeOf(event);
    const current = page.strokes.current;
    const far = Math.hypot(now[0] - before[0], now[1] - before[1]) >= LEAST_STEP_PX;
    if (places.size === 2 || !current || far || current.shape_type === "rectangle") {
      places.set(event.pointerId, now);
      if (places.size === 2) this.zoom();
      else if (current) page.strokes.lead(page.inside(page.stage.toPhoto(now)));
      else if (page.tool !== "erase" || page.moving) this.shift(before, now);
    }
    page.draw();
  }

  shift(before, now) {
    const { stage } = this.page;
    stage.shift = stage.shift.map((value, k) => value + now[k] - before[k]);
  }

  zoom() {
    const { stage } = this.page;
    const [a, b] = [...this.places.values()];
    const wide = Math.hypot(a[0] - b[0], a[1] - b[1]);
    const middle = [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2];
    if (this.pinch) {
      stage.zoomAbout(wide / this.pinch.wide, middle);
      this.shift(this.pinch.middle, middle);
    }
    this.pinch = { wide, middle };
  }

  up(event) {
    this.places.delete(event.pointerId);
    this.pinch = null;
    this.page.end(event.type === "pointerup");
  }

  wheel(event) {
    event.preventDefault();
    this.page.stage.zoomAbout(Math.exp(-WHEEL_ZOOM * event.deltaY), placeOf(event));
    this.page.draw();
  }
}

function placeOf(event) {
  return [event.offsetX, event.offsetY];
}
