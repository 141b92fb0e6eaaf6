// The camera of this machine: its stream, and pictures of the middle with sides 3 : 4.
import { make } from "./api.js";
import { measure } from "./picture_light.js";

const BURST = 3, BURST_MS = 110; // pictures of which the sharpest is taken, and time between two
const LOOK_WIDTH = 300; // of the small pictures for the server
const NO_SECURE_PAGE = "This page was opened over plain HTTP from another machine, and browsers "
  + "give such pages no camera. Start the studio with --lan and scan its code, or choose photos.";
const REASONS = {
  NotAllowedError: "The camera is blocked for this page. Allow it beside the address, or choose "
    + "photos.",
  NotFoundError: "This machine has no camera. Use a phone, or choose photos.",
  NotReadableError: "Another program uses the camera. Close it, or choose photos.",
};

export class Camera {
  constructor() {
    this.video = make("video", {
      playsinline: true, muted: true, autoplay: true, "aria-label": "Picture of the camera",
    });
    this.video.muted = true;
    this.stream = null;
    this.left = false; // the page was left: a camera that starts late is stopped at once
  }

  // Starts a camera, or the usual one; returns all that there are, or null when the page was left.
  // An error says what a user can do.
  async start(device) {
    this.stop();
    if (!window.isSecureContext || !navigator.mediaDevices) throw new Error(NO_SECURE_PAGE);
    try {
      this.stream = await navigator.mediaDevices.getUserMedia({
        audio: false,
        video: {
          facingMode: { ideal: "environment" }, width: { ideal: 1920 }, height: { ideal: 1440 },
          ...(device ? { deviceId: { exact: device } } : {}),
        },
      });
      this.video.srcObject = this.stream;
      await this.video.play();
      const found = await navigator.mediaDevices.enumerateDevices();
      if (!this.left) return found.filter((each) => each.kind === "videoinput");
    } catch (error) {
      const reason = REASONS[error.name] ?? `The camera does not start (${error.message}).`;
      if (!this.left) throw new Error(reason, { cause: error });
    }
    this.stop();
    return null;
  }

  stop() {
    for (const track of this.stream?.getTracks() ?? []) track.stop();
    this.stream = null;
  }

  leave() {
    this.left = true;
    this.stop();
  }

  get running() {
    return this.video.videoWidth > 0;
  }

  // What is taken of the picture, and where the outline is: left, top, width, height.
  crop() {
    const w = this.video.videoWidth, h = this.video.videoHeight;
    const wide = w / h > 3 / 4;
    const width = wide ? Math.round((h * 3) / 4) : w, height = wide ? h : Math.round((w * 4) / 3);
    return [Math.round((w - width) / 2), Math.round((h - height) / 2), width, height];
  }

  // The picture of this moment, as large as it is or smaller.
  picture(width = this.crop()[2]) {
    const [x, y, w, h] = this.crop();
    const made = make("canvas", { width, height: Math.round((width * h) / w) });
    made.getContext("2d").drawImage(this.video, x, y, w, h, 0, 0, made.width, made.height);
    return made;
  }

  small() {
    return jpeg(this.picture(LOOK_WIDTH), 0.8);
  }

  // The sharpest of a few pictures in a row; sharpness is measured at a width.
  async sharpest(width) {
    let best = null;
    for (let k = 0; k < BURST; k += 1) {
      if (k) await new Promise((done) => { setTimeout(done, BURST_MS); });
      const picture = this.picture();
      const { sharp } = measure(picture, [0, 0, picture.width, picture.height], width);
      if (!best || sharp > best.sharp) best = { picture, sharp };
    }
    return jpeg(best.picture, 0.95);
  }
}

function jpeg(picture, quality) {
  return new Promise((done) => { picture.toBlob(done, "image/jpeg", quality); });
}
