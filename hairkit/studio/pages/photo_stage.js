// A photo on a canvas: its picture, where its pixels are on the page, and the strip of all photos.
import { make, refill, state } from "./api.js";

const MOST_ZOOM = 12;

export class PhotoStage {
  constructor(label) {
    this.canvas = make("canvas", { tabindex: "0", role: "img", "aria-label": label });
    this.element = make("section", { class: "stage", "aria-label": "Photo" }, this.canvas);
    this.image = null;
    this.facts = null; // what the server found in the photo: size, outline, landmarks
    this.zoom = 1;
    this.shift = [0, 0]; // pixels of the page
  }

  // Shows a photo's picture as soon as it has come; nothing is known of the photo yet.
  open(photo, redraw) {
    this.image = this.facts = null;
    this.showWhole();
    const picture = new Image();
    this.awaited = picture;
    picture.onload = () => {
      if (this.awaited !== picture) return; // another photo was opened meanwhile
      this.image = picture;
      redraw();
    };
    picture.src = `/api/photos/${photo.id}/large?v=${photo.version}`;
  }

  showWhole() {
    this.zoom = 1;
    this.shift = [0, 0];
  }

  // The photo's size, and scale and shift from its pixels to those of the page.
  placed() {
    const { clientWidth: w, clientHeight: h } = this.canvas;
    const pw = this.facts?.width ?? this.image?.naturalWidth ?? 1;
    const ph = this.facts?.height ?? this.image?.naturalHeight ?? 1;
    const scale = this.zoom * Math.min(w / pw, h / ph);
    const [dx, dy] = this.shift;
    return { scale, x: (w - pw * scale) / 2 + dx, y: (h - ph * scale) / 2 + dy, pw, ph };
  }

  toPage([u, v]) {
    const { scale, x, y } = this.placed();
    return [u * scale + x, v * scale + y];
  }

  toPhoto([px, py]) {
    const { scale, x, y } = this.placed();
    return [(px - x) / scale, (py - y) / scale];
  }

  // Draws the picture alone; returns the context, which takes pixels of the photo.
  begin(filter = "none") {
    const { canvas } = this;
    const sharp = Math.min(devicePixelRatio || 1, 2);
    canvas.width = Math.round(canvas.clientWidth * sharp);
    canvas.height = Math.round(canvas.clientHeight * sharp);
    const context = canvas.getContext("2d");
    const { scale, x, y, pw, ph } = this.placed();
    context.setTransform(sharp * scale, 0, 0, sharp * scale, sharp * x, sharp * y);
    if (this.image) {
      context.filter = filter;
      context.drawImage(this.image, 0, 0, pw, ph);
      context.filter = "none";
    }
    return context;
  }

  // Zooms so that the photo's point under a point of the page stays there.
  zoomAbout(factor, point) {
    const fixed = this.toPhoto(point);
    this.zoom = Math.max(1, Math.min(MOST_ZOOM, this.zoom * factor));
    if (this.zoom === 1) { this.shift = [0, 0]; return; }
    const moved = this.toPage(fixed);
    this.shift = this.shift.map((value, k) => value + point[k] - moved[k]);
  }

  // Draws again whenever the canvas changes its size; returns what ends that.
  watchSize(redraw) {
    const sized = new ResizeObserver(redraw);
    sized.observe(this.canvas);
    return () => sized.disconnect();
  }
}

// Fills a strip with the thumbnails of all photos, of which one is shown.
export function fillStrip(strip, shown, open) {
  refill(strip, ...state.photos.map((photo, i) => make("button", {
    "aria-label": `Photo ${i + 1}`, "aria-pressed": String(photo.id === shown?.id),
    onclick: () => open(photo),
  }, thumbnail(photo))));
}

export function thumbnail(photo, values = {}) {
  return make("img", {
    src: `/api/photos/${photo.id}/small?v=${photo.version}`, alt: "", ...values,
  });
}

// The photo that the address names, else the first one.
export function photoOf(argument) {
  return state.photos.find((photo) => String(photo.id) === argument) ?? state.photos[0];
}

export function showNoPhotos(main) {
  main.replaceChildren(make("div", { class: "empty" }, make("h2", {}, "No photos yet"),
    make("a", { class: "button primary", href: "#photos" }, "Add photos")));
}

export function dot(context, point, radius) {
  context.beginPath();
  context.arc(...point, radius, 0, 2 * Math.PI);
  context.fill();
}
