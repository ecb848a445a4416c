// Certificate of the run: the residual of each step on a logarithmic scale, under the time line.

// Smallest range of the scale, as decimal exponents of m/s.
const STRIP_LOW = -16;
const STRIP_HIGH = -8;
// Margin at both ends, half the width of the slider's knob (pixels).
const KNOB = 8;

const residualRange = (() => {
  const all = runs.map((run) => largest(run.residuals.filter((value) => value > 0)));
  const top = Math.ceil(Math.log10(Math.max(largest(all), 10 ** STRIP_HIGH)));
  return [STRIP_LOW, Number.isFinite(top) ? top : STRIP_HIGH];
})();

// Severity of the marked statuses. Worse steps are drawn last.
const STRIP_MARKS = ["retried", "fallback", "substepped", "wild", "failed"];

// Height of a residual in the strip, from 0 to 1.
function residualShare(value) {
  if (!(value > 0)) return 0;
  const [low, high] = residualRange;
  return Math.min(1, Math.max(0.04, (Math.log10(value) - low) / (high - low)));
}

class Strip {
  constructor() {
    this.canvas = document.getElementById("strip");
    const [low, high] = residualRange.map((exponent) => `10${raised(exponent)}`);
    const worst = runs.map((run) => number(run.data.worst?.residual ?? NaN, 2)).join(" and ");
    const words = `Certificate: residual of each step, ${low} to ${high} m/s. Largest: ${worst} m/s.`;
    this.canvas.setAttribute("aria-label", words);
    this.canvas.title = words;
    document.getElementById("strip-scale").textContent = `residual ${low} … ${high} m/s, log`;
  }

  // Draws one row per run: bars of residuals, and marked steps over the full height.
  paint() {
    const { canvas } = this;
    const ratio = devicePixelRatio;
    const [width, height] = [canvas.clientWidth * ratio, canvas.clientHeight * ratio];
    if (canvas.width !== width) canvas.width = width;
    if (canvas.height !== height) canvas.height = height;
    const context = canvas.getContext("2d");
    context.clearRect(0, 0, width, height);
    const high = height / runs.length;
    runs.forEach((run, row) => this.paintRun(context, run, [width, row * high, high], ratio));
  }

  paintRun(context, run, [width, top, high], ratio) {
    const inner = width - 2 * KNOB * ratio;
    const at = (time) => KNOB * ratio + (duration > 0 ? time / duration : 0) * inner;
    const bottom = top + high - 0.5 * ratio;
    context.fillStyle = colours.line;
    context.fillRect(KNOB * ratio, bottom, at(run.duration) - KNOB * ratio, ratio);
    // The largest residual of each column.
    const columns = new Map();
    for (let frame = 0; frame + 1 < run.count; frame += 1) {
      const column = Math.floor(at(run.time(frame)) / ratio);
      const end = Math.max(column + 1, Math.floor(at(run.time(frame + 1)) / ratio));
      const share = residualShare(run.residuals[frame]);
      for (let x = column; x < end; x += 1) columns.set(x, Math.max(share, columns.get(x) ?? 0));
    }
    context.fillStyle = isPair ? colours[run.index ? "run-b" : "run-a"] : colours.accent;
    context.globalAlpha = 0.55;
    for (const [x, share] of columns) {
      context.fillRect(x * ratio, bottom - share * (high - 2 * ratio), ratio, share * (high - 2 * ratio));
    }
    context.globalAlpha = 1;
    const own = marks.filter((mark) => mark.run === run.index);
    for (const status of STRIP_MARKS) {
      const isFailed = status === "failed";
      context.fillStyle = colours[status];
      for (const mark of own.filter((one) => one.status === status)) {
        for (const row of mark.rows) {
          const x = at(row * run.step) - ratio;
          if (isFailed) context.fillRect(x - ratio, top, 4 * ratio, high);
          else context.fillRect(x, top, 2 * ratio, 0.3 * high);
        }
      }
    }
  }
}
