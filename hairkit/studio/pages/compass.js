// The direction in which a phone looks, where it has the sensors for it.

export class Compass {
  constructor() {
    this.heading = null; // degrees over the ground
    this.front = null; // the heading from which the head's front is seen
  }

  // Listens to the sensors; returns what ends that.
  listen() {
    const turned = (event) => {
      if (event.webkitCompassHeading != null) this.heading = event.webkitCompassHeading;
      else if (event.alpha != null && event.beta != null && event.gamma != null) {
        this.heading = headingOf(event);
      }
    };
    addEventListener("deviceorientation", turned);
    return () => removeEventListener("deviceorientation", turned);
  }

  // The first photo tells how the head stands, by the azimuth of its view.
  begin(azimuth) {
    if (this.front === null && this.heading !== null) this.front = this.heading + azimuth;
  }

  // Degrees from the view of an azimuth, -180 to 180; null where that is not known.
  away(azimuth) {
    if (this.heading === null || this.front === null) return null;
    return ((this.heading - this.front + azimuth + 540) % 360) - 180;
  }
}

// The direction of the camera's axis over the ground, degrees (W3C, Device Orientation, A.1).
function headingOf({ alpha, beta, gamma }) {
  const [a, b, g] = [alpha, beta, gamma].map((v) => (v * Math.PI) / 180);
  const x = -Math.cos(a) * Math.sin(g) - Math.sin(a) * Math.sin(b) * Math.cos(g);
  const y = -Math.sin(a) * Math.sin(g) + Math.cos(a) * Math.sin(b) * Math.cos(g);
  return ((Math.atan2(x, y) * 180) / Math.PI + 360) % 360;
}
