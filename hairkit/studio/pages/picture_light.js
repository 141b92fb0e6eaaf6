// Light and sharpness of the camera's picture.
import { make } from "./api.js";

const small = make("canvas");

// Grey levels, their mean, and the variance of the Laplacian, of a part of a picture (left, top,
// width, height) at a width of its own.
export function measure(source, [x, y, w, h], width) {
  small.width = width;
  small.height = Math.round((width * h) / w);
  const context = small.getContext("2d", { willReadFrequently: true });
  context.drawImage(source, x, y, w, h, 0, 0, small.width, small.height);
  const { data } = context.getImageData(0, 0, small.width, small.height);
  const grey = new Float32Array(small.width * small.height);
  let sum = 0;
  for (let i = 0; i < grey.length; i += 1) {
    grey[i] = 0.299 * data[4 * i] + 0.587 * data[4 * i + 1] + 0.114 * data[4 * i + 2];
    sum += grey[i];
  }
  return { grey, mean: sum / grey.length, sharp: sharpness(grey, small.width, small.height) };
}

function sharpness(grey, width, height) {
  let edges = 0, squares = 0, count = 0;
  for (let v = 1; v < height - 1; v += 1) {
    for (let u = 1; u < width - 1; u += 1) {
      const i = v * width + u;
      const edge = grey[i - 1] + grey[i + 1] + grey[i - width] + grey[i + width] - 4 * grey[i];
      edges += edge;
      squares += edge * edge;
      count += 1;
    }
  }
  return squares / count - (edges / count) ** 2;
}

// How much a picture differs from the one before, in grey levels of a pixel.
export function difference(grey, before) {
  if (before?.length !== grey.length) return Infinity;
  return grey.reduce((sum, value, i) => sum + Math.abs(value - before[i]), 0) / grey.length;
}
