// Strokes on a photo, in labelme's shape: what each tool draws, and their undoing.

const HAIR = "#ff5fa8", REST = "#64b5ff", AREA = "#f0b45f";
const DRAWN = { foreground: "#ff9fcb", rectangle: AREA, parting: AREA, background: "#9fd1ff" };
const LEAST_WIDTH_PX = 3, THIN_PX = 2; // of a line, and of the edge of an area
const WIDTH = 0.0083; // of a line, over the photo's height

export const TOOLS = {
  foreground: { name: "Hair", key: "f", label: "foreground", type: "linestrip", colour: HAIR },
  background: { name: "Not hair", key: "b", label: "background", type: "linestrip", colour: REST },
  hairArea: { name: "Hair area", key: "g", label: "foreground", type: "polygon", colour: HAIR },
  restArea: { name: "Other area", key: "n", label: "background", type: "polygon", colour: REST },
  edgeHair: {
    name: "Edge: hair", key: "w", label: "foreground", type: "linestrip", colour: HAIR, brush: true,
  },
  edgeRest: {
    name: "Edge: rest", key: "s", label: "background", type: "linestrip", colour: REST, brush: true,
  },
  rectangle: {
    name: "Rectangle", key: "r", label: "rectangle", type: "rectangle", colour: AREA,
  },
  parting: { name: "Parting", key: "p", label: "parting", type: "linestrip", colour: AREA },
  erase: { name: "Remove", key: "e", colour: "#eceef0" },
};

export class Strokes {
  constructor() {
    this.shapes = [];
    this.undone = [];
    this.current = null; // the one that is being drawn
    this.unsaved = this.saving = false;
  }

  // Begins a stroke; the radius, in pixels of the photo, is that of an edge brush.
  begin(tool, point, radius) {
    const { label, type, brush } = TOOLS[tool];
    const points = type === "rectangle" ? [point, point] : [point];
    this.current = { label, shape_type: type, points, group_id: null, flags: {} };
    if (brush) this.current.radius = radius;
  }

  lead(point) {
    if (this.current.shape_type === "rectangle") this.current.points[1] = point;
    else this.current.points.push(point);
  }

  // Ends the stroke that is being drawn; returns whether there is a new one.
  end() {
    const done = finished(this.current);
    this.current = null;
    if (!done) return false;
    const others = (shape) => done.label !== "rectangle" || shape.label !== "rectangle";
    this.shapes = [...this.shapes.filter(others), done];
    this.undone = [];
    return true;
  }

  // Removes the first stroke that comes nearer to a point; returns whether there was one.
  erase(point, near) {
    const away = (p) => Math.hypot(p[0] - point[0], p[1] - point[1]);
    const hit = this.shapes.find((shape) => Math.min(...shape.points.map(away)) < near);
    this.shapes = this.shapes.filter((shape) => shape !== hit);
    return Boolean(hit);
  }

  // Takes the last stroke back (-1) or gives it again (1); returns whether there was one.
  step(direction) {
    const [from, to] = direction < 0 ? ["shapes", "undone"] : ["undone", "shapes"];
    if (!this[from].length) return false;
    this[to] = [...this[to], this[from].at(-1)];
    this[from] = this[from].slice(0, -1);
    return true;
  }

  // What was taken back is kept in the tab, so that a reload of the page does not lose it.
  keep(photo) {
    sessionStorage.setItem(`undone-${photo}`, JSON.stringify(this.undone));
  }

  recall(photo) {
    this.undone = JSON.parse(sessionStorage.getItem(`undone-${photo}`) ?? "[]");
  }

  draw(context, scale, height) {
    for (const shape of this.shapes) drawShape(context, shape, scale, height);
    if (this.current) drawShape(context, this.current, scale, height, true);
  }
}

// The stroke as it is kept, or null where it has no extent.
function finished(shape) {
  const { points, shape_type: type } = shape;
  if (type === "linestrip" && points.length === 1) return { ...shape, shape_type: "point" };
  if (type === "polygon") {
    const hull = convexHull(points);
    return hull.length > 2 ? { ...shape, points: hull } : null;
  }
  if (type !== "rectangle") return shape;
  const [a, b] = points;
  return a[0] === b[0] || a[1] === b[1] ? null : shape;
}

function drawShape(context, shape, scale, height, underWay = false) {
  const line = shape.shape_type === "linestrip";
  context.strokeStyle = DRAWN[shape.label];
  context.lineJoin = context.lineCap = "round";
  context.lineWidth = line ? Math.max(WIDTH * height, LEAST_WIDTH_PX / scale) : THIN_PX / scale;
  context.globalAlpha = 1;
  if (shape.radius && underWay) {
    context.globalAlpha = 0.45;
    context.lineWidth = 2 * shape.radius;
  } else if (shape.radius) {
    context.setLineDash([3 * context.lineWidth, 2 * context.lineWidth]);
  }
  context.beginPath();
  trace(context, shape);
  context.stroke();
  context.globalAlpha = 1;
  context.setLineDash([]);
}

function trace(context, { label, shape_type: type, points }) {
  const [first, ...rest] = points;
  if (type === "rectangle") {
    const [second] = rest;
    context.rect(...first, second[0] - first[0], second[1] - first[1]);
    return;
  }
  context.moveTo(...first);
  for (const point of rest.length ? rest : [first]) context.lineTo(...point);
  if (type === "polygon") {
    context.closePath();
    context.fillStyle = `${DRAWN[label]}66`; // 40 % of it
    context.fill();
  }
}

function convexHull(points) {
  const sorted = [...points].sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  const half = (list) => {
    const hull = [];
    for (const p of list) {
      while (hull.length > 1) {
        const [a, b] = hull.slice(-2);
        if ((b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) > 0) break;
        hull.pop();
      }
      hull.push(p);
    }
    return hull.slice(0, -1);
  };
  return [...half(sorted), ...half(sorted.reverse())];
}
