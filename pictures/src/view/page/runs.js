// The runs: their numbers as typed arrays, and what is where at which time.

const page = JSON.parse(document.getElementById("data").textContent);

function bytes(text) {
  const raw = atob(text);
  return Uint8Array.from(raw, (c) => c.charCodeAt(0)).buffer;
}
const floats = (text) => new Float32Array(bytes(text));
const rowsOf = (text) => new Uint32Array(bytes(text));

const NAMES = ["A", "B"];

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
    this.forceCorners = new Uint16Array(bytes(frames.force_corners));
    this.forceValues = floats(frames.forces);
    // Where the forces of a frame begin.
    this.forceStarts = [0];
    for (const forces of new Uint16Array(bytes(frames.force_counts))) {
      this.forceStarts.push(this.forceStarts.at(-1) + forces);
    }
    this.points = data.body.points;
    this.isBox = data.body.is_box;
    // Four digits of the body's size, and of the largest speed.
    this.lengthDecimals = decimalsOf(Math.max(...this.points.map(length)));
    this.speedDecimals = decimalsOf(this.speeds.reduce((most, v) => (v > most ? v : most), 0));
  }

  // Frames along the way of the centre of mass, as many as make `pieces` equal pieces of it.
  way(pieces) {
    const step = (a, b) => length(subtract(this.position(b), this.position(a))) || 0;
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

  position(frame) {
    const at = 7 * frame;
    return [0, 1, 2].map((axis) => this.origin[axis] + this.poses[at + axis]);
  }

  attitude(frame) {
    return this.poses.slice(7 * frame + 3, 7 * frame + 7);
  }

  corners(frame) {
    const [place, attitude] = [this.position(frame), this.attitude(frame)];
    return this.points.map((point) => add(place, rotate(attitude, point)));
  }

  // The mean forces of the frames after `before` up to `frame`: which corner, and how much.
  forces(frame, before) {
    const sums = new Map();
    for (let i = this.forceStarts[before + 1]; i < this.forceStarts[frame + 1]; i += 1) {
      const corner = this.forceCorners[i];
      sums.set(
        corner,
        add(sums.get(corner) ?? [0, 0, 0], this.forceValues.subarray(3 * i, 3 * i + 3)),
      );
    }
    return [...sums].map(([corner, sum]) => ({ corner, force: times(sum, 1 / (frame - before)) }));
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

// The steps that were retried, fell back or failed, as the plots mark them.
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
