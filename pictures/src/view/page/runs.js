// The runs: their numbers as typed arrays, and what is where at which time.

const page = JSON.parse(document.getElementById("data").textContent);

function bytes(text) {
  const raw = atob(text);
  return Uint8Array.from(raw, (c) => c.charCodeAt(0)).buffer;
}
const floats = (text) => new Float32Array(bytes(text));
const rowsOf = (text) => new Uint32Array(bytes(text));

const NAMES = ["A", "B"];

// Points that span a body: all of it is in their convex hull.
function spanOf({ points, pieces }) {
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
    this.name = NAMES[index];
    this.data = data;
    this.rows = data.rows;
    this.step = data.step;
    this.duration = (data.rows - 1) * data.step;
    this.every = frames.every;
    this.count = frames.count;
    this.origin = frames.origin;
    this.poses = floats(frames.poses);
    this.speeds = floats(frames.speeds);
    this.residuals = floats(frames.residuals);
    this.statuses = new Uint8Array(bytes(frames.statuses));
    // Body, partner and corner of everything that touches.
    this.sites = frames.sites;
    this.forceSites = rowsOf(frames.force_sites);
    this.forceValues = floats(frames.forces);
    this.forcePoints = floats(frames.force_points);
    // Where the forces of a frame begin, and for each force where its point is, if it has one.
    this.forceStarts = [0];
    for (const forces of rowsOf(frames.force_counts)) {
      this.forceStarts.push(this.forceStarts.at(-1) + forces);
    }
    let points = 0;
    this.pointPlaces = Uint32Array.from(this.forceSites, (site) =>
      this.sites[site][2] < 0 ? points++ : 0,
    );
    this.bodies = data.bodies;
    for (const body of [...this.bodies, ...data.fixed]) body.span = spanOf(body);
    const reach = (body) => Math.max(...body.span.map(length));
    this.reaches = this.bodies.map(reach);
    // Four digits of the smallest body's size, and of the largest speed.
    this.lengthDecimals = decimalsOf(Math.min(...this.reaches));
    this.speedDecimals = decimalsOf(this.speeds.reduce((most, v) => (v > most ? v : most), 0));
  }

  // Frames along the way of a body's centre of mass, as many as make `pieces` equal pieces of it.
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

  // The row of a frame: every `every`-th, and the last.
  row(frame) {
    return Math.min(frame * this.every, this.rows - 1);
  }

  time(frame) {
    return this.row(frame) * this.step;
  }

  // The frame that stands at `time`: the last that is not later.
  frame(time) {
    // Times are products; a millionth of a step is rounding.
    const row = Math.floor(time / this.step + 1e-6);
    if (row >= this.rows - 1) return this.count - 1;
    return Math.max(0, Math.floor(row / this.every));
  }

  position(frame, body) {
    const at = 7 * (frame * this.bodies.length + body);
    return [0, 1, 2].map((axis) => this.origin[axis] + this.poses[at + axis]);
  }

  attitude(frame, body) {
    const at = 7 * (frame * this.bodies.length + body) + 3;
    return this.poses.subarray(at, at + 4);
  }

  speed(frame, body) {
    return this.speeds[frame * this.bodies.length + body];
  }

  // Points of the body in the world.
  placed(frame, body, points) {
    const [place, attitude] = [this.position(frame, body), this.attitude(frame, body)];
    return points.map((point) => add(place, rotate(attitude, point)));
  }

  // The mean forces of the frames after `before` up to `frame`: on which body by what, where,
  // and how much.
  forces(frame, before) {
    const sums = new Map();
    for (let i = this.forceStarts[before + 1]; i < this.forceStarts[frame + 1]; i += 1) {
      const site = this.forceSites[i];
      const sum = sums.get(site)?.sum ?? [0, 0, 0];
      sums.set(site, { i, sum: add(sum, this.forceValues.subarray(3 * i, 3 * i + 3)) });
    }
    return [...sums].map(([site, { i, sum }]) => {
      const [body, partner, corner] = this.sites[site];
      const at = 3 * this.pointPlaces[i];
      const point =
        corner < 0
          ? add(this.origin, this.forcePoints.subarray(at, at + 3))
          : this.placed(frame, body, [this.bodies[body].points[corner]])[0];
      return { body, partner, point, force: times(sum, 1 / (frame - before)) };
    });
  }

  // The arrow of a force: with s = √(force / weight) its length is s / (1 + s) of the longest.
  arrow(force) {
    const { weight, longest } = this.data.arrows;
    const size = length(force);
    const root = Math.sqrt(size / weight);
    return times(force, (longest * root) / (1 + root) / size);
  }
}

const runs = page.runs.map((data, index) => new Run(data, index));
const isPair = runs.length > 1;
// Bodies that can be chosen: those that all runs have.
const bodyCount = Math.min(...runs.map((run) => run.bodies.length));
const isCrowd = runs.some((run) => run.bodies.length > 1);
const duration = Math.max(...runs.map((run) => run.duration));

// The next or the previous time at which a run has a frame.
function neighbour(time, direction) {
  const candidates = runs.flatMap((run) => {
    const frame = run.frame(time);
    return [frame - 1, frame, frame + 1]
      .filter((f) => f >= 0 && f < run.count)
      .map((f) => run.time(f));
  });
  const room = 1e-6 * Math.min(...runs.map((run) => run.step));
  const ahead = candidates.filter((t) => direction * (t - time) > room);
  if (ahead.length === 0) return direction > 0 ? duration : 0;
  return direction > 0 ? Math.min(...ahead) : Math.max(...ahead);
}

// The steps that were retried, fell back, went wild or failed, as the plots mark them.
const marks = page.sheets
  .flatMap((sheet) => sheet.plots)
  .flatMap((plot) => plot.marks)
  .map((mark) => ({ ...mark, rows: rowsOf(mark.rows), values: floats(mark.values) }));

const markTimes = marks
  .flatMap((mark) => Array.from(mark.rows, (row) => row * runs[mark.run].step))
  .sort((a, b) => a - b);

// The value of the last kept row that is not later than `time`; none after the last.
function valueAt({ rows, values, step }, time) {
  const row = Math.floor(time / step + 1e-6);
  let [low, high] = [0, rows.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (rows[middle] <= row) low = middle + 1;
    else high = middle;
  }
  return low > 0 && row <= rows.at(-1) ? values[low - 1] : NaN;
}

// Where a curve has a value between gaps, which no line shows; null where it has none such.
function lonely(values) {
  const known = [...values.keys()].filter((i) => values[i] !== undefined);
  const isGap = (place) => (values[known[place]] ?? null) === null;
  const found = known.filter((_, k) => !isGap(k) && isGap(k - 1) && isGap(k + 1));
  return found.length > 0 ? found : null;
}
