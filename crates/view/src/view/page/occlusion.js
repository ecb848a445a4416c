// Visibility test of contacts.

// Depth tolerance over the size of a body. Points behind a surface by less are visible.
const ON_SURFACE = 0.05;

// Number of neighbouring triangles of a mesh that are tested together.
const PATCH = 64;

// Drawn pieces with their poses.
class Occluders {
  constructor() {
    this.pieces = [];
  }

  // Adds the pieces of an owner: body of a run, or −2 and below for fixed objects.
  add(pieces, { place, attitude }, run, owner) {
    for (const piece of pieces) {
      piece.parts ??= piece.mesh ? patches(piece) : [piece];
      for (const part of piece.parts) {
        part.ball ??= ballAround(part);
        const centre = add(place, rotate(attitude, part.ball.centre));
        this.pieces.push({ piece: part, place, back: conjugate(attitude), centre, run, owner });
      }
    }
  }

  // True if a piece lies between the eye and a point, by more than a fraction of `reach`. Pieces of
  // the owners `through` in a run do not count.
  hides(eye, point, reach, through, of) {
    const way = subtract(point, eye);
    const size = length(way);
    const end = size - ON_SURFACE * reach;
    const ahead = times(way, 1 / size);
    return this.pieces.some(({ piece, place, back, centre, run, owner }) => {
      if (run === of && through.includes(owner)) return false;
      const away = subtract(centre, eye);
      const along = Math.min(end, Math.max(0, dot(away, ahead)));
      const off = subtract(away, times(ahead, along));
      if (dot(off, off) > piece.ball.radius ** 2) return false;
      return cuts(piece, rotate(back, subtract(eye, place)), rotate(back, ahead), end);
    });
  }
}

const conjugate = ([w, x, y, z]) => [w, -x, -y, -z];

function ballAround({ vertices, radius }) {
  const centre = times(vertices.reduce(add), 1 / vertices.length);
  const reach = largest(vertices.map((vertex) => length(subtract(vertex, centre))));
  return { centre, radius: reach + radius };
}

// Groups of neighbouring triangles of a mesh. Meshes of files list neighbours together.
function patches({ vertices, faces }) {
  const all = [];
  for (let start = 0; start < faces.length; start += PATCH) {
    const triangles = faces.slice(start, start + PATCH).map((face) => face.vertices.map((i) => vertices[i]));
    all.push({ vertices: triangles.flat(), radius: 0, triangles });
  }
  return all;
}

// True if the ray eye + s · ahead, 0 < s < end, intersects a triangle.
function cutsTriangle([a, b, c], eye, ahead, end) {
  const [u, v, from] = [subtract(b, a), subtract(c, a), subtract(eye, a)];
  const [p, q] = [cross(ahead, v), cross(from, u)];
  const volume = dot(u, p);
  const [x, y, s] = [dot(from, p) / volume, dot(ahead, q) / volume, dot(v, q) / volume];
  return x >= 0 && y >= 0 && x + y <= 1 && s > 0 && s < end;
}

// True if the ray eye + s · ahead, 0 < s < end, intersects a piece. Inside a polyhedron the ray is
// between its last entry and first exit of all half spaces.
function cuts(piece, eye, ahead, end) {
  if (piece.triangles) return piece.triangles.some((triangle) => cutsTriangle(triangle, eye, ahead, end));
  if (piece.faces.length === 0) return cutsRound(piece, eye, ahead, end);
  let [entry, exit] = [0, end];
  for (const { normal, vertices } of piece.faces) {
    const speed = dot(normal, ahead);
    const gap = dot(normal, subtract(piece.vertices[vertices[0]], eye)) + piece.radius;
    if (speed === 0 && gap < 0) return false;
    if (speed < 0) entry = Math.max(entry, gap / speed);
    else if (speed > 0) exit = Math.min(exit, gap / speed);
  }
  return entry < exit;
}

// Intersection with a ball or capsule: the ray is closer to the segment than the radius.
function cutsRound({ vertices, radius }, eye, ahead, end) {
  const [a, b] = [vertices[0], vertices.at(-1)];
  const axis = subtract(b, a);
  const square = dot(axis, axis);
  // Closest points of ray and segment, by alternating projection.
  let [share, along] = [0.5, 0];
  for (let k = 0; k < 6; k += 1) {
    along = dot(subtract(add(a, times(axis, share)), eye), ahead);
    const near = subtract(add(eye, times(ahead, along)), a);
    share = square > 0 ? Math.min(1, Math.max(0, dot(near, axis) / square)) : 0;
  }
  const apart = length(subtract(add(eye, times(ahead, along)), add(a, times(axis, share))));
  return apart < radius && along - Math.sqrt(radius ** 2 - apart ** 2) < end;
}
