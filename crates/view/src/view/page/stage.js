// View of one or two runs in three.js: ground, shadows, bodies, forces and trails.

// Maximum device pixel ratio. Higher ratios cost time without visible benefit.
const MOST_PIXELS = 2;
// Depth offset of dots on surfaces, over the size of the smallest body.
const LIFT = 0.08;
const FRAME_COLOURS = ["#d9534f", "#3f9e5b", "#4a7fd0"];
// Length of the axes of a body's frame, over its size.
const ARM = 1.15;
// Half length of a joint axis, over the size of its body.
const JOINT_ARM = 0.22;

// Origin of all coordinates, since the graphics card has single precision.
const BASE = runs[0].origin;
const local = (point) => subtract(point, BASE);

class Stage {
  // `members` are the runs shown. A stage can take over the canvas of a `former` one.
  constructor(members, label, former = null) {
    this.members = members;
    this.former = former;
    this.canvas = former?.canvas ?? element("canvas", { tabindex: "0", role: "img" });
    this.canvas.setAttribute("aria-label", label);
    this.caption = element("figcaption");
    this.labels = new Labels();
    this.compass = new Compass();
    this.scale = new ForceScale();
    this.figure = element("figure", { class: "stage" });
    if (hasGraphics) {
      this.figure.append(this.canvas, this.labels.place, this.compass.picture, this.scale.picture, this.caption);
    } else {
      this.figure.append(...members.map(stillOf), this.caption);
      this.figure.classList.add("plain");
    }
    this.time = element("span", { class: "time" });
    this.caption.append(this.time);
    if (isPair) {
      for (const run of members) {
        const key = element("span", { class: "key" }, run.name);
        key.style.setProperty("--colour", run.index ? "var(--run-b)" : "var(--run-a)");
        this.caption.append(key);
      }
    }
    this.remark = element("span", { class: "remark" });
    this.caption.append(this.remark);
    this.terrain = terrainRemarks(members[0]);
    this.isStale = true;
  }

  // Remarks on content that the picture does not show.
  remarks(time, show) {
    if (!hasGraphics) return "this browser has no WebGL: the picture stands still at the start";
    const notes = [...this.terrain];
    const planes = new Set(this.members.map((run) => JSON.stringify(run.data.ground)));
    if (planes.size > 1) {
      const { name, data } = this.members[0];
      notes.push(data.ground ? `the ground is that of ${name}` : `${name} has no ground to show`);
    }
    const ended = this.members.filter((run) => run.count > 1 && run.frame(time) === run.count - 1);
    if (show.forces && ended.length > 0) {
      const isPart = ended.length < this.members.length;
      notes.push(`${isPart ? `${ended[0].name}: ` : ""}forces of the last step`);
    }
    return notes.join("; ");
  }

  get size() {
    const { clientWidth, clientHeight } = hasGraphics ? this.canvas : this.figure;
    return [clientWidth, clientHeight];
  }

  // True if the last picture has the size displayed.
  get isFitting() {
    return this.paintedSize === String(this.size);
  }

  // Creates all three.js objects, at first use.
  prepare() {
    this.renderer = this.former?.renderer ?? this.newRenderer();
    this.former = null;
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = THREE.PCFShadowMap;
    this.scene = new THREE.Scene();
    this.eye = new THREE.PerspectiveCamera();
    this.eye.up.set(...UP);
    this.light = new Light(this.scene);
    const reaches = this.members.flatMap((run) => run.reaches).sort((a, b) => a - b);
    this.ambience = new Ambience(reaches[reaches.length >> 1]);
    this.outline = new Outline();
    const ground = grounds[this.members[0].index];
    this.floor = ground && new Floor(ground, this.ambience);
    if (this.floor) {
      this.scene.add(this.floor.plane);
      this.ambience.add(this.floor.plane);
    }
    this.prepareActors();
    this.prepareOverlays();
  }

  newRenderer() {
    const context = this.canvas.getContext("webgl2", {
      antialias: true,
      // Needed to save the picture from the browser's menu.
      preserveDrawingBuffer: true,
    });
    return new THREE.WebGLRenderer({ canvas: this.canvas, context });
  }

  // Bodies, fixed objects and trails of each run.
  prepareActors() {
    const alpha = this.members.length > 1 ? 0.6 : 1;
    this.actors = this.members.map((run) => {
      const { fixed } = run.data;
      const actor = {
        run,
        bodies: new Solids(run.bodies, alpha, this.ambience),
        collision: new Solids(run.hasCollision ? run.bodies.map(touching) : [], alpha, this.ambience),
        fixed: new Solids(fixed, 1, this.ambience, contourStep(run)),
        faded: new Solids(fixed, 0.22, this.ambience),
        edge: new Lines(),
        bones: run.bodies.map((_, body) => run.data.bones.filter((bone) => bone.body === body)),
        joints: run.bodies.map((_, body) => run.data.joints.filter((joint) => joint.body === body)),
        // Balls around the fixed objects.
        balls: fixed.map(({ span }) => {
          const place = local(times(span.reduce(add), 1 / span.length));
          return { place, reach: largest(span.map((at) => length(subtract(local(at), place)))) };
        }),
        behind: new Lines(),
        ahead: new Lines(),
        rods: new Lines(),
      };
      actor.faded.material.depthWrite = false;
      for (const mesh of actor.faded.meshes) mesh.castShadow = false;
      const ofBodies = [...actor.bodies.meshes, ...actor.collision.meshes];
      for (const mesh of [...ofBodies, ...actor.fixed.meshes]) this.ambience.add(mesh);
      for (const mesh of ofBodies) this.outline.add(mesh);
      const solids = [...ofBodies, ...actor.fixed.meshes, ...actor.faded.meshes];
      this.scene.add(...solids, actor.behind, actor.ahead, actor.rods, actor.edge);
      return actor;
    });
  }

  prepareOverlays() {
    const clouds = this.members.some((run) => run.bodies.some(({ pieces }) => pieces.length === 0));
    this.points = clouds ? new Dots() : null;
    this.arms = clouds ? new Lines() : null;
    if (clouds) this.scene.add(this.points, this.arms);
    // Hidden overlays are faint.
    this.arrows = { hidden: [new Arrows()], seen: [new Arrows(), new Arrows()], ofJoints: [new Arrows(), new Arrows()] };
    this.contacts = { hidden: new Dots().through(), seen: new Dots().through() };
    this.cones = new Cones();
    this.arcs = new Lines().through();
    this.fading = this.members.map(() => new FadingForces());
    this.frames = FRAME_COLOURS.map(() => new Lines().through());
    this.joints = { axes: new Lines().through(), anchors: new Dots().through() };
    const { arrows, contacts, frames } = this;
    const { axes, anchors } = this.joints;
    const { hidden, seen, ofJoints } = arrows;
    const overlays = [hidden, contacts.hidden, axes, anchors, ofJoints, this.arcs, seen, contacts.seen, frames].flat();
    overlays.forEach((overlay, i) => {
      overlay.renderOrder = 10 + i;
      this.scene.add(overlay);
    });
    this.scene.add(this.cones.group);
  }

  // Sets the colours of the page and of the bodies, and which are `marked` with an outline.
  recolour(marked) {
    this.marked = marked;
    const outlined = new Set(marked);
    this.floor?.recolour();
    this.outline.recolour();
    this.cones.recolour();
    for (const { run, bodies, collision, fixed, faded, behind, ahead, rods, edge } of this.actors) {
      for (const part of [bodies, collision]) part.paint((body) => hueOf(run, body), (body) => outlined.has(body));
      for (const part of [fixed, faded]) part.paint(() => colours.still, () => false);
      const colour = isPair ? colours[run.index ? "run-b" : "run-a"] : colours.trail;
      behind.look({ colour, width: 1.8 });
      ahead.look({ colour, width: 1.3, alpha: 0.6 });
      rods.look({ colour: colours.faint, width: 3 });
      edge.look({ colour: colours.trail, width: 2 });
    }
    this.points?.look({ colour: colours.joint, rim: colours.joint, width: 7 });
    this.arms?.look({ colour: colours.faint, width: 2 });
    // Arrows of many bodies are thinner.
    const count = this.members.reduce((sum, run) => sum + run.bodies.length, 0);
    const width = 2.6 - 0.17 * Math.log2(count);
    this.arcs.look({ colour: colours.force, width: 2 });
    this.arrows.hidden[0].look({ colour: colours.force, width, alpha: 0.25 });
    for (const [among, name] of [["seen", "force"], ["ofJoints", "joint-force"]]) {
      const [seam, arrow] = this.arrows[among];
      seam.look({ colour: colours.seam, width, seam: 1, alpha: 0.75 });
      arrow.look({ colour: colours[name], width });
    }
    const ring = { colour: colours.seam, rim: colours.force, width: 8 };
    this.contacts.hidden.look({ ...ring, alpha: 0.3 });
    this.contacts.seen.look(ring);
    this.joints.axes.look({ colour: colours.joint, width: 2 });
    this.joints.anchors.look({ colour: colours.seam, rim: colours.joint, width: 7 });
    this.frames.forEach((lines, axis) => lines.look({ colour: FRAME_COLOURS[axis], width: 2.2 }));
    this.isStale = false;
  }

  // Paints the state at `time`, with mean forces since `before`. The mean makes an impact of one
  // step visible in any frame. `detail` is one of DETAILS.
  paint(camera, time, before, show, detail) {
    put(this.remark, this.remarks(time, show));
    put(this.time, `t = ${clock(time)} s`);
    const [width, height] = this.size;
    this.paintedSize = String([width, height]);
    if (!hasGraphics || width === 0 || height === 0) return;
    if (!this.renderer) this.prepare();
    const marked = show.marked ?? show.chosen;
    if (this.isStale || String(this.marked) !== String(marked)) this.recolour(marked);
    this.resize(width, height, detail);
    this.aim(camera, time, show, width, height);
    const occluders = new Occluders();
    const drawn = this.paintBodies(time, show, occluders);
    this.paintForces(time, before, show, occluders);
    this.light.castShadows(drawn, this.actors.flatMap(({ balls }) => balls), this.floor);
    const isAbove = this.floor?.look(this.eye.position.toArray()) ?? true;
    this.light.sun.castShadow = isAbove && detail.shadows;
    this.render(isAbove && detail.ambience);
    this.compass.turn(camera);
    this.write(time, show);
  }

  render(hasAmbience) {
    const { renderer, eye } = this;
    const { width, height } = this.canvas;
    if (hasAmbience) this.ambience.render(renderer, eye, width, height);
    else this.ambience.skip();
    renderer.setClearColor(colours.sky, 1);
    renderer.render(this.scene, eye);
    if (this.marked.length > 0) this.outline.render(renderer, eye, width, height, this.ratio);
  }

  // Places bodies, fixed objects, trails and joints. Returns what casts shadows.
  paintBodies(time, show, occluders) {
    const framed = FRAME_COLOURS.map(() => []);
    const drawn = [];
    const cloud = { dots: [], arms: [] };
    const tied = { anchors: [], axes: [] };
    for (const actor of this.actors) {
      const { run } = actor;
      const frame = run.frame(time);
      const rods = [];
      const poses = run.bodies.map((_, body) => {
        const place = local(run.position(frame, body));
        const attitude = run.attitude(frame, body);
        return isFinitePoint(place) && isFinitePoint(attitude) ? { place, attitude } : null;
      });
      const hidden = poses.map(() => null);
      const showsCollision = show.collision && run.hasCollision;
      actor.bodies.place(showsCollision ? hidden : poses);
      actor.collision.place(showsCollision ? poses : hidden);
      poses.forEach((pose, body) => {
        if (pose === null) return;
        drawn.push({ ...pose, reach: run.reaches[body] });
        occluders.add(run.bodies[body].pieces, pose, run, body);
        if (run.bodies[body].pieces.length === 0) addCloud(cloud, run.bodies[body].points, pose);
        if (show.frames) addFrame(framed, pose, ARM * run.reaches[body]);
        addBones(rods, actor.bones[body], pose);
        if (show.joints) addJoints(tied, actor.joints[body], pose, JOINT_ARM * run.reaches[body]);
      });
      actor.rods.set(rods);
      this.placeFixed(actor, show, occluders);
      const [behind, ahead] = [[], []];
      for (const body of show.trail ? tracked() : []) {
        const here = local(run.position(frame, body));
        splitTrail(trailOf(run, body, BASE), frame, here, behind, ahead);
      }
      actor.behind.set(behind);
      actor.ahead.set(ahead);
    }
    this.points?.set(cloud.dots);
    this.arms?.set(cloud.arms);
    this.frames.forEach((lines, axis) => lines.set(framed[axis]));
    this.joints.anchors.set(tied.anchors);
    this.joints.axes.set(tied.axes);
    return drawn;
  }

  // Sets arrows, contact points and friction cones.
  paintForces(time, before, show, occluders) {
    const forces = { hidden: [], seen: [], ofJoints: [] };
    this.sizes = [];
    const touched = { hidden: [], seen: [] };
    const [cones, arcs] = [[], []];
    const eye = this.eye.position.toArray();
    const isWanted = show.forces || show.contacts || show.cones;
    this.actors.forEach(({ run }, i) => {
      if (!isWanted) return;
      const frame = run.forceFrame(time);
      const since = Math.min(run.frame(before), frame - 1);
      const found = shownForces(run, run.forces(frame, since), show);
      const ofJoints = show.joints ? shownForces(run, run.forcesOfJoints(frame, since), show) : [];
      const drawn = (show.points ? found : resultants(found)).concat(ofJoints);
      if (!isPlaying) this.fading[i].clear();
      const isTested = found.length * occluders.pieces.length <= run.mostTests;
      const hides = (one, at, through) =>
        isTested && occluders.hides(eye, at, run.reaches[one.body], through, run) ? "hidden" : "seen";
      const fading = this.fading[i].update(drawn, performance.now() / 1000);
      for (const one of show.forces ? (isPlaying ? fading : drawn) : []) {
        const at = local(one.point);
        // A resultant is inside its face and is seen through both bodies.
        const bodies = show.points ? [] : [one.body, one.partner].filter((body) => body >= 0);
        const among = one.isOfJoint ? "ofJoints" : hides(one, at, bodies);
        addArrows(run, one, at, one.share ?? 1, show.chosen, forces[among]);
        if (show.values && among !== "hidden") this.sizes.push({ ...one, tip: add(at, run.arrow(one.force)) });
        addArc(run, one, at, arcs);
      }
      for (const one of show.contacts || show.cones ? found : []) {
        const at = local(one.point);
        touched[hides(one, at, [])].push(...at);
        if (show.cones) cones.push(coneOf(run, one, at));
      }
    });
    for (const among of ["hidden", "seen", "ofJoints"]) {
      for (const overlay of this.arrows[among]) overlay.set(forces[among]);
    }
    for (const among of ["hidden", "seen"]) {
      this.contacts[among].set(show.contacts ? touched[among] : []);
    }
    this.cones.set(cones);
    this.arcs.set(arcs);
  }

  resize(width, height, { share }) {
    const ratio = share * Math.min(MOST_PIXELS, window.devicePixelRatio || 1);
    if (this.drawnSize === `${width} ${height} ${ratio}`) return;
    this.drawnSize = `${width} ${height} ${ratio}`;
    this.ratio = ratio;
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(width, height, false);
    for (const { bodies, collision, fixed, faded } of this.actors) {
      for (const { material } of [bodies, collision, fixed, faded]) material.userData.ratio.value = ratio;
    }
  }

  // Copies the camera to three.js.
  aim(camera, time, show, width, height) {
    const shift = this.followed(time, show);
    const { eye } = this;
    this.upward = axesOf(camera)[1];
    eye.position.set(...local(camera.eye(shift)));
    eye.lookAt(...local(add(camera.target, shift)));
    const short = Math.min(width, height);
    const pixels = (0.5 * short) / (HALF_VIEW * camera.distance);
    for (const run of this.members) run.longest = longestArrow(run, pixels);
    this.scale.show(this.members[0], pixels, width, show.forces);
    eye.fov = (2 * Math.atan((HALF_VIEW * height) / short) * 180) / Math.PI;
    eye.aspect = width / height;
    eye.near = NEAR * camera.distance;
    const far = farthest(camera.eye(shift));
    eye.far = Math.max(2 * camera.distance, 1.05 * far);
    eye.updateProjectionMatrix();
    eye.updateMatrixWorld();
    const lift = LIFT * smallest(this.members.map((run) => run.smallestReach));
    this.scene.traverse((part) => {
      if (!(part instanceof Overlay)) return;
      const { uniforms } = part.material;
      uniforms.halfSize.value = [width / 2, height / 2];
      uniforms.nearest.value = eye.near;
      if (uniforms.lift) uniforms.lift.value = lift;
    });
  }

  // Shift of the view that keeps the chosen bodies centred.
  followed(time, show) {
    if (!show.follow) return [0, 0, 0];
    const shift = subtract(middleOf(this.members, time, show.chosen), show.anchor);
    return isFinitePoint(shift) ? shift : [0, 0, 0];
  }

  placeFixed({ run, fixed, faded, edge }, show, occluders) {
    const still = { place: local([0, 0, 0]), attitude: [1, 0, 0, 0] };
    const poses = (wanted) =>
      run.data.fixed.map(({ name }) => ((show.fixed.get(name) ?? "shown") === wanted ? still : null));
    const shown = poses("shown");
    shown.forEach((pose, i) => pose && occluders.add(run.data.fixed[i].pieces, pose, run, -2 - i));
    fixed.place(shown);
    edge.set(shown.flatMap((pose, i) => (pose ? edgesOf(run.data.fixed[i]) : [])));
    faded.place(poses("faded"));
  }

  // Writes names at the chosen bodies and at those with labels, or at all.
  write(time, show) {
    const [run] = this.members;
    const frame = run.frame(time);
    const isNamed = (body) =>
      (isCrowd && (show.names || show.chosen.includes(body))) || run.bodies[body].is_labelled;
    const [width, height] = this.size;
    const named = run.bodies.map((_, body) => body).filter(isNamed).slice(0, MOST_NAMES);
    const names = named.map((body) => {
      const place = local(run.position(frame, body));
      const spot = new THREE.Vector3(...place).project(this.eye);
      // Above the body in the picture.
      const above = add(place, times(this.upward, run.reaches[body]));
      const top = new THREE.Vector3(...above).project(this.eye);
      const [x, y] = [0.5 * (1 + spot.x) * width, 0.5 * (1 - top.y) * height];
      const isChosen = show.chosen.includes(body);
      return { body, text: run.bodies[body].name, isChosen, x, y, distance: spot.z };
    });
    // Sizes of the forces at the tips of their arrows.
    const values = this.sizes.map(({ site, force, tip }) => {
      const spot = new THREE.Vector3(...tip).project(this.eye);
      const [x, y] = [0.5 * (1 + spot.x) * width, 0.5 * (1 - spot.y) * height];
      return { body: `force ${site}`, text: `${number(length(force), 3)} N`, isChosen: false, x, y, distance: spot.z };
    });
    const isSeen = ({ x, y, distance }) => isFinitePoint([x, y, distance]) && Math.abs(distance) <= 1;
    this.labels.show([...names, ...values].filter(isSeen), [width, height]);
  }

  // Index of the body at a picture position; −1 if there is none.
  bodyAt([x, y]) {
    if (!this.renderer) return -1;
    const [width, height] = this.size;
    const ray = new THREE.Raycaster();
    ray.setFromCamera({ x: (2 * x) / width - 1, y: 1 - (2 * y) / height }, this.eye);
    const hits = this.actors.flatMap(({ bodies, collision, fixed }) => {
      const still = fixed.hit(ray);
      return [bodies.hit(ray), collision.hit(ray), still && { ...still, thing: -1 }];
    });
    const found = hits.filter((hit) => hit !== null);
    return found.sort((a, b) => a.distance - b.distance)[0]?.thing ?? -1;
  }
}

// Heights of the terrain of a run and of its contour lines.
function terrainRemarks(run) {
  const step = contourStep(run);
  if (step === 0) return [];
  const [low, high] = relief(run).map((height) => number(height, 3));
  return [`terrain from z = ${low} to ${high} m, contour lines every ${step} m`];
}

// A body with the pieces that touch others.
const touching = ({ collision, pieces }) => ({ pieces: collision.length > 0 ? collision : pieces });

// Centre of the chosen bodies of some runs, or of all bodies if none is chosen.
function middleOf(members, time, chosen) {
  const all = members.flatMap((run) => {
    const bodies = chosen.length > 0 ? chosen : run.bodies.map((_, body) => body);
    return bodies.map((body) => run.position(run.frame(time), body)).filter(isFinitePoint);
  });
  return times(all.reduce(add, [0, 0, 0]), 1 / all.length);
}

// Largest distance of the scene from a point.
const rims = grounds.filter(Boolean).flatMap(({ axes, middle, radius }) =>
  [-radius, radius].flatMap((x) => [-radius, radius].map((y) => add(middle, add(times(axes[0], x), times(axes[1], y))))),
);
const inScene = [BASE].concat(places, rims);
const bounds = [0, 1, 2].map((axis) => extremes(inScene.map((point) => point[axis])));
const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((i) => bounds.map((ends, axis) => ends[(i >> axis) & 1]));
const farthest = (from) => largest(corners.map((corner) => length(subtract(corner, from))));
