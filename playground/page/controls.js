// Sliders, and the state of the last step.

// Number of pictures in the strip.
const STRIP_LENGTH = 240;
// Range of the residuals in the strip, as exponents of m/s.
const STRIP_RANGE = [-16, -2];

// Sliders of the world: how a position is a value, and the change that it makes.
const SLIDERS = [
  {
    name: "friction",
    words: "friction μ",
    range: [0, 2, 0.01],
    show: (value) => value.toFixed(2),
    change: (value) => ({ friction: value }),
  },
  {
    name: "restitution",
    words: "restitution e",
    range: [0, 1, 0.01],
    show: (value) => value.toFixed(2),
    change: (value) => ({ restitution: value }),
  },
  {
    name: "slope",
    words: "slope",
    range: [-45, 45, 0.5],
    show: (value) => `${value.toFixed(1).replace("-", MINUS)}°`,
    change: (value) => ({ gravity: { size: worldValues.gravity, slope: value } }),
  },
  {
    name: "gravity",
    words: "gravity g",
    range: [0, 25, 0.01],
    show: (value) => `${value.toFixed(2)} m/s²`,
    change: (value) => ({ gravity: { size: value, slope: worldValues.slope } }),
  },
  {
    name: "timeStep",
    words: "time step h",
    // Position in decades of a millisecond.
    range: [-1, 1.31, 0.01],
    read: (place) => Number((10 ** place / 1000).toPrecision(2)),
    place: (value) => Math.log10(1000 * value),
    show: (value) => `${number(1000 * value, 2)} ms`,
    change: (value) => ({ "time-step": value }),
  },
];
const MASS = {
  name: "mass",
  words: "mass",
  range: [-3, 3, 0.01],
  read: (place) => Number((bodyMass * 10 ** place).toPrecision(3)),
  place: (value) => Math.log10(value / bodyMass),
  show: (value) => `${number(value, 3)} kg`,
  change: (value) => ({ mass: { body: touched, mass: value } }),
};

// Present values of the sliders.
const worldValues = {};
// Mass of the touched body when it was touched, the middle of its slider (kg).
let bodyMass = 1;

// Slider that asks for a change while it moves.
class Slider {
  constructor(kind, changed) {
    this.kind = kind;
    const [min, max, step] = kind.range;
    this.input = element("input", { type: "range", min, max, step, id: `slider-${kind.name}` });
    this.output = element("output", { for: this.input.id });
    this.label = element("label", { class: "slider" }, element("span", {}, kind.words), this.input, this.output);
    this.input.addEventListener("input", () => {
      const place = Number(this.input.value);
      this.write(kind.read ? kind.read(place) : place);
      changed(kind.change(this.value));
    });
  }

  write(value) {
    this.value = value;
    if (this.kind !== MASS) worldValues[this.kind.name] = value;
    put(this.output, this.kind.show(value));
    this.input.setAttribute("aria-valuetext", this.kind.show(value));
  }

  // Shows a value of the scene.
  set(value) {
    this.write(value);
    if (document.activeElement === this.input && this.input.matches(":active")) return;
    this.input.value = String(this.kind.place ? this.kind.place(value) : value);
  }
}

// Values of the sliders in an answer of the program.
function valuesOf({ friction, restitution, gravity, timeStep }) {
  const size = length(gravity);
  const slope = size > 0 ? (Math.atan2(gravity[0], -gravity[2]) * 180) / Math.PI : 0;
  return { friction, restitution, slope, gravity: size, timeStep };
}

// Certificates and energies of the last pictures.
class StateStrip {
  constructor() {
    this.canvas = document.getElementById("strip");
    this.clear();
    const [low, high] = STRIP_RANGE.map((exponent) => `10${raised(exponent)}`);
    put(document.getElementById("strip-scale"), `bars: residual ${low} … ${high} m/s, log; line: energy`);
  }

  clear() {
    this.samples = [];
  }

  add(head, colour) {
    this.samples.push({ residual: head.residual, energy: head.total, colour });
    if (this.samples.length > STRIP_LENGTH) this.samples.shift();
  }

  paint() {
    const { canvas, samples } = this;
    const ratio = window.devicePixelRatio || 1;
    const [width, height] = [Math.round(canvas.clientWidth * ratio), Math.round(canvas.clientHeight * ratio)];
    if (width === 0) return;
    if (canvas.width !== width) canvas.width = width;
    if (canvas.height !== height) canvas.height = height;
    const context = canvas.getContext("2d");
    context.clearRect(0, 0, width, height);
    const wide = width / STRIP_LENGTH;
    const [low, high] = STRIP_RANGE;
    samples.forEach(({ residual, colour }, k) => {
      const share = residual > 0 ? (Math.log10(residual) - low) / (high - low) : 0;
      const size = height * Math.min(1, Math.max(0.04, share));
      context.fillStyle = colour ?? colours["plot-grid"];
      context.fillRect(k * wide, height - size, Math.max(1, wide - 0.5), size);
    });
    const energies = samples.map(({ energy }) => energy).filter(Number.isFinite);
    if (energies.length < 2) return;
    const [least, most] = extremes(energies);
    const room = Math.max(most - least, 1e-9 * Math.abs(most), 1e-30);
    context.strokeStyle = colours["run-b"];
    context.lineWidth = 1.5 * ratio;
    context.beginPath();
    samples.forEach(({ energy }, k) => {
      const y = height * (0.92 - (0.84 * (energy - least)) / room);
      context.lineTo((k + 0.5) * wide, y);
    });
    context.stroke();
  }
}
