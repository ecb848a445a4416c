// Run: decoded data, and state at a given time.

function bytes(text) {
  const raw = atob(text);
  const all = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; i += 1) all[i] = raw.charCodeAt(i);
  return all;
}

// Decodes integers, each predicted from those before it. Missing values are NaN. The format is
// documented at `PackedNumbers` in `encode.rs`.
function wholes({ count, order, bytes: text }) {
  const source = bytes(text);
  const values = new Float64Array(count);
  let place = 0;
  const next = () => {
    let [code, scale] = [0, 1];
    for (;;) {
      const byte = source[place++];
      code += (byte & 0x7f) * scale;
      if (byte < 0x80) return code;
      scale *= 0x80;
    }
  };
  let [last, before] = [0, 0];
  for (let i = 0; i < count; ) {
    const code = next();
    const more = code % 2 === 1 ? (code - 1) / 2 : -code / 2;
    for (let left = code === 0 ? next() + 1 : 1; left > 0; left -= 1, i += 1) {
      if (code === 1) {
        values[i] = NaN;
        continue;
      }
      const value = (order === 2 ? 2 * last - before : last) + more;
      [before, last] = [last, value];
      values[i] = value;
    }
  }
  return values;
}
const rowsOf = (packed) => new Uint32Array(wholes(packed));
function measures(packed) {
  const all = new Float32Array(wholes(packed));
  for (let i = 0; i < all.length; i += 1) all[i] *= packed.step;
  return all;
}

// Decodes `f32` values stored by their upper three bytes.
function floats(packed) {
  const upper = wholes(packed);
  const bits = Uint32Array.from(upper, (value) =>
    Number.isNaN(value) ? 0x7fc00000 : ((value < 0 ? 0x80000000 : 0) + Math.abs(value) * 0x100) >>> 0,
  );
  return new Float32Array(bits.buffer);
}

// Decodes the vertices and faces of a mesh.
function unpackMesh(piece) {
  const [numbers, corners] = [measures(piece.mesh.vertices), rowsOf(piece.mesh.triangles)];
  const count = numbers.length / 3;
  for (let i = 0; i < count; i += 1) {
    piece.vertices.push([numbers[i], numbers[count + i], numbers[2 * count + i]]);
  }
  for (let i = 0; i < corners.length; i += 3) {
    const vertices = Array.from(corners.subarray(i, i + 3));
    const [a, b, c] = vertices.map((vertex) => piece.vertices[vertex]);
    const across = cross(subtract(b, a), subtract(c, a));
    // Rounding may flatten a small triangle.
    if (length(across) > 0) piece.faces.push({ vertices, normal: unit(across) });
  }
}

const NAMES = ["A", "B"];
const UP = [0, 0, 1];
// Partner of a contact with the ground.
const GROUND = -1;

// Directions of the 98 grid points on the surface of a cube of 4 × 4 × 4 cells.
const ALONG = [-2, -1, 0, 1, 2];
const DIRECTIONS = ALONG.flatMap((x) => ALONG.flatMap((y) => ALONG.map((z) => [x, y, z]))).filter(
  (direction) => direction.some((part) => Math.abs(part) === 2),
);

// Extreme points in these directions. Round shapes exceed their hull by at most 3 % of the
// diameter.
function outermost(points) {
  if (points.length <= DIRECTIONS.length) return points;
  const found = new Set();
  for (const direction of DIRECTIONS) {
    let [best, most] = [points[0], -Infinity];
    for (const point of points) {
      const height = dot(direction, point);
      if (height > most) [best, most] = [point, height];
    }
    found.add(best);
  }
  return Array.from(found);
}

// Points whose convex hull contains a body, approximately if it has many points.
const spanOf = (body) => outermost(boundsOf(body));

function boundsOf({ points, pieces }) {
  if (pieces.length === 0) return points;
  const sides = [-1, 1];
  return pieces.flatMap(({ vertices, radius }) =>
    radius === 0
      ? vertices
      : vertices.flatMap((vertex) =>
          sides.flatMap((x) =>
            sides.flatMap((y) => sides.map((z) => add(vertex, times([x, y, z], radius)))),
          ),
        ),
  );
}

class Run {
  constructor(data, index) {
    const { frames } = data;
    this.index = index;
    // Largest number of tests whether a piece hides a contact, in one picture.
    this.mostTests = Infinity;
    // Length of the longest arrow (m), which a stage adapts to its picture.
    this.longest = data.arrows.longest;
    // Radius of the ground over that of a recorded motion.
    this.roam = 1;
    this.name = NAMES[index];
    this.data = data;
    this.rows = data.rows;
    this.step = data.step;
    this.duration = (data.rows - 1) * data.step;
    this.every = frames.every;
    this.count = frames.count;
    this.origin = frames.origin;
    this.positions = measures(frames.positions);
    this.attitudes = measures(frames.attitudes);
    this.speeds = measures(frames.speeds);
    this.residuals = floats(frames.residuals);
    this.statuses = bytes(frames.statuses);
    this.readForces(frames);
    this.jointForces = measures(frames.joint_forces);
    this.bodies = data.bodies;
    const pieces = this.bodies.concat(data.fixed).flatMap((body) => body.pieces);
    for (const piece of pieces) if (piece.mesh) unpackMesh(piece);
    this.hasCollision = this.bodies.some(({ collision }) => collision.length > 0);
    for (const body of this.bodies.concat(data.fixed)) body.span = spanOf(body);
    const reach = ({ points, pieces }) => {
      const ends = pieces.flatMap(({ vertices, radius }) => vertices.map((v) => length(v) + radius));
      return largest(ends.length > 0 ? ends : points.map(length));
    };
    this.reaches = this.bodies.map(reach);
    this.smallestReach = smallest(this.reaches);
    // Four significant digits of the smallest body's size and of the largest speed.
    this.lengthDecimals = decimalsOf(this.smallestReach);
    this.speedDecimals = decimalsOf(this.speeds.reduce((most, v) => (v > most ? v : most), 0));
  }

  // Frames that divide the path of a body's centre of mass into about `pieces` equal parts.
  way(body, pieces) {
    const at = (frame) => this.position(frame, body);
    const step = (a, b) => length(subtract(at(b), at(a))) || 0;
    let total = 0;
    for (let frame = 1; frame < this.count; frame += 1) total += step(frame - 1, frame);
    const frames = [0];
    for (let frame = 1; frame < this.count; frame += 1) {
      if (step(frames.at(-1), frame) > total / pieces) frames.push(frame);
    }
    if (frames.at(-1) !== this.count - 1) frames.push(this.count - 1);
    return frames;
  }

  // Row of a frame. Frames are every `every`-th row and the last one.
  row(frame) {
    return Math.min(frame * this.every, this.rows - 1);
  }

  time(frame) {
    return this.row(frame) * this.step;
  }

  // Last frame not later than `time`.
  frame(time) {
    // A tolerance of a millionth of a step allows for rounding of times.
    const row = Math.floor(time / this.step + 1e-6);
    if (row >= this.rows - 1) return this.count - 1;
    return Math.max(0, Math.floor(row / this.every));
  }

  // Frame whose forces are shown at `time`. No step follows the last frame, which shows those of the step
  // before.
  forceFrame(time) {
    return Math.max(0, Math.min(this.frame(time), this.count - 2));
  }

  position(frame, body) {
    const at = 3 * body * this.count + frame;
    return this.origin.map((start, axis) => start + this.positions[at + axis * this.count]);
  }

  attitude(frame, body) {
    const at = 4 * body * this.count + frame;
    const q = [0, 1, 2, 3].map((part) => this.attitudes[at + part * this.count]);
    const size = Math.hypot(...q);
    return q.map((part) => part / size);
  }

  speed(frame, body) {
    return this.speeds[body * this.count + frame];
  }

  // Transforms points of a body to the world frame.
  placed(frame, body, points) {
    const [place, attitude] = [this.position(frame, body), this.attitude(frame, body)];
    return points.map((point) => add(place, rotate(attitude, point)));
  }

  // Decodes the forces, sorted by frame: sites, values and points.
  readForces(frames) {
    // Contact sites: body, partner and number of forces.
    this.sites = frames.sites;
    const inFrames = rowsOf(frames.force_frames);
    const [values, points] = [measures(frames.forces), measures(frames.force_points)];
    const moments = measures(frames.moments);
    const normals = measures(frames.normals);
    this.frictions = frames.frictions;
    this.forceStarts = new Uint32Array(this.count + 1);
    for (const frame of inFrames) this.forceStarts[frame + 1] += 1;
    for (let frame = 0; frame < this.count; frame += 1) {
      this.forceStarts[frame + 1] += this.forceStarts[frame];
    }
    this.forceSites = new Uint32Array(inFrames.length);
    this.forceValues = new Float32Array(values.length);
    this.forceMoments = new Float32Array(values.length);
    this.forcePoints = new Float32Array(values.length);
    this.forceNormals = new Float32Array(values.length);
    const ends = this.forceStarts.slice();
    let [first, firstNormal] = [0, 0];
    const ground = this.data.ground?.normal ?? UP;
    this.sites.forEach(([, partner, number], site) => {
      for (let i = 0; i < number; i += 1) {
        const place = ends[inFrames[first + i]]++;
        this.forceSites[place] = site;
        for (let axis = 0; axis < 3; axis += 1) {
          const at = axis * number + i;
          this.forceValues[3 * place + axis] = values[3 * first + at];
          this.forceMoments[3 * place + axis] = moments[3 * first + at];
          this.forcePoints[3 * place + axis] = points[3 * first + at];
          const normal = partner === GROUND ? ground[axis] : normals[firstNormal + at];
          this.forceNormals[3 * place + axis] = normal;
        }
      }
      first += number;
      if (partner !== GROUND) firstNormal += 3 * number;
    });
  }

  // Mean forces and moments of the frames after `before` up to `frame`, with site, bodies, position,
  // normal and friction.
  forces(frame, before) {
    const sums = new Map();
    for (let i = this.forceStarts[before + 1]; i < this.forceStarts[frame + 1]; i += 1) {
      const site = this.forceSites[i];
      const { sum, turn } = sums.get(site) ?? { sum: [0, 0, 0], turn: [0, 0, 0] };
      sums.set(site, {
        i,
        sum: add(sum, this.forceValues.subarray(3 * i, 3 * i + 3)),
        turn: add(turn, this.forceMoments.subarray(3 * i, 3 * i + 3)),
      });
    }
    return [...sums].map(([site, { i, sum, turn }]) => {
      const [body, partner] = this.sites[site];
      const point = add(this.origin, this.forcePoints.subarray(3 * i, 3 * i + 3));
      const normal = Array.from(this.forceNormals.subarray(3 * i, 3 * i + 3));
      const [force, moment] = [sum, turn].map((total) => times(total, 1 / (frame - before)));
      return { site, body, partner, point, normal, friction: this.frictions[site], force, moment };
    });
  }

  // Mean forces of joints in the frames after `before` up to `frame`, as contact forces.
  forcesOfJoints(frame, before) {
    return this.data.joints.map(({ body, other, anchor }, joint) => {
      const force = [0, 1, 2].map((axis) => {
        const at = (3 * joint + axis) * this.count;
        let sum = 0;
        for (let f = before + 1; f <= frame; f += 1) sum += this.jointForces[at + f];
        return sum / (frame - before);
      });
      const [point] = this.placed(frame, body, [anchor]);
      return { site: `joint ${joint}`, body, partner: other ?? GROUND, point, force, isOfJoint: true };
    });
  }

  // Arrow of a force. Its relative length is s / (1 + s) with s = √(force / weight).
  arrow(force) {
    const size = length(force);
    const root = Math.sqrt(size / this.data.arrows.weight);
    return times(force, (this.longest * root) / (1 + root) / size);
  }
}
