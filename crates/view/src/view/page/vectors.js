// Vectors with three components, and rotations.

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

// Long lists are never spread into call arguments, since browsers limit them to about 100 000.

// Smallest and largest value.
function extremes(values) {
  let [low, high] = [Infinity, -Infinity];
  for (const value of values) {
    low = Math.min(low, value);
    high = Math.max(high, value);
  }
  return [low, high];
}
const smallest = (values) => extremes(values)[0];
const largest = (values) => extremes(values)[1];

// Appends all `items` to a list.
function append(list, items) {
  for (const item of items) list.push(item);
}

// Rotates v from the body to the world: v + 2 q_w (u × v) + 2 u × (u × v) with q = (q_w, u).
function rotate([w, x, y, z], v) {
  const u = [x, y, z];
  const once = cross(u, v);
  return add(add(v, times(once, 2 * w)), times(cross(u, once), 2));
}
