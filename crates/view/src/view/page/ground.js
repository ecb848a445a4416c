// Ground, and extent of the motion.

// Direction of the light, as in the animation: horizontal over vertical component, and angle between
// the shadows and the initial view (degrees). Shadows fall to the right and backwards.
const LEAN = 0.466;
const SHADOW_TURN = 116;
const LIGHT = (() => {
  const angle = ((runs[0].data.view.azimuth + SHADOW_TURN) * Math.PI) / 180;
  return unit([-LEAN * Math.cos(angle), -LEAN * Math.sin(angle), 1]);
})();
// Number of points sampled to find the size of the scene, and minimum number of frames.
const SAMPLES = 2000;
const FEWEST_FRAMES = 12;
// Approximate number of grid lines along the longer side of the motion, and maximum in all.
const LINES = 10;
const MOST_LINES = 400;
// Radius of the ground over that of the motion.
const GROUND_REACH = 3.2;

// Anchors of the joints of a body, in its frame. They may be far from its shape, as the pivot of a pendulum.
const anchorsOf = (run, body) => run.data.joints.filter((joint) => joint.body === body).map(({ anchor }) => anchor);

// Distances of these anchors from the centre of mass.
const armsOf = (run, body) => anchorsOf(run, body).map(length);

// Positions of the bodies and joints in sampled frames, and fixed objects.
function visited(run) {
  const spans = run.bodies.map((body, b) => body.span.concat(anchorsOf(run, b)));
  const count = spans.reduce((sum, span) => sum + span.length, 0);
  const frames = Math.max(FEWEST_FRAMES, SAMPLES / count);
  const stride = Math.max(1, Math.ceil(run.count / frames));
  const points = run.data.fixed.flatMap((fixed) => fixed.span);
  const visit = (frame) =>
    spans.forEach((span, b) => append(points, run.placed(frame, b, span)));
  for (let frame = 0; frame < run.count; frame += stride) visit(frame);
  visit(run.count - 1);
  return points.filter(isFinitePoint);
}

const places = runs.flatMap(visited);
// Projections of these points to the ground.
const feet = [];

// Share of the largest motion from which a body is in the picture, and margin around it over its
// size.
const MOVES = 0.05;
const MARGIN = 2;

// Places around the bodies that move and their joints, in sampled frames.
function movingPlaces(run) {
  const stride = Math.max(1, Math.ceil(run.count / Math.max(FEWEST_FRAMES, SAMPLES / run.bodies.length)));
  const frames = Array.from({ length: Math.ceil(run.count / stride) }, (_, i) => i * stride).concat(run.count - 1);
  const paths = run.bodies.map((_, body) => frames.map((frame) => run.position(frame, body)).filter(isFinitePoint));
  const ways = paths.map((path) => largest(path.map((at) => length(subtract(at, path[0])))));
  const least = MOVES * largest(ways);
  const isMoving = (body) => ways[body] >= least && ways[body] > MOVES * run.reaches[body];
  return paths.flatMap((path, body) => {
    const room = MARGIN * run.reaches[body];
    const ends = [-room, room];
    const around = (at) => ends.flatMap((x) => ends.flatMap((y) => ends.map((z) => add(at, [x, y, z]))));
    const pivots = frames.flatMap((frame) => run.placed(frame, body, anchorsOf(run, body))).filter(isFinitePoint);
    return isMoving(body) ? path.flatMap(around).concat(pivots) : [];
  });
}

const moving = runs.flatMap(movingPlaces);

// Centre of all bodies of a run in a frame, and radius of the group about it.
function cluster(run, frame) {
  const centres = run.bodies
    .map((_, body) => ({ at: run.position(frame, body), reach: largest([run.reaches[body], ...armsOf(run, body)]) }))
    .filter(({ at }) => isFinitePoint(at));
  if (centres.length === 0) return null;
  const middle = times(centres.map(({ at }) => at).reduce(add), 1 / centres.length);
  return { middle, reach: largest(centres.map(({ at, reach }) => length(subtract(at, middle)) + reach)) };
}

// Length of the path over the size of the group above which the camera follows.
const LONG = 8;

// Largest radius of the group if its path is long; 0 otherwise.
function travels(run) {
  const stride = Math.max(1, Math.ceil(run.count / FEWEST_FRAMES));
  const all = [];
  for (let frame = 0; frame < run.count; frame += stride) all.push(cluster(run, frame));
  all.push(cluster(run, run.count - 1));
  const known = all.filter((one) => one !== null);
  if (known.length === 0) return 0;
  const way = largest(known.map(({ middle }) => length(subtract(middle, known[0].middle))));
  const reach = largest(known.map((one) => one.reach));
  return way > LONG * reach ? reach : 0;
}

const followedReach = largest(runs.map(travels));

// Rounds up to 1, 2 or 5 times a power of ten.
function roundLength(size) {
  const power = 10 ** Math.floor(Math.log10(size));
  return ([1, 2, 5].find((digit) => digit * power >= size) ?? 10) * power;
}

// Ground plane n · x = d with a grid; null without ground.
function groundOf(run) {
  if (run.data.ground === null) return null;
  const { normal, offset } = run.data.ground;
  const height = (point) => dot(normal, point) - offset;
  // Projects vertically, or along the normal if the ground is a wall.
  const way = Math.abs(dot(normal, UP)) > 0.05 ? times(UP, 1 / dot(normal, UP)) : normal;
  const drop = (point) => subtract(point, times(way, height(point)));
  const across = unit(subtract([1, 0, 0], times(normal, normal[0])));
  const axes =
    Math.abs(normal[0]) < 0.999
      ? [across, cross(normal, across)]
      : [
          [0, 1, 0],
          [0, 0, 1],
        ];
  const all = places.length ? places : [[0, 0, 0]];
  const below = all.map(drop);
  append(feet, below);
  const ends = axes.map((axis) => extremes(below.map((foot) => dot(axis, foot))));
  const [wide, high] = ends.map(([low, top]) => top - low);
  const radius = Math.max(1e-9, GROUND_REACH * run.roam * 0.5 * Math.hypot(wide, high));
  const size = Math.max(1e-9, wide, high);
  // If the camera follows, cells have the size of the group, within the limit of lines.
  const cell = followedReach > 0 ? Math.min(size / LINES, followedReach) : size / LINES;
  const spacing = roundLength(Math.max(cell, (2 * radius) / MOST_LINES));
  const [x, y] = ends.map(([low, top]) => 0.5 * (low + top));
  const middle = add(times(normal, offset), add(times(axes[0], x), times(axes[1], y)));
  return { normal, height, axes, middle, radius, spacing };
}

const grounds = runs.map(groundOf);
