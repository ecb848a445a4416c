// A view of one run or of two: ground, shadows, bodies, forces, trail.

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

// Places that the bodies come to, in frames spread over the run, and what stands still.
function visited(run) {
  const count = run.bodies.reduce((sum, body) => sum + body.span.length, 0);
  const frames = Math.max(FEWEST_FRAMES, SAMPLES / count);
  const stride = Math.max(1, Math.ceil(run.count / frames));
  const points = run.data.fixed.flatMap((fixed) => fixed.span);
  const visit = (frame) =>
    run.bodies.forEach((body, b) => points.push(...run.placed(frame, b, body.span)));
  for (let frame = 0; frame < run.count; frame += stride) visit(frame);
  visit(run.count - 1);
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
// Of each run the way of the body that was last asked for.
const ways = runs.map(() => ({ body: -1, frames: [] }));
function wayOf(run, body) {
  const way = ways[run.index];
  if (way.body !== body) Object.assign(way, { body, frames: run.way(body, PIECES) });
  return way.frames;
}

// The lamp, and the sky for what it does not reach, from 0 to 1.
const lightOf = (normal) => 0.3 + 0.22 * (0.5 + 0.5 * normal[2]) + 0.46 * Math.max(0, dot(normal, LIGHT));

// A level circle about a vertex, as wide as the piece is round.
function disc(vertex, { radius }) {
  return Array.from({ length: ROUND }, (_, k) => {
    const angle = (2 * Math.PI * k) / ROUND;
    return add(vertex, [radius * Math.cos(angle), radius * Math.sin(angle), 0]);
  });
}

// The part that the eye sees of the great circle of a ball, or of the outline of a capsule, across
// one of the body's axes.
function seenCircle({ radius, vertices, attitude }, axis, eye) {
  const [u, v] = [(axis + 1) % 3, (axis + 2) % 3].map((k) => {
    const unitAxis = [0, 0, 0];
    unitAxis[k] = radius;
    return attitude ? rotate(attitude, unitAxis) : unitAxis;
  });
  const [a, b] = [vertices[0], vertices.at(-1)];
  const middle = between(a, b, 0.5);
  const along = subtract(b, a);
  const points = Array.from({ length: 25 }, (_, k) => {
    const angle = (Math.PI * k) / 12;
    const out = add(times(u, Math.cos(angle)), times(v, Math.sin(angle)));
    const lean = dot(out, along);
    // Along the capsule the circle is drawn out to its ends.
    const core = Math.abs(lean) < 1e-6 * radius * length(along) ? middle : lean > 0 ? b : a;
    return { place: add(core, out), out };
  });
  const segments = [];
  for (let k = 0; k + 1 < points.length; k += 1) {
    const [one, other] = [points[k], points[k + 1]];
    const isSeen = ({ place, out }) => dot(out, subtract(eye, place)) > 0;
    if (isSeen(one) && isSeen(other)) segments.push([one.place, other.place]);
  }
  return segments;
}

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
    const scenes = this.members.map((run) => this.scene(run, time, before, lens));
    const solids = scenes.flatMap((scene) => scene.solids);
    this.painted = sorted(
      solids.filter((solid) => solid.isDrawn),
      lens.eye,
    );
    this.lens = lens;
    const isAbove = ground === null || ground.height(lens.eye) > 0;
    // What is beyond the ground is painted before it.
    if (!isAbove) this.paintScenes(brush, scenes, show);
    if (ground) this.paintGround(brush, ground, isAbove);
    if (ground && isAbove) this.paintShadows(brush, ground, scenes);
    if (isAbove) this.paintScenes(brush, scenes, show);
    this.paintAxes(context, lens, height);
    put(this.remark, this.remarks(time, show));
  }

  // How far the view is moved to keep the bodies in the middle.
  followed(time, show) {
    if (!show.follow) return [0, 0, 0];
    const middle = (t) => {
      const all = this.members.map((run) => run.position(run.frame(t), show.body));
      return times(all.reduce(add), 1 / all.length);
    };
    const shift = subtract(middle(time), show.anchor);
    return isFinitePoint(shift) ? shift : [0, 0, 0];
  }

  // What a run shows: its pieces, its bodies of points, and which moments they are of.
  scene(run, time, before, lens) {
    const frame = run.frame(time);
    const since = Math.min(run.frame(before), frame - 1);
    const solids = [];
    const clouds = [];
    run.bodies.forEach(({ pieces, points }, body) => {
      const [place, attitude] = [run.position(frame, body), run.attitude(frame, body)];
      const owner = { run, body, reach: run.reaches[body] };
      for (const piece of pieces) solids.push(new Solid(piece, owner, place, attitude, lens));
      if (pieces.length === 0) clouds.push({ body, corners: run.placed(frame, body, points) });
    });
    const reach = Math.min(...run.reaches);
    for (const { pieces } of run.data.fixed) {
      for (const piece of pieces) {
        solids.push(new Solid(piece, { run, body: -1, reach }, null, null, lens));
      }
    }
    const drawn = solids.filter((solid) => solid.isDrawn);
    const isHidden = (point) => {
      const [x, y] = lens.project(point);
      return drawn.some(
        (solid) =>
          x >= solid.box[0] &&
          x <= solid.box[2] &&
          y >= solid.box[1] &&
          y <= solid.box[3] &&
          solid.hides(lens.eye, point),
      );
    };
    return { run, frame, since, solids, clouds, isHidden };
  }

  paintGround(brush, ground, isAbove) {
    const alpha = isAbove ? 1 : 0.6;
    brush.polygon(ground.outline, { fill: colours.ground, alpha });
    brush.lines(ground.grid, { stroke: colours.grid, alpha });
    brush.polygon(ground.outline, { stroke: colours.grid, width: 1.6, alpha });
  }

  paintShadows(brush, ground, scenes) {
    const { lens } = brush;
    const shadows = [];
    const cast = (points) => {
      const feet = points.map(ground.drop);
      if (feet.every((foot) => lens.depth(foot) >= lens.near)) {
        shadows.push(hull(feet.map(lens.project)));
      }
    };
    for (const { solids, clouds } of scenes) {
      for (const solid of solids.filter(({ isDrawn }) => isDrawn)) {
        cast(solid.radius === 0 ? solid.vertices : solid.vertices.flatMap((v) => disc(v, solid)));
      }
      for (const { corners } of clouds) if (corners.every(isFinitePoint)) cast(corners);
    }
    brush.union(shadows, { fill: colours.shadow, alpha: colours.isDark ? 0.45 : 0.28 });
  }

  // First what the bodies hide, then the bodies, then what lies before them.
  paintScenes(brush, scenes, show) {
    const [far, near] = [[], []];
    const lines = [];
    for (const scene of scenes) {
      const { run, frame, since, isHidden } = scene;
      const arrows = show.forces ? run.forces(frame, since) : [];
      for (const { partner, point, force } of arrows.filter(({ point }) => isFinitePoint(point))) {
        const among = isHidden(point) ? far : near;
        const arrow = run.arrow(force);
        among.push([point, add(point, arrow)]);
        // Between bodies each has its force.
        if (partner >= 0) among.push([point, subtract(point, arrow)]);
      }
      if (show.trail) {
        const stroke = isPair ? colours[run.index ? "run-b" : "run-a"] : colours.trail;
        lines.push({ ...this.trail(scene, show.body), line: { stroke, width: 1.6 } });
      }
    }
    for (const { ahead, hidden, line } of lines) {
      brush.lines(ahead, { ...line, alpha: 0.45, dash: [2, 4] });
      brush.lines(hidden, line);
    }
    // Of a heap, what is inside shows through.
    const paintFar = (alpha) => far.forEach(([a, b]) => brush.arrow(a, b, colours.force, alpha));
    if (!isCrowd) paintFar(1);
    for (const { run, clouds } of scenes) {
      for (const cloud of clouds) this.paintPoints(brush, run, cloud, show);
    }
    for (const solid of this.painted) this.paintSolid(brush, solid, show);
    for (const { seen, line } of lines) brush.lines(seen, line);
    if (isCrowd) paintFar(0.3);
    for (const [from, to] of near) brush.arrow(from, to, colours.force);
  }

  // How edges are drawn: those of the chosen body stand out.
  edges(body, show) {
    const isChosen = isCrowd && body === show.body;
    return { stroke: isChosen ? colours.chosen : colours.edge, width: isChosen ? 3 : 1.6 };
  }

  get alpha() {
    return this.members.length > 1 ? 0.6 : 1;
  }

  paintPoints(brush, run, { body, corners }, show) {
    const { lens } = brush;
    if (!corners.every((corner) => isFinitePoint(corner) && lens.depth(corner) >= lens.near)) return;
    const fill = shade(hueOf(run.index, body), 0.75);
    const edges = { ...this.edges(body, show), alpha: this.alpha };
    brush.flat(hull(corners.map(lens.project)), { fill, ...edges });
    for (const corner of corners) brush.dot(corner, 3.5, colours.edge);
  }

  paintSolid(brush, solid, show) {
    const { lens } = brush;
    const { run, body, radius, vertices } = solid;
    const hue = hueOf(run.index, body);
    const edges = this.edges(body, show);
    if (radius > 0) {
      if (solid.isNear) return;
      this.paintRound(brush, solid, hue, edges);
    }
    const seen = solid.sides.filter(({ normal, offset }) => dot(normal, lens.eye) > offset);
    const corners = seen.map(({ vertices: face, normal }) =>
      face.map((i) => (radius > 0 ? add(vertices[i], times(normal, radius)) : vertices[i])),
    );
    seen.forEach(({ normal }, i) => {
      brush.polygon(corners[i], { fill: shade(hue, lightOf(normal)), alpha: this.alpha });
    });
    if (radius === 0) for (const outline of corners) brush.polygon(outline, edges);
  }

  // What is round: its outline, lit from above, and of balls and capsules the circles that show
  // how they turn.
  paintRound(brush, solid, hue, edges) {
    const { lens } = brush;
    const { radius, vertices, spots, box } = solid;
    const { context } = brush;
    const fill = context.createLinearGradient(box[0], box[1], box[0], box[3]);
    for (const [at, light] of [
      [0, 0.98],
      [0.45, 0.62],
      [1, 0.34],
    ]) {
      fill.addColorStop(at, shade(hue, light));
    }
    if (vertices.length === 1) {
      context.beginPath();
      context.arc(...spots[0], lens.pixels(radius, vertices[0]), 0, 2 * Math.PI);
      Object.assign(context, { fillStyle: fill, strokeStyle: edges.stroke, lineWidth: edges.width });
      context.globalAlpha = this.alpha;
      context.fill();
      context.globalAlpha = 1;
      context.stroke();
    } else {
      brush.flat(solid.outline(lens), { fill, alpha: this.alpha });
      brush.flat(solid.outline(lens), edges);
    }
    if (solid.sides.length > 0) return;
    const line = { stroke: shade(hue, 0.12), width: 1.4 };
    for (const axis of [0, 2]) brush.lines(seenCircle(solid, axis, lens.eye), line);
  }

  // The way of the centre of mass: behind the body, before it, and still to come.
  trail({ run, frame, isHidden }, body) {
    const trail = { hidden: [], seen: [], ahead: [] };
    let from = run.position(0, body);
    let before = 0;
    for (const next of wayOf(run, body)) {
      const ends = before < frame && frame < next ? [frame, next] : [next];
      before = next;
      for (const end of ends) {
        const to = run.position(end, body);
        if (isFinitePoint(from) && isFinitePoint(to)) {
          const part = end > frame ? "ahead" : isHidden(between(from, to, 0.5)) ? "hidden" : "seen";
          trail[part].push([from, to]);
        }
        from = to;
      }
    }
    return trail;
  }

  // The body at a place of the picture; −1 where there is none.
  bodyAt(place) {
    for (const solid of [...(this.painted ?? [])].reverse()) {
      if (!solid.isNear && contains(solid.outline(this.lens), place)) return solid.body;
    }
    return -1;
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
