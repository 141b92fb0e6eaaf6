// Guides in motion: Verlet integration with shape, length and head constraints.
//
// After Han and Harada, "Real-time hair simulation with efficient hair style preservation" (2012):
// points are drawn back to the captured shape, globally and from segment to segment, then lengths
// are restored from the root to the tip. The captured shape is the shape at rest under gravity.

const STEP_S = 1 / 60;
const DAMPING = 0.965; // share of the velocity kept in a step
const GLOBAL_ROOT = 0.22; // pull to the captured place at the root; it falls to GLOBAL_TIP
const GLOBAL_TIP = 0.012;
const LOCAL = 0.35; // pull to the captured direction from the segment before
const DRAG = 22; // acceleration in m/s2 of a wind of 1 m/s, relative to the hair
const CLEARANCE = 0.004; // metres between hair and head
const MOST_MOVE = 0.05; // metres in a step
const ROUNDS = 2; // of leaving the head and restoring the length; the length is restored last

export class HairMotion {
  constructor(packet) {
    const { guides, capsules } = packet.arrays;
    [this.count, this.points] = guides.shape;
    this.captured = guides.data;
    this.rest = Float32Array.from(guides.data); // brushes change it
    this.tints = Uint32Array.from(packet.arrays.tint.data); // and these: packed colours
    this.now = Float32Array.from(guides.data);
    this.before = Float32Array.from(guides.data);
    this.stiff = packet.arrays.stiff.data; // 1 for brows, lashes and beard: they stay
    this.capsules = capsules.data;
    this.wind = [0, 0, 0];
    this.turn = 0; // radians about the vertical axis, of the head
    this.turnBefore = 0;
    this.time = 0;
    this.left = 0;
    this.held = null; // {guide, point, at: [x, y, z]}
    this.shown = new Map(); // shapes and tints of guides before the stroke
    this.lengths = new Float32Array(this.count * this.points);
    for (let g = 0; g < this.count; g += 1) {
      for (let p = 1; p < this.points; p += 1) {
        const i = (g * this.points + p) * 3;
        const along = [0, 1, 2].map((k) => this.rest[i + k] - this.rest[i + k - 3]);
        this.lengths[g * this.points + p] = Math.hypot(...along);
      }
    }
  }

  // Gives guides the shapes and tints that a stroke under way makes of them; others go back.
  show(guides, points, tints) {
    const { points: size } = this;
    for (const [g, [shape, tint]] of this.shown) this.shape(g, shape, tint);
    guides.forEach((g, k) => {
      const [from, to] = [g * size, (g + 1) * size];
      if (!this.shown.has(g))
        this.shown.set(g, [this.rest.slice(3 * from, 3 * to), this.tints.slice(from, to)]);
      this.shape(g, points[k].flat(), tints[k]);
    });
  }

  // Sets the shape at rest of a guide, which goes along, and its tint.
  shape(g, places, tint) {
    const { rest, now, before, lengths, points } = this;
    this.tints.set(tint, g * points);
    for (let p = 0; p < points; p += 1) {
      const i = (g * points + p) * 3;
      for (let k = 0; k < 3; k += 1) {
        const way = places[3 * p + k] - rest[i + k];
        rest[i + k] += way; now[i + k] += way; before[i + k] += way;
      }
      if (!p) continue;
      lengths[i / 3] = Math.hypot(...[0, 1, 2].map((k) => rest[i + k] - rest[i + k - 3]));
    }
  }

  advance(seconds) {
    this.left = Math.min(this.left + seconds, 3 * STEP_S);
    while (this.left >= STEP_S) {
      this.left -= STEP_S;
      this.step();
    }
  }

  // Positions are in the head's frame; a turning head is felt as a force.
  step() {
    this.time += STEP_S;
    const swing = this.turn - this.turnBefore;
    this.turnBefore = this.turn;
    for (let g = 0; g < this.count; g += 1) {
      if (this.stiff[g]) continue;
      this.drift(g, swing);
      if (this.held?.guide === g) this.hold(g);
      this.constrain(g);
    }
  }

  // Moves the points of a guide by their velocity, wind, the head's turn and the captured place.
  drift(g, swing) {
    const { now, before, rest, points, wind, time } = this;
    const gust = 0.55 + 0.45 * Math.sin(3.1 * time + 0.37 * g) * Math.sin(1.7 * time + 0.11 * g);
    for (let p = 1; p < points; p += 1) {
      const i = (g * points + p) * 3;
      const share = p / (points - 1);
      const vx = (now[i] - before[i]) * DAMPING;
      const vy = (now[i + 1] - before[i + 1]) * DAMPING;
      const vz = (now[i + 2] - before[i + 2]) * DAMPING;
      const push = DRAG * gust * share * STEP_S * STEP_S;
      for (let k = 0; k < 3; k += 1) before[i + k] = now[i + k];
      // the head turns by `swing`: seen from it, the hair turns back
      const x = now[i], z = now[i + 2];
      now[i] += limited(vx + wind[0] * push - swing * z * share);
      now[i + 1] += limited(vy + wind[1] * push);
      now[i + 2] += limited(vz + wind[2] * push + swing * x * share);
      const pull = GLOBAL_TIP + (GLOBAL_ROOT - GLOBAL_TIP) * (1 - share) ** 3;
      for (let k = 0; k < 3; k += 1) now[i + k] += pull * (rest[i + k] - now[i + k]);
    }
  }

  // From the root to the tip: the captured direction, then head and length.
  constrain(g) {
    const { now, rest, points, lengths } = this;
    for (let p = 1; p < points; p += 1) {
      const i = (g * points + p) * 3, j = i - 3;
      const kept = this.held?.guide === g && this.held.point === p;
      if (!kept) {
        for (let k = 0; k < 3; k += 1) {
          const goal = now[j + k] + rest[i + k] - rest[j + k];
          now[i + k] += LOCAL * (goal - now[i + k]) * (1 - 0.7 * p / points);
        }
      }
      for (let round = 0; round < ROUNDS; round += 1) {
        this.leaveHead(i);
        this.restoreLength(i, lengths[g * points + p]);
      }
    }
  }

  // Moves a point to its distance from the one before.
  restoreLength(i, length) {
    const { now } = this, j = i - 3;
    const dx = now[i] - now[j], dy = now[i + 1] - now[j + 1], dz = now[i + 2] - now[j + 2];
    const scale = length / Math.max(Math.hypot(dx, dy, dz), 1e-9);
    now[i] = now[j] + dx * scale;
    now[i + 1] = now[j + 1] + dy * scale;
    now[i + 2] = now[j + 2] + dz * scale;
  }

  hold(g) {
    const { point, at } = this.held;
    for (let p = 1; p < this.points; p += 1) {
      const i = (g * this.points + p) * 3;
      const near = Math.exp(-((p - point) ** 2) / 8);
      for (let k = 0; k < 3; k += 1) {
        const goal = at[k] + this.rest[i + k] - this.rest[(g * this.points + point) * 3 + k];
        this.now[i + k] += near * (goal - this.now[i + k]);
      }
    }
  }

  // Moves a point out of the head's capsules, as far as the captured shape is outside of them.
  leaveHead(i) {
    const { now, rest, capsules } = this;
    for (let c = 0; c < capsules.length; c += 8) {
      const room = distance(capsules, c, rest[i], rest[i + 1], rest[i + 2]);
      const [gap, nx, ny, nz] = distanceAndNormal(capsules, c, now[i], now[i + 1], now[i + 2]);
      const depth = Math.min(room, CLEARANCE) - gap;
      if (depth > 0) {
        now[i] += depth * nx; now[i + 1] += depth * ny; now[i + 2] += depth * nz;
      }
    }
  }
}

function limited(move) {
  return Math.max(-MOST_MOVE, Math.min(MOST_MOVE, move));
}

function distance(capsules, c, x, y, z) {
  return distanceAndNormal(capsules, c, x, y, z)[0];
}

const found = [0, 0, 0, 0];
function distanceAndNormal(k, c, x, y, z) {
  const ax = k[c], ay = k[c + 1], az = k[c + 2];
  const bx = k[c + 3] - ax, by = k[c + 4] - ay, bz = k[c + 5] - az;
  const length = bx * bx + by * by + bz * bz;
  const along = (x - ax) * bx + (y - ay) * by + (z - az) * bz;
  const t = length > 0 ? Math.max(0, Math.min(1, along / length)) : 0;
  const dx = x - ax - t * bx, dy = y - ay - t * by, dz = z - az - t * bz;
  const size = Math.max(Math.hypot(dx, dy, dz), 1e-9);
  found[0] = size - (k[c + 6] + t * (k[c + 7] - k[c + 6]));
  found[1] = dx / size; found[2] = dy / size; found[3] = dz / size;
  return found;
}
