// Painting in the world: polygons, lines, arrows, cut off where they pass the camera.

// The colours of the style sheet, read again when light turns to dark.
const colours = {};
function readColours() {
  const style = getComputedStyle(document.documentElement);
  for (const name of [
    "ink",
    "faint",
    "line",
    "accent",
    "sky",
    "ground",
    "grid",
    "shadow",
    "trail",
    "force",
    "seam",
    "edge",
    "chosen",
    "plot-grid",
    "run-a",
    "run-b",
    "run-a-other",
    "run-b-other",
    "retried",
    "fallback",
    "wild",
    "failed",
  ]) {
    colours[name] = style.getPropertyValue(`--${name}`).trim();
  }
  colours.isDark = matchMedia("(prefers-color-scheme: dark)").matches;
}
readColours();

// Faces of the bodies from the darkest to the lightest; one hue for each of two runs, or for
// each of several bodies. The last is of what stands still.
const SHADES = [
  [
    [15, 42, 71],
    [47, 116, 181],
    [169, 208, 240],
  ],
  [
    [74, 42, 8],
    [196, 122, 28],
    [248, 212, 150],
  ],
  [
    [12, 59, 44],
    [36, 143, 107],
    [166, 227, 203],
  ],
  [
    [69, 22, 58],
    [168, 75, 143],
    [238, 189, 223],
  ],
  [
    [71, 23, 23],
    [184, 74, 69],
    [243, 191, 184],
  ],
  [
    [56, 56, 10],
    [143, 139, 43],
    [227, 224, 155],
  ],
  [
    [48, 54, 63],
    [125, 135, 148],
    [213, 219, 226],
  ],
];
const STILL_HUE = SHADES.length - 1;
const hueOf = (run, body) => {
  if (body < 0) return STILL_HUE;
  return isPair ? run : body % STILL_HUE;
};

// The colour of a face, `light` from 0 to 1.
function shade(hue, light) {
  const [dark, middle, bright] = SHADES[hue];
  const [from, to, share] =
    light < 0.5 ? [dark, middle, 2 * light] : [middle, bright, 2 * light - 1];
  return `rgb(${between(from, to, share).map(Math.round).join(" ")})`;
}

class Brush {
  constructor(context, lens) {
    this.context = context;
    this.lens = lens;
    context.lineJoin = "round";
    context.lineCap = "round";
  }

  // A path through points of the picture.
  trace(points, isClosed) {
    const { context } = this;
    context.beginPath();
    points.forEach(([x, y], i) => (i === 0 ? context.moveTo(x, y) : context.lineTo(x, y)));
    if (isClosed) context.closePath();
  }

  // Fills or outlines a polygon of the world.
  polygon(points, { fill, stroke, width = 1, alpha = 1 }) {
    if (!points.every(isFinitePoint)) return;
    const seen = clip(points, this.lens.depth, this.lens.near);
    if (seen.length < 3) return;
    this.flat(seen.map(this.lens.project), { fill, stroke, width, alpha });
  }

  // The same for a polygon of the picture.
  flat(points, { fill, stroke, width = 1, alpha = 1 }) {
    const { context } = this;
    this.trace(points, true);
    context.globalAlpha = alpha;
    if (fill) {
      context.fillStyle = fill;
      context.fill();
    }
    if (stroke) {
      context.strokeStyle = stroke;
      context.lineWidth = width;
      context.stroke();
    }
    context.globalAlpha = 1;
  }

  // Fills polygons of the picture that may overlap as one.
  union(polygons, { fill, alpha }) {
    const { context } = this;
    context.beginPath();
    for (const points of polygons) {
      points.forEach(([x, y], i) => (i === 0 ? context.moveTo(x, y) : context.lineTo(x, y)));
      context.closePath();
    }
    Object.assign(context, { fillStyle: fill, globalAlpha: alpha });
    context.fill();
    context.globalAlpha = 1;
  }

  // The part of a segment in front of the camera, in the picture.
  segment(a, b) {
    const { depth, near, project } = this.lens;
    const [da, db] = [depth(a) - near, depth(b) - near];
    if (!(da > 0 || db > 0)) return null;
    const start = da < 0 ? between(a, b, da / (da - db)) : a;
    const end = db < 0 ? between(a, b, da / (da - db)) : b;
    return [project(start), project(end)];
  }

  // All segments in one stroke.
  lines(segments, { stroke, width = 1, alpha = 1, dash = [] }) {
    const { context } = this;
    context.beginPath();
    for (const [a, b] of segments) {
      const seen = this.segment(a, b);
      if (seen) {
        context.moveTo(...seen[0]);
        context.lineTo(...seen[1]);
      }
    }
    Object.assign(context, { strokeStyle: stroke, lineWidth: width, globalAlpha: alpha });
    context.setLineDash(dash);
    context.stroke();
    context.setLineDash([]);
    context.globalAlpha = 1;
  }

  // An arrow with a seam that sets it off.
  arrow(from, to, colour, alpha = 1) {
    const seen = this.segment(from, to);
    if (!seen) return;
    const [[x, y], tip] = seen;
    const [dx, dy] = [tip[0] - x, tip[1] - y];
    const size = Math.hypot(dx, dy);
    if (!(size > 2)) return;
    const head = Math.min(12, 0.6 * size);
    const along = [dx / size, dy / size];
    const neck = [tip[0] - head * along[0], tip[1] - head * along[1]];
    const side = (w) => [neck[0] - w * along[1], neck[1] + w * along[0]];
    const { context } = this;
    const layers = [
      [colours.seam, 2],
      [colour, 0],
    ];
    // A faint one has no seam.
    for (const [stroke, extra] of alpha < 1 ? layers.slice(1) : layers) {
      this.trace([[x, y], neck], false);
      Object.assign(context, { strokeStyle: stroke, lineWidth: 2.8 + extra, globalAlpha: alpha });
      context.stroke();
      this.flat([tip, side(0.42 * head), side(-0.42 * head)], {
        fill: stroke,
        stroke,
        width: 1 + extra,
        alpha,
      });
    }
  }

  dot(point, radius, colour) {
    if (!isFinitePoint(point) || this.lens.depth(point) < this.lens.near) return;
    const [x, y] = this.lens.project(point);
    this.context.beginPath();
    this.context.arc(x, y, radius, 0, 2 * Math.PI);
    this.context.fillStyle = colour;
    this.context.fill();
  }
}
