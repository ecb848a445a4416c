// Surfaces of pieces: triangles with normals and, at each vertex, the distance to the drawn lines.
// Lines are sharp edges, or two faint great circles of a ball. Meshes and capsules have none.

// Number of segments of a rounded edge, and of a quarter of a ball.
const ARCS = 8;
// Cosine of the smallest angle between faces with a visible edge. Faces with smaller angles
// approximate a round shape.
const CREASE = Math.cos((30 * Math.PI) / 180);
// Distance that stands for no line, larger than any surface.
const NO_LINE = 1e3;
// Strength of the great circles of a ball.
const BALL_LINES = 0.45;
const NO_LINES = [NO_LINE, NO_LINE];

class Surface {
  constructor() {
    Object.assign(this, { places: [], normals: [], lines: [], strength: 1 });
  }

  // Adds a triangle, oriented to match its normals.
  triangle(corners, normals, lines) {
    const across = cross(subtract(corners[1], corners[0]), subtract(corners[2], corners[0]));
    const turned = dot(across, normals.reduce(add)) < 0 ? [0, 2, 1] : [0, 1, 2];
    for (const k of turned) {
      this.places.push(...corners[k]);
      this.normals.push(...normals[k]);
      this.lines.push(...lines[k]);
    }
  }

  // Converts to three.js. `size` scales the distances to lines, which are thinner on small pieces.
  geometry(size) {
    const made = new THREE.BufferGeometry();
    const attribute = (values, items) => new THREE.Float32BufferAttribute(values, items);
    made.setAttribute("position", attribute(this.places, 3));
    made.setAttribute("normal", attribute(this.normals, 3));
    made.setAttribute("line", attribute(this.lines.map((x) => x / size), 2));
    made.setAttribute("strength", attribute(new Array(this.places.length / 3).fill(this.strength), 1));
    return made;
  }
}

// Points of an arc between two directions.
function arc(from, to, pieces) {
  const all = [];
  for (let k = 0; k <= pieces; k += 1) all.push(unit(between(from, to, k / pieces)));
  return all;
}

// Surface of a mesh, or of all points within `radius` of a polyhedron. The latter has shifted
// faces, cylinder segments along edges, and ball segments at corners.
function hullSurface({ vertices, faces, radius, mesh }) {
  const surface = new Surface();
  const edges = new Map();
  for (const { vertices: face, normal } of faces) {
    face.forEach((a, i) => {
      const b = face[(i + 1) % face.length];
      const name = a < b ? `${a} ${b}` : `${b} ${a}`;
      if (!edges.has(name)) edges.set(name, { ends: [a, b], normals: [] });
      edges.get(name).normals.push(normal);
    });
  }
  const isSharp = (a, b) => {
    const { normals } = edges.get(a < b ? `${a} ${b}` : `${b} ${a}`);
    return normals.length < 2 || dot(normals[0], normals[1]) < CREASE;
  };
  const normalAt = smoothNormals(vertices, faces);
  for (const { vertices: face, normal } of faces) {
    const normals = face.map((vertex) => (radius > 0 ? normal : normalAt(vertex, normal)));
    if (mesh) {
      surface.triangle(face.map((vertex) => vertices[vertex]), normals, [NO_LINES, NO_LINES, NO_LINES]);
      continue;
    }
    const centre = unit(normals.reduce(add));
    const corners = face.map((i) => add(vertices[i], times(normal, radius)));
    const middle = times(corners.reduce(add), 1 / corners.length);
    corners.forEach((a, i) => {
      const k = (i + 1) % corners.length;
      const b = corners[k];
      const away = length(cross(subtract(b, a), subtract(middle, a))) / length(subtract(b, a));
      const line = isSharp(face[i], face[k]) ? 0 : NO_LINE;
      const lines = [
        [line + away, line + away],
        [line, line],
        [line, line],
      ];
      surface.triangle([middle, a, b], [centre, normals[i], normals[k]], lines);
    });
  }
  if (radius > 0) roundEdges(surface, vertices, [...edges.values()], radius);
  return surface;
}

// Normals at the vertices of faces: the mean over the faces that are not beyond a crease, weighted
// by their angles there.
function smoothNormals(vertices, faces) {
  const around = vertices.map(() => []);
  for (const { vertices: face, normal } of faces) {
    face.forEach((vertex, i) => {
      const [before, after] = [face.at(i - 1), face[(i + 1) % face.length]].map((other) =>
        subtract(vertices[other], vertices[vertex]),
      );
      const angle = Math.atan2(length(cross(before, after)), dot(before, after));
      around[vertex].push({ normal, weighted: times(normal, angle) });
    });
  }
  return (vertex, normal) => {
    const near = around[vertex].filter((other) => dot(other.normal, normal) > CREASE);
    const sum = near.reduce((all, { weighted }) => add(all, weighted), [0, 0, 0]);
    const size = length(sum);
    return size > 1e-12 ? times(sum, 1 / size) : normal;
  };
}

function roundEdges(surface, vertices, edges, radius) {
  const at = (vertex, normal) => add(vertices[vertex], times(normal, radius));
  const add3 = (spots) =>
    surface.triangle(
      spots.map(([vertex, normal]) => at(vertex, normal)),
      spots.map(([, normal]) => normal),
      [NO_LINES, NO_LINES, NO_LINES],
    );
  // Mean normal at each vertex.
  const middles = vertices.map(() => [0, 0, 0]);
  for (const { ends, normals } of edges) {
    for (const end of ends) middles[end] = normals.reduce(add, middles[end]);
  }
  for (const { ends, normals } of edges.filter((edge) => edge.normals.length === 2)) {
    const [a, b] = ends;
    const rim = arc(...normals, ARCS);
    for (let k = 0; k < ARCS; k += 1) {
      add3([[a, rim[k]], [a, rim[k + 1]], [b, rim[k]]]);
      add3([[b, rim[k]], [a, rim[k + 1]], [b, rim[k + 1]]]);
      for (const end of ends) {
        const ways = [k, k + 1].map((i) => arc(unit(middles[end]), rim[i], ARCS));
        for (let ring = 0; ring < ARCS; ring += 1) {
          const [near, far] = [ring, ring + 1].map((i) => ways.map((way) => [end, way[i]]));
          add3([near[0], far[0], far[1]]);
          if (ring > 0) add3([near[0], far[1], near[1]]);
        }
      }
    }
  }
}

// Surface of a ball or capsule. Great circles of a ball are normal to the first and third axis of
// the body and show how it rolls.
function roundSurface({ vertices, radius }) {
  const surface = new Surface();
  const [a, b] = [vertices[0], vertices.at(-1)];
  const isBall = length(subtract(b, a)) === 0;
  surface.strength = BALL_LINES;
  const axis = isBall ? [0, 1, 0] : unit(subtract(b, a));
  const least = axis.map(Math.abs).indexOf(smallest(axis.map(Math.abs)));
  const u = isBall ? [0, 0, 1] : unit(cross(axis, [0, 1, 2].map((k) => (k === least ? 1 : 0))));
  const v = cross(axis, u);
  const around = 8 * ARCS;
  // Latitudes from pole to pole. A capsule has the equator twice.
  const levels = [];
  for (let k = -2 * ARCS; k <= 2 * ARCS; k += 1) {
    const angle = (Math.PI * k) / (4 * ARCS);
    if (k <= 0) levels.push([a, angle]);
    if (k > 0 || (k === 0 && !isBall)) levels.push([b, angle]);
  }
  const spot = ([centre, angle], k) => {
    const turn = (2 * Math.PI * k) / around;
    const [x, y] = [Math.cos(angle) * Math.cos(turn), Math.cos(angle) * Math.sin(turn)];
    const normal = add(add(times(u, x), times(v, y)), times(axis, Math.sin(angle)));
    const lines = isBall ? [radius * Math.abs(x), radius * Math.abs(y)] : NO_LINES;
    return [add(centre, times(normal, radius)), normal, lines];
  };
  const put = (spots) => surface.triangle(...[0, 1, 2].map((part) => spots.map((one) => one[part])));
  for (let level = 0; level + 1 < levels.length; level += 1) {
    for (let k = 0; k < around; k += 1) {
      const [low, high] = [levels[level], levels[level + 1]];
      if (level > 0) put([spot(low, k), spot(low, k + 1), spot(high, k)]);
      if (level + 2 < levels.length) put([spot(high, k), spot(low, k + 1), spot(high, k + 1)]);
    }
  }
  return surface;
}

// Unit ball and box, 2 m across, which are scaled to all others.
const UNIT_BALL = { vertices: [[0, 0, 0]], faces: [], radius: 1 };
const UNIT_BOX = {
  vertices: [0, 1, 2, 3, 4, 5, 6, 7].map((i) => [1, 2, 4].map((bit) => (i & bit ? 1 : -1))),
  faces: [
    { vertices: [1, 3, 7, 5], normal: [1, 0, 0] },
    { vertices: [0, 4, 6, 2], normal: [-1, 0, 0] },
    { vertices: [2, 6, 7, 3], normal: [0, 1, 0] },
    { vertices: [0, 1, 5, 4], normal: [0, -1, 0] },
    { vertices: [4, 5, 7, 6], normal: [0, 0, 1] },
    { vertices: [0, 2, 3, 1], normal: [0, 0, -1] },
  ],
  radius: 0,
};
// Tolerance for the corners of a scaled box.
const SAME_CORNER = 1e-6;

// A piece as a `shape` that is scaled along each axis and moved to `middle`. Balls and axis-aligned
// boxes use the unit shapes. Other pieces are unscaled.
function stretched(piece) {
  const { vertices, faces, radius, mesh } = piece;
  const asItIs = { shape: piece, middle: [0, 0, 0], stretch: [1, 1, 1] };
  if (mesh) return asItIs;
  if (vertices.length === 1 && faces.length === 0) {
    return { shape: UNIT_BALL, middle: vertices[0], stretch: [radius, radius, radius] };
  }
  if (vertices.length !== 8 || faces.length !== 6 || radius > 0) return asItIs;
  const ends = [0, 1, 2].map((axis) => extremes(vertices.map((vertex) => vertex[axis])));
  const middle = ends.map(([low, high]) => 0.5 * (low + high));
  const stretch = ends.map(([low, high]) => 0.5 * (high - low));
  const isCorner = (x, axis) => Math.abs(Math.abs((x - middle[axis]) / stretch[axis]) - 1) < SAME_CORNER;
  return vertices.every((vertex) => vertex.every(isCorner)) ? { shape: UNIT_BOX, middle, stretch } : asItIs;
}

// Number of contour lines of a terrain, approximately.
const CONTOURS = 14;

// Lowest and highest point of the fixed meshes (m).
function relief({ data }) {
  const meshes = data.fixed.flatMap(({ pieces }) => pieces.filter(({ mesh }) => mesh));
  return extremes(meshes.flatMap(({ vertices }) => vertices.map((at) => at[2])));
}

// Step of the contour lines of the fixed meshes (m); 0 without relief.
function contourStep(run) {
  const [low, high] = relief(run);
  return high - low > 1e-3 * run.smallestReach ? roundLength((high - low) / CONTOURS) : 0;
}

// Segments along the rim of the meshes of a thing: edges of one triangle only.
function edgesOf(thing) {
  const meshes = thing.pieces.filter(({ mesh }) => mesh);
  thing.edges ??= meshes.flatMap(({ vertices, faces }) => {
    const names = vertices.map(String);
    const found = new Map();
    for (const { vertices: face } of faces) {
      face.forEach((a, i) => {
        const b = face[(i + 1) % face.length];
        const name = names[a] < names[b] ? `${names[a]} ${names[b]}` : `${names[b]} ${names[a]}`;
        found.set(name, found.has(name) ? null : [a, b]);
      });
    }
    return [...found.values()].flatMap((ends) => (ends ?? []).flatMap((end) => local(vertices[end])));
  });
  return thing.edges;
}

// Geometry of a piece.
function pieceGeometry(piece) {
  const surface = piece.faces.length > 0 ? hullSurface(piece) : roundSurface(piece);
  const middle = times(piece.vertices.reduce(add), 1 / piece.vertices.length);
  const reach = largest(piece.vertices.map((vertex) => length(subtract(vertex, middle))));
  return surface.geometry(reach + piece.radius);
}
