// Runs of the page, and their marked steps.

const page = JSON.parse(document.getElementById("data").textContent);
const runs = page.runs.map((data, index) => new Run(data, index));
const isPair = runs.length > 1;
// Number of selectable bodies, which all runs have.
const bodyCount = smallest(runs.map((run) => run.bodies.length));
const hasJoints = runs.some((run) => run.data.joints.length > 0);
const isCrowd = runs.some((run) => run.bodies.length > 1);
const duration = largest(runs.map((run) => run.duration));

// Next or previous time at which a run has a frame.
function neighbour(time, direction) {
  const candidates = runs.flatMap((run) => {
    const frame = run.frame(time);
    return [frame - 1, frame, frame + 1]
      .filter((f) => f >= 0 && f < run.count)
      .map((f) => run.time(f));
  });
  const room = 1e-6 * smallest(runs.map((run) => run.step));
  const ahead = candidates.filter((t) => direction * (t - time) > room);
  if (ahead.length === 0) return direction > 0 ? duration : 0;
  return direction > 0 ? smallest(ahead) : largest(ahead);
}

// Marked steps of the plots: retried, fallback, substepped, wild or failed.
const marks = page.sheets
  .flatMap((sheet) => sheet.plots)
  .flatMap((plot) => plot.marks)
  .map((mark) => ({ ...mark, rows: rowsOf(mark.rows), values: floats(mark.values) }));

const markTimes = marks
  .flatMap((mark) => Array.from(mark.rows, (row) => row * runs[mark.run].step))
  .sort((a, b) => a - b);

// Value at the last stored row not later than `time`; NaN beyond the last row.
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

// Indices of isolated values between gaps, which a line does not show; null if there are none.
function lonely(values) {
  const known = [...values.keys()].filter((i) => values[i] !== undefined);
  const isGap = (place) => (values[known[place]] ?? null) === null;
  const found = known.filter((_, k) => !isGap(k) && isGap(k - 1) && isGap(k + 1));
  return found.length > 0 ? found : null;
}
