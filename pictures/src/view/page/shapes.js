// The pieces of bodies in the world: where they are in the picture, which of two is painted
// first, what they hide.

// Of a body's size: pieces that overlap by less are taken as apart, and what lies behind a
// piece by less is not hidden.
const TOUCH = 1e-3;
// Corners of a circle that stands for a ball in an outline.
const ROUND = 14;

// A piece of body `body` of run `run`, or of what is fixed (body −1), where it now is.
class Solid {
  constructor(piece, owner, place, attitude, lens) {
    Object.assign(this, owner);
    this.radius = piece.radius;
    this.attitude = attitude;
    const at = (point) => (attitude ? add(place, rotate(attitude, point)) : point);
    this.vertices = piece.vertices.map(at);
    this.sides = piece.faces.map(({ vertices, normal }) => {
      const turned = attitude ? rotate(attitude, normal) : normal;
      const offset = dot(turned, this.vertices[vertices[0]]) + this.radius;
      return { vertices, normal: turned, offset };
    });
    this.isDrawn = this.vertices.every(isFinitePoint);
    this.centre = times(this.vertices.reduce(add), 1 / this.vertices.length);
    this.depth = lens.depth(this.centre);
    this.measure(lens);
  }

  // The rectangle of the picture that it is in; all of it where it reaches the camera.
  measure(lens) {
    this.isNear = this.vertices.some((vertex) => lens.depth(vertex) - this.radius < lens.near);
    if (this.isNear || !this.isDrawn) {
      this.box = [-Infinity, -Infinity, Infinity, Infinity];
      return;
    }
    this.spots = this.vertices.map(lens.project);
    const box = [Infinity, Infinity, -Infinity, -Infinity];
    this.spots.forEach(([x, y], i) => {
      const room = 1.1 * lens.pixels(this.radius, this.vertices[i]);
      box[0] = Math.min(box[0], x - room);
      box[1] = Math.min(box[1], y - room);
      box[2] = Math.max(box[2], x + room);
      box[3] = Math.max(box[3], y + room);
    });
    this.box = box;
  }

  // Its outline in the picture.
  outline(lens) {
    if (this.radius === 0) return hull(this.spots);
    const circle = this.spots.flatMap(([x, y], i) => {
      const r = lens.pixels(this.radius, this.vertices[i]);
      return Array.from({ length: ROUND }, (_, k) => {
        const angle = (2 * Math.PI * k) / ROUND;
        return [x + r * Math.cos(angle), y + r * Math.sin(angle)];
      });
    });
    return hull(circle);
  }

  // Whether all of it lies beyond a plane, on the side of its normal.
  isBeyond(normal, offset) {
    return this.vertices.every((vertex) => dot(normal, vertex) - this.radius >= offset);
  }

  // Whether it lies between the eye and a point. Of the way eye + s (point − eye), the part
  // inside all faces is from the last entry to the first exit; of a ball or a capsule, the
  // part that is nearer to the segment than the radius.
  hides(eye, point) {
    const way = subtract(point, eye);
    if (this.sides.length === 0) return this.roundHides(eye, way);
    let [entry, exit] = [0, 1 - 1e-6];
    for (const { normal, offset } of this.sides) {
      const speed = dot(normal, way);
      const gap = offset - dot(normal, eye);
      if (speed === 0) {
        if (gap < 0) return false;
      } else if (speed < 0) {
        entry = Math.max(entry, gap / speed);
      } else {
        exit = Math.min(exit, gap / speed);
      }
    }
    return exit - entry > 1e-5;
  }

  roundHides(eye, way) {
    const [a, b] = [this.vertices[0], this.vertices.at(-1)];
    const axis = subtract(b, a);
    // The nearest points of the two lines, by turns; the second line is short.
    let share = 0.5;
    let along = 0;
    for (let k = 0; k < 6; k += 1) {
      const core = add(a, times(axis, share));
      along = dot(subtract(core, eye), way) / dot(way, way);
      const near = subtract(add(eye, times(way, along)), a);
      const square = dot(axis, axis);
      share = square > 0 ? Math.min(1, Math.max(0, dot(near, axis) / square)) : 0;
    }
    const core = add(a, times(axis, share));
    const apart = length(subtract(add(eye, times(way, along)), core));
    const inside = Math.sqrt(Math.max(0, this.radius ** 2 - apart ** 2)) / length(way);
    return apart < this.radius && along + inside < 1 + 1e-6 && along - inside < 1 - 0.1 * inside;
  }
}

const overlap = (a, b) => a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3];

// Which of two is painted first: negative for `a`, positive for `b`, 0 for either. A plane that
// has them on different sides decides: first the one that is not on the eye's side.
function order(a, b, eye) {
  const room = TOUCH * Math.min(a.reach, b.reach);
  for (const [one, other, sign] of [
    [a, b, 1],
    [b, a, -1],
  ]) {
    for (const { normal, offset } of one.sides) {
      if (!other.isBeyond(normal, offset - room)) continue;
      // The other is on the side of the normal: in front if the eye is there too.
      return dot(normal, eye) > offset ? -sign : sign;
    }
  }
  const way = subtract(b.centre, a.centre);
  const size = length(way);
  if (a.sides.length + b.sides.length === 0 && size > 0) {
    const normal = times(way, 1 / size);
    const offset = (dot(normal, a.centre) + dot(normal, b.centre)) / 2;
    return dot(normal, eye) > offset ? -1 : 1;
  }
  return b.depth - a.depth;
}

// The solids in the order of painting: each after all that it is in front of. Where they are in
// front of each other in a circle, the farthest comes first.
function sorted(solids, eye) {
  const far = [...solids].sort((a, b) => b.depth - a.depth);
  far.forEach((solid) => (solid.behind = []));
  for (let i = 0; i < far.length; i += 1) {
    for (let k = i + 1; k < far.length; k += 1) {
      if (!overlap(far[i].box, far[k].box)) continue;
      const [one, other] = [far[i], far[k]];
      if (order(one, other, eye) <= 0) other.behind.push(one);
      else one.behind.push(other);
    }
  }
  const done = new Set();
  const painted = [];
  const visit = (solid) => {
    if (done.has(solid)) return;
    done.add(solid);
    solid.behind.forEach(visit);
    painted.push(solid);
  };
  far.forEach(visit);
  return painted;
}

// Whether a place of the picture is in a convex outline.
function contains(outline, [x, y]) {
  const turns = outline.map(([ax, ay], i) => {
    const [bx, by] = outline[(i + 1) % outline.length];
    return (bx - ax) * (y - ay) - (by - ay) * (x - ax);
  });
  return turns.every((turn) => turn >= 0) || turns.every((turn) => turn <= 0);
}
