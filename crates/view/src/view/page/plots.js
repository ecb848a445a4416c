// Interactive plots with the content of `tumble plot`.

// Replacements of curve colours that are too dark for a dark page.
const ON_DARK = {
  "#0072b2": "#3b82f6",
  "#009e73": "#2fbf8f",
  "#cc79a7": "#f08cc8",
  "#56b4e9": "#a5e1ff",
  "#d55e00": "#ff6a3c",
  "#7f5539": "#a8795b",
  "#3d3d3d": "#c9d1d9",
};
// Dash patterns of curves and two tones for each of two runs.
const DASHES = [[], [7, 4], [2, 3], [9, 3, 2, 3]];
const TONES = [
  ["run-a", "run-a-other"],
  ["run-b", "run-b-other"],
];
// Maximum number of curves per run in the legend. With more curves all widths are equal.
const NAMED = 8;
const HEIGHTS = { log: 150, symlog: 150, linear: 125 };
const AXIS_WIDTH = 54;
// Maximum number of rows for which every value has a dot.
const FEW = 60;

// Distances of ticks of counts.
const WHOLE = [1, 10, 100, 1e3, 1e4, 1e5].flatMap((power) => [power, 2 * power, 5 * power]);

// Symbols of the statuses in a legend.
const GLYPHS = { retried: "△", fallback: "◇", substepped: "□", wild: "+", failed: "✕" };

const plots = [];

// Colours of the curves of several bodies in one plot.
const BODY_COLOURS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#7f5539", "#56b4e9", "#3d3d3d"];

// Plots of a sheet for the chosen bodies. Curves of several bodies share the axes.
function joined(sheet, chosen) {
  const all = chosen.map((body) => (body > 0 ? sheet.others[body - 1] : sheet.plots));
  if (all.length === 1) return all[0];
  return all[0].map((first, place) => {
    const same = all.map((plots) => plots[place]);
    const known = same.filter((plot) => plot.nothing === null);
    if (known.length === 0) return first;
    const series = same.flatMap((plot, i) =>
      plot.series.map((one) => ({
        ...one,
        name: `${runs[0].bodies[chosen[i]].name} ${one.name}`.trim(),
        colour: BODY_COLOURS[i % BODY_COLOURS.length],
      })),
    );
    const axes = known.map((plot) => plot.axis);
    const axis = {
      ...axes[0],
      threshold: smallest(axes.map((one) => one.threshold ?? 1)),
      low: smallest(axes.map((one) => one.low)),
      high: largest(axes.map((one) => one.high)),
      ticks: [...new Set(axes.flatMap((one) => one.ticks))].sort((a, b) => a - b),
      has_zeros: axes.some((one) => one.has_zeros),
    };
    return { ...known[0], axis, series };
  });
}

class Plot {
  constructor(data, setTime) {
    this.data = data;
    this.setTime = setTime;
    this.series = data.series.map((series) => ({
      ...series,
      rows: rowsOf(series.rows),
      values: floats(series.values),
      step: runs[series.run].step,
    }));
    const [name, index] = data.symbol;
    // In a symbol, `_A` is a subscript.
    const parts = `${name}${index && `_${index}`}`.split(/_(\w+)/);
    const symbol = element(
      "span",
      { class: "symbol" },
      ...parts.map((part, i) => (i % 2 ? element("sub", {}, part) : part)),
      data.unit ? ` (${data.unit})` : "",
    );
    const words = element("span", { class: "words" }, data.words + this.remark());
    this.summary = element("summary", {}, symbol, words);
    this.box = element("details", { class: "plot", id: `plot-${data.id}` }, this.summary);
    if (data.nothing) {
      this.box.append(element("p", { class: "nothing" }, data.nothing));
      this.box.classList.add("blank");
      return;
    }
    this.place = element("div", { class: "canvas" });
    this.legend = element("div", { class: "legend" });
    this.single = element("i", { class: "single" });
    this.summary.append(this.single);
    this.box.append(this.legend, this.place);
    this.fillLegend();
    this.box.addEventListener("toggle", () => this.box.open && this.draw());
    this.box.open = data.open;
    plots.push(this);
  }

  // Remark on the scale.
  remark() {
    const { axis, unit: name, nothing } = this.data;
    if (nothing || axis.scale === "linear") return "";
    if (axis.scale === "log")
      return axis.has_zeros ? " · log axis, 0 at its lower end" : " · log axis";
    return ` · symlog axis, linear below ${tick(axis.threshold)} ${name}`;
  }

  // Two runs differ by colour, and their curves by dashes. The curves of one run differ by colour.
  look(series) {
    if (!isPair || this.data.id === "distance") {
      return {
        stroke: colours.isDark ? (ON_DARK[series.colour] ?? series.colour) : series.colour,
        dash: [],
      };
    }
    const among = this.series.filter((other) => other.run === series.run);
    const place = among.indexOf(series) % NAMED;
    const tone = TONES[series.run][Math.floor(place / DASHES.length)];
    return { stroke: colours[tone], dash: DASHES[place % DASHES.length] };
  }

  // Earlier curves are wider, so that coinciding curves remain visible.
  width(series) {
    if (isPair && this.data.id !== "distance") return series.run ? 1.3 : 3;
    const busy = this.series.filter(({ values }) => values.some((value) => value !== 0));
    const after = busy.length - 1 - busy.indexOf(series);
    if (this.series.length > NAMED) return 1.5;
    return busy.includes(series)
      ? 1.5 + after * Math.min(0.6, 3.2 / Math.max(1, busy.length - 1))
      : 1.2;
  }

  fillLegend() {
    this.legend.replaceChildren();
    // A single curve has no legend. Its value is shown in the heading.
    const isLone = this.series.length === 1;
    const isNamed = (series) =>
      this.series.filter((other) => other.run === series.run).indexOf(series) < NAMED;
    this.readings = this.series.filter(isNamed).map((series) => {
      const { stroke, dash } = this.look(series);
      const name = [isPair && this.data.id !== "distance" ? runs[series.run].name : "", series.name]
        .join(" ")
        .trim();
      if (isLone) return { series, value: this.single };
      const value = element("i");
      const swatch = document.createElementNS("http://www.w3.org/2000/svg", "svg");
      swatch.setAttribute("width", "26");
      swatch.setAttribute("height", "4");
      const line = document.createElementNS("http://www.w3.org/2000/svg", "path");
      line.setAttribute("d", "M0 2h26");
      line.setAttribute("stroke", stroke);
      line.setAttribute("stroke-width", "2.5");
      line.setAttribute("stroke-dasharray", dash.join(" "));
      swatch.append(line);
      this.legend.append(element("span", {}, swatch, name, value));
      return { series, value };
    });
    const more = this.series.length - this.readings.length;
    if (more > 0) this.legend.append(element("span", {}, `and ${more} more in the same colours`));
    for (const mark of this.data.marks) {
      const name = `${isPair ? `${runs[mark.run].name} ` : ""}${mark.status} (${count(mark.count)})`;
      this.legend.append(
        element("span", { class: `status-${mark.status}` }, `${GLYPHS[mark.status]} ${name}`),
      );
    }
  }

  // Times of all curves on one axis. Missing values of a curve are `undefined`.
  table() {
    const { axis } = this.data;
    const shown = (value) => {
      if (Number.isNaN(value)) return null;
      return axis.scale === "log" && value < axis.low ? axis.low : value;
    };
    const tables = this.series.map((series) => [
      Array.from(series.rows, (row) => row * series.step),
      Array.from(series.values, shown),
    ]);
    return tables.length > 1 ? uPlot.join(tables) : tables[0];
  }

  // Draws the plot, also after a change of size or colours.
  draw() {
    if (!this.box.open) return;
    const { axis } = this.data;
    this.chart?.destroy();
    const lines = { stroke: colours["plot-grid"], width: 1 };
    const frame = {
      stroke: colours.faint,
      grid: lines,
      ticks: { ...lines, size: 4 },
      font: "11px system-ui, sans-serif",
    };
    const isLinear = axis.scale === "linear";
    const labels = (_, splits, __, ___, step) =>
      splits.map((value) => tick(value, isLinear ? step : undefined));
    this.chart = new uPlot(
      {
        width: Math.max(120, this.place.clientWidth - 16),
        height: HEIGHTS[axis.scale],
        padding: [6, 8, 0, 0],
        legend: { show: false },
        cursor: { show: false },
        select: { show: false },
        scales: {
          x: { time: false, range: [0, duration || runs[0].step] },
          y: {
            distr: { linear: 1, log: 3, symlog: 4 }[axis.scale],
            asinh: axis.threshold ?? 1,
            range: [axis.low, axis.high],
          },
        },
        axes: [
          {
            ...frame,
            size: 24,
            gap: 3,
            space: duration < 0.02 ? 84 : 54,
            values: (_, splits, __, ___, step) => splits.map((t) => `${tick(t, step)} s`),
          },
          {
            ...frame,
            size: AXIS_WIDTH,
            gap: 4,
            values: labels,
            filter: (_, splits) => splits,
            ...(isLinear ? { space: 22 } : { splits: () => axis.ticks }),
            ...(this.data.unit ? {} : { incrs: WHOLE }),
          },
        ],
        series: [
          {},
          ...this.series.map((series) => {
            const { stroke, dash } = this.look(series);
            const few = runs[series.run].rows <= FEW;
            const filter = (chart, index) => (few ? null : lonely(chart.data[index]));
            return {
              stroke,
              dash,
              width: this.width(series),
              pxAlign: 0,
              // Counts are steps.
              ...(this.data.unit ? {} : { paths: uPlot.paths.stepped({ align: 1 }) }),
              points: { show: few, filter, size: few ? 5 : 3, fill: stroke },
            };
          }),
        ],
        hooks: { draw: [(chart) => this.drawMarks(chart)] },
      },
      this.table(),
      this.place,
    );
    this.cursor = element("div", { class: "cursor" });
    this.chart.over.append(this.cursor);
    // Measured in the next frame, after layout.
    this.overWidth = 0;
    this.link(this.chart.over);
    repaint();
  }

  // Draws a mark at each step of a status.
  drawMarks(chart) {
    const { ctx } = chart;
    const r = 4 * devicePixelRatio;
    ctx.save();
    ctx.lineWidth = 1.6 * devicePixelRatio;
    for (const mark of this.data.marks) {
      const rows = rowsOf(mark.rows);
      const values = floats(mark.values);
      ctx.strokeStyle = colours[mark.status];
      ctx.beginPath();
      rows.forEach((row, i) => {
        const x = chart.valToPos(row * runs[mark.run].step, "x", true);
        const y = chart.valToPos(Math.max(values[i], this.data.axis.low), "y", true);
        if (!Number.isFinite(y)) return;
        if (mark.status === "retried") {
          ctx.moveTo(x, y - r);
          ctx.lineTo(x + r, y + 0.75 * r);
          ctx.lineTo(x - r, y + 0.75 * r);
          ctx.closePath();
        } else if (mark.status === "fallback") {
          ctx.moveTo(x, y - r);
          for (const [a, b] of [
            [r, 0],
            [0, r],
            [-r, 0],
          ])
            ctx.lineTo(x + a, y + b);
          ctx.closePath();
        } else if (mark.status === "substepped") {
          ctx.rect(x - 0.8 * r, y - 0.8 * r, 1.6 * r, 1.6 * r);
        } else if (mark.status === "wild") {
          ctx.moveTo(x - r, y);
          ctx.lineTo(x + r, y);
          ctx.moveTo(x, y - r);
          ctx.lineTo(x, y + r);
        } else {
          ctx.moveTo(x - r, y - r);
          ctx.lineTo(x + r, y + r);
          ctx.moveTo(x + r, y - r);
          ctx.lineTo(x - r, y + r);
        }
      });
      ctx.stroke();
    }
    ctx.restore();
  }

  // Sets the time on click and drag.
  link(over) {
    const set = (event) => {
      const share = (event.clientX - over.getBoundingClientRect().left) / over.clientWidth;
      this.setTime(Math.min(1, Math.max(0, share)) * duration);
    };
    over.addEventListener("pointerdown", (event) => {
      over.setPointerCapture(event.pointerId);
      set(event);
    });
    over.addEventListener(
      "pointermove",
      (event) => over.hasPointerCapture(event.pointerId) && set(event),
    );
  }

  // Moves the cursor to `time` and shows the values there in the legend.
  move(time) {
    this.time = time;
    if (!this.box.open || !this.chart) return;
    const share = duration > 0 ? time / duration : 0;
    this.overWidth ||= this.chart.over.clientWidth;
    this.cursor.style.transform = `translateX(${share * this.overWidth - 0.75}px)`;
    for (const { series, value } of this.readings) {
      const found = valueAt(series, time);
      // Quantities without unit are counts.
      const text = this.data.unit || Number.isNaN(found) ? number(found, 4) : count(found);
      if (value.textContent !== text) value.textContent = text;
    }
  }
}
