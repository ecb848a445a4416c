// Vectors of three numbers, rotations, and polygons in the picture.

const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
const subtract = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const times = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [
  a[1] * b[2] - a[2] * b[1],
  a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0],
];
const length = (a) => Math.hypot(a[0], a[1], a[2]);
const unit = (a) => times(a, 1 / length(a));
const between = (a, b, share) => add(a, times(subtract(b, a), share));
const isFinitePoint = (a) => a.every(Number.isFinite);

// A(q) v, from the body to the world: v + 2 q_w (u × v) + 2 u × (u × v), q = (q_w, u).
function rotate([w, x, y, z], v) {
  const u = [x, y, z];
  const once = cross(u, v);
  return add(add(v, times(once, 2 * w)), times(cross(u, once), 2));
}

// The convex hull of points of the picture, in order around it.
function hull(points) {
  const sorted = [...points].sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  const turnsLeft = (a, b, c) => (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 0;
  const outline = [];
  // The lower chain from left to right, then the upper one back.
  for (const chain of [sorted, [...sorted].reverse()]) {
    const start = outline.length;
    for (const point of chain) {
      while (outline.length >= start + 2 && !turnsLeft(outline.at(-2), outline.at(-1), point)) {
        outline.pop();
      }
      outline.push(point);
    }
    // The next chain begins with it.
    outline.pop();
  }
  return outline;
}

// What of a polygon is where `height` is at least `level`.
function clip(polygon, height, level) {
  const kept = [];
  polygon.forEach((here, i) => {
    const before = polygon[(i + polygon.length - 1) % polygon.length];
    const [h, b] = [height(here) - level, height(before) - level];
    if (h < 0 !== b < 0) kept.push(between(before, here, b / (b - h)));
    if (h >= 0) kept.push(here);
  });
  return kept;
}
