// A view of one body or of several: ground, shadow, body, forces, trail.

const UP = [0, 0, 1];
// The light comes over the left shoulder of whoever looks from the first view.
const LIGHT = unit([0.35, -0.25, 1]);
// Places that are looked at to find out how large the scene is, and frames at least.
const SAMPLES = 2000;
const FEWEST_FRAMES = 12;
// Pieces of a trail.
const PIECES = 1200;
// Lines of the grid along its longer side, about.
const LINES = 14;

// Places that the body comes to: its corners in frames spread over the run.
function visited(run) {
  const frames = Math.max(FEWEST_FRAMES, SAMPLES / run.points.length);
  const stride = Math.max(1, Math.ceil(run.count / frames));
  const points = [];
  for (let frame = 0; frame < run.count; frame += stride) points.push(...run.corners(frame));
  points.push(...run.corners(run.count - 1));
  return points.filter(isFinitePoint);
}

const places = runs.flatMap(visited);
// Where they are on the ground.
const feet = [];

// 1, 2 or 5 times a power of ten.
function roundLength(size) {
  const power = 10 ** Math.floor(Math.log10(size));
  return ([1, 2, 5].find((digit) => digit * power >= size) ?? 10) * power;
}

// The ground under everything: the plane n · x = d with a grid; null where there is none.
function groundOf(run) {
  if (run.data.ground === null) return null;
  const { normal, offset } = run.data.ground;
  const height = (point) => dot(normal, point) - offset;
  // Along the vertical, or straight across where the ground is a wall.
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
  const below = (places.length ? places : [[0, 0, 0]]).map(drop);
  feet.push(...below);
  const ends = axes.map((axis) => {
    const along = below.map((foot) => dot(axis, foot));
    return [Math.min(...along), Math.max(...along)];
  });
  const size = Math.max(1e-9, ...ends.map(([low, high]) => high - low));
  const spacing = roundLength(size / LINES);
  const [[x0, x1], [y0, y1]] = ends.map(([low, high]) => [
    Math.floor(low / spacing - 0.4) * spacing,
    Math.ceil(high / spacing + 0.4) * spacing,
  ]);
  const at = (x, y) => add(times(normal, offset), add(times(axes[0], x), times(axes[1], y)));
  const grid = [];
  for (let k = 1; k < Math.round((x1 - x0) / spacing); k += 1) {
    grid.push([at(x0 + k * spacing, y0), at(x0 + k * spacing, y1)]);
  }
  for (let k = 1; k < Math.round((y1 - y0) / spacing); k += 1) {
    grid.push([at(x0, y0 + k * spacing), at(x1, y0 + k * spacing)]);
  }
  const outline = [at(x0, y0), at(x1, y0), at(x1, y1), at(x0, y1)];
  return { normal, height, drop, grid, outline };
}

const grounds = runs.map(groundOf);
const ways = runs.map((run) => run.way(PIECES));

class Stage {
  // `members` are the runs it shows.
  constructor(members, label) {
    this.members = members;
    this.canvas = element("canvas", { tabindex: "0", role: "img", "aria-label": label });
    this.caption = element("figcaption");
    this.figure = element("figure", { class: "stage" }, this.canvas, this.caption);
    if (isPair) {
      for (const run of members) {
        const key = element("span", { class: "key" }, run.name);
        key.style.setProperty("--colour", run.index ? "var(--run-b)" : "var(--run-a)");
        this.caption.append(key);
      }
    }
    this.remark = element("span", { class: "remark" });
    this.caption.append(this.remark);
  }

  // What the picture does not show by itself.
  remarks(time, show) {
    const notes = [];
    const planes = new Set(this.members.map((run) => JSON.stringify(run.data.ground)));
    if (planes.size > 1) {
      const { name, data } = this.members[0];
      notes.push(data.ground ? `the ground is that of ${name}` : `${name} has no ground to show`);
    }
    if (show.forces && this.members.every((run) => run.frame(time) === run.count - 1)) {
      notes.push("the last row: no step follows, so it has no forces");
    }
    return notes.join("; ");
  }

  get size() {
    return [this.canvas.clientWidth, this.canvas.clientHeight];
  }

  // Paints what stands at `time`, with the mean forces since `before`: while the time runs,
  // an impact of one step is then seen whichever frames are painted.
  paint(camera, time, before, show) {
    const [width, height] = this.size;
    if (width === 0 || height === 0) return;
    const ratio = window.devicePixelRatio || 1;
    const pixels = [Math.round(width * ratio), Math.round(height * ratio)];
    if (this.canvas.width !== pixels[0] || this.canvas.height !== pixels[1]) {
      [this.canvas.width, this.canvas.height] = pixels;
    }
    const context = this.canvas.getContext("2d");
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.fillStyle = colours.sky;
    context.fillRect(0, 0, width, height);
    const lens = camera.lens(width, height, this.followed(time, show));
    const brush = new Brush(context, lens);
    const ground = grounds[this.members[0].index];
    const bodies = this.members.map((run) => this.body(run, time, before, lens));
    const isAbove = ground === null || ground.height(lens.eye) > 0;
    const paintBodies = () => {
      // The farther body first.
      bodies.sort((a, b) => lens.depth(b.place) - lens.depth(a.place));
      for (const body of bodies) this.paintBody(brush, body, show);
    };
    // What is beyond the ground is painted before it.
    if (!isAbove) paintBodies();
    if (ground) this.paintGround(brush, ground, isAbove);
    if (ground && isAbove) {
      for (const body of bodies) this.paintShadow(brush, ground, body);
    }
    if (isAbove) paintBodies();
    this.paintAxes(context, lens, height);
    put(this.remark, this.remarks(time, show));
  }

  // How far the view is moved to keep the bodies in the middle.
  followed(time, show) {
    if (!show.follow) return [0, 0, 0];
    const middle = (t) => {
      const all = this.members.map((run) => run.position(run.frame(t)));
      return times(all.reduce(add), 1 / all.length);
    };
    const shift = subtract(middle(time), show.anchor);
    return isFinitePoint(shift) ? shift : [0, 0, 0];
  }

  body(run, time, before, lens) {
    const frame = run.frame(time);
    const since = Math.min(run.frame(before), frame - 1);
    const corners = run.corners(frame);
    const isDrawn = corners.every(isFinitePoint);
    const sides = run.isBox && isDrawn ? faces(corners) : [];
    const isHidden = (point) => sides.length > 0 && hides(sides, lens.eye, point);
    return { run, frame, since, corners, isDrawn, sides, isHidden, place: run.position(frame) };
  }

  paintGround(brush, ground, isAbove) {
    const alpha = isAbove ? 1 : 0.6;
    brush.polygon(ground.outline, { fill: colours.ground, alpha });
    brush.lines(ground.grid, { stroke: colours.grid, alpha });
    brush.polygon(ground.outline, { stroke: colours.grid, width: 1.6, alpha });
  }

  paintShadow(brush, ground, body) {
    if (!body.isDrawn) return;
    const feet = body.corners.map(ground.drop);
    if (feet.some((foot) => brush.lens.depth(foot) < brush.lens.near)) return;
    const alpha = colours.isDark ? 0.45 : 0.28;
    brush.flat(hull(feet.map(brush.lens.project)), { fill: colours.shadow, alpha });
  }

  // First what the body hides, then the body, then what lies before it.
  paintBody(brush, body, show) {
    const { run, frame, since, corners, isHidden } = body;
    if (!body.isDrawn) return;
    const arrows = show.forces ? run.forces(frame, since) : [];
    const [far, near] = [[], []];
    for (const { corner, force } of arrows) {
      (isHidden(corners[corner]) ? far : near).push([
        corners[corner],
        add(corners[corner], run.arrow(force)),
      ]);
    }
    const trail = show.trail ? this.trail(body) : { hidden: [], seen: [], ahead: [] };
    const line = {
      stroke: isPair ? colours[run.index ? "run-b" : "run-a"] : colours.trail,
      width: 1.6,
    };
    brush.lines(trail.ahead, { ...line, alpha: 0.45, dash: [2, 4] });
    brush.lines(trail.hidden, line);
    for (const [from, to] of far) brush.arrow(from, to, colours.force);
    this.paintFaces(brush, body);
    brush.lines(trail.seen, line);
    for (const [from, to] of near) brush.arrow(from, to, colours.force);
  }

  paintFaces(brush, { run, corners, sides }) {
    const { lens } = brush;
    const alpha = this.members.length > 1 ? 0.6 : 1;
    if (!run.isBox) {
      if (corners.some((corner) => lens.depth(corner) < lens.near)) return;
      const outline = hull(corners.map(lens.project));
      brush.flat(outline, {
        fill: shade(run.index, 0.75),
        stroke: colours.edge,
        width: 1.8,
        alpha,
      });
      for (const corner of corners) brush.dot(corner, 3.5, colours.edge);
      return;
    }
    const seen = sides.filter(
      ({ corners: [corner], normal }) => dot(normal, subtract(lens.eye, corner)) > 0,
    );
    for (const { corners: outline, normal } of seen) {
      // The lamp, and the sky for what it does not reach.
      const light = 0.3 + 0.22 * (0.5 + 0.5 * normal[2]) + 0.46 * Math.max(0, dot(normal, LIGHT));
      brush.polygon(outline, { fill: shade(run.index, light), alpha });
    }
    for (const { corners: outline } of seen) {
      brush.polygon(outline, { stroke: colours.edge, width: 1.6 });
    }
  }

  // The way of the centre of mass: behind the body, before it, and still to come.
  trail({ run, frame, isHidden }) {
    const trail = { hidden: [], seen: [], ahead: [] };
    let from = run.position(0);
    let before = 0;
    for (const next of ways[run.index]) {
      const ends = before < frame && frame < next ? [frame, next] : [next];
      before = next;
      for (const end of ends) {
        const to = run.position(end);
        if (isFinitePoint(from) && isFinitePoint(to)) {
          const part = end > frame ? "ahead" : isHidden(between(from, to, 0.5)) ? "hidden" : "seen";
          trail[part].push([from, to]);
        }
        from = to;
      }
    }
    return trail;
  }

  // The directions of the world, in the lower left corner.
  paintAxes(context, lens, height) {
    const [x, y] = [34, height - 34];
    const directions = [
      [1, 0, 0],
      [0, 1, 0],
      [0, 0, 1],
    ].map((axis, k) => {
      const [right, up, forward] = lens.axes.map((row) => dot(row, axis));
      return { name: "xyz"[k], right, up, forward };
    });
    directions.sort((a, b) => b.forward - a.forward);
    Object.assign(context, {
      lineWidth: 1.6,
      font: "600 11px system-ui, sans-serif",
      textAlign: "center",
      textBaseline: "middle",
    });
    for (const { name, right, up, forward } of directions) {
      context.globalAlpha = forward > 0.3 ? 0.6 : 1;
      context.strokeStyle = context.fillStyle = colours.ink;
      context.beginPath();
      context.moveTo(x, y);
      context.lineTo(x + 20 * right, y - 20 * up);
      context.stroke();
      context.fillText(name, x + 28 * right, y - 28 * up);
    }
    context.globalAlpha = 1;
  }
}
