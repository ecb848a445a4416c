// View of one or two runs in three.js: ground, shadows, bodies, forces and trails.

const SHADOW_PIXELS = 2048;
// Maximum device pixel ratio. Higher ratios cost time without visible benefit.
const MOST_PIXELS = 2;
// Depth offset of dots on surfaces, over the size of the smallest body.
const LIFT = 0.08;
const FRAME_COLOURS = ["#e0433a", "#2f9e44", "#2f6fe0"];
// Length of the axes of a body's frame, over its size.
const ARM = 1.15;
// Half length of a joint axis, over the size of its body.
const JOINT_ARM = 0.3;
// Maximum number of names shown.
const MOST_NAMES = 150;

// Origin of all coordinates, since the graphics card has single precision.
const BASE = runs[0].origin;
const local = (point) => subtract(point, BASE);

// True if WebGL is available, tested once on a separate canvas.
const hasGraphics = document.createElement("canvas").getContext("webgl2") !== null;

class Stage {
  // `members` are the runs shown.
  constructor(members, label) {
    this.members = members;
    this.canvas = element("canvas", { tabindex: "0", role: "img", "aria-label": label });
    this.caption = element("figcaption");
    this.names = element("div", { class: "names", "aria-hidden": "true" });
    this.compass = new Compass();
    this.figure = element("figure", { class: "stage" });
    if (hasGraphics) this.figure.append(this.canvas, this.names, this.compass.picture, this.caption);
    else {
      this.figure.append(...members.map(stillOf), this.caption);
      this.figure.classList.add("plain");
    }
    if (isPair) {
      for (const run of members) {
        const key = element("span", { class: "key" }, run.name);
        key.style.setProperty("--colour", run.index ? "var(--run-b)" : "var(--run-a)");
        this.caption.append(key);
      }
    }
    this.remark = element("span", { class: "remark" });
    this.caption.append(this.remark);
    this.isStale = true;
  }

  // Remarks on content that the picture does not show.
  remarks(time, show) {
    if (!hasGraphics) return "this browser has no WebGL: the picture stands still at the start";
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
    const { clientWidth, clientHeight } = hasGraphics ? this.canvas : this.figure;
    return [clientWidth, clientHeight];
  }

  // Creates all three.js objects, at first use.
  prepare() {
    const context = this.canvas.getContext("webgl2", {
      antialias: true,
      // Needed to save the picture from the browser's menu.
      preserveDrawingBuffer: true,
    });
    this.renderer = new THREE.WebGLRenderer({ canvas: this.canvas, context });
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = THREE.PCFShadowMap;
    this.scene = new THREE.Scene();
    this.eye = new THREE.PerspectiveCamera();
    this.eye.up.set(...UP);
    this.sun = new THREE.DirectionalLight("#ffffff", 2.0);
    this.sun.castShadow = true;
    this.sun.shadow.mapSize.set(SHADOW_PIXELS, SHADOW_PIXELS);
    this.sun.shadow.radius = 2.5;
    this.sky = new THREE.HemisphereLight("#ffffff", "#a9b2be", 1.9);
    this.sky.position.set(...UP);
    this.scene.add(this.sun, this.sun.target, this.sky);
    this.floor = grounds[this.members[0].index] && new Floor(grounds[this.members[0].index]);
    if (this.floor) this.scene.add(...this.floor.parts);
    const alpha = this.members.length > 1 ? 0.6 : 1;
    this.actors = this.members.map((run) => {
      const { fixed } = run.data;
      const actor = {
        run,
        bodies: new Solids(run.bodies, alpha),
        fixed: new Solids(fixed, 1),
        faded: new Solids(fixed, 0.22),
        behind: new Lines(),
        ahead: new Lines(),
      };
      actor.faded.material.depthWrite = false;
      for (const mesh of actor.faded.meshes) mesh.castShadow = false;
      const solids = [actor.bodies, actor.fixed, actor.faded].flatMap(({ meshes }) => meshes);
      for (const mesh of solids) this.scene.add(mesh);
      this.scene.add(actor.behind, actor.ahead);
      return actor;
    });
    const clouds = this.members.some((run) => run.bodies.some(({ pieces }) => pieces.length === 0));
    this.points = clouds ? new Dots() : null;
    this.arms = clouds ? new Lines() : null;
    if (clouds) this.scene.add(this.points, this.arms);
    // Hidden overlays are faint.
    this.arrows = { hidden: [new Arrows()], seen: [new Arrows(), new Arrows()] };
    this.contacts = { hidden: new Dots().through(), seen: new Dots().through() };
    this.frames = FRAME_COLOURS.map(() => new Lines().through());
    this.joints = { axes: new Lines().through(), anchors: new Dots().through() };
    const { arrows, contacts, frames } = this;
    const { axes, anchors } = this.joints;
    const overlays = [arrows.hidden, contacts.hidden, axes, anchors, arrows.seen, contacts.seen, frames].flat();
    overlays.forEach((overlay, i) => {
      overlay.renderOrder = 10 + i;
      this.scene.add(overlay);
    });
  }

  // Sets the colours of the page and of the bodies.
  recolour(show) {
    const chosen = new Set(isCrowd ? show.chosen : []);
    this.renderer.setClearColor(colours.sky);
    this.floor?.recolour();
    for (const { run, bodies, fixed, faded, behind, ahead } of this.actors) {
      bodies.paint((body) => hueOf(run, body), (body) => chosen.has(body));
      for (const part of [fixed, faded]) part.paint(() => HUES[STILL_HUE], () => false);
      const colour = isPair ? colours[run.index ? "run-b" : "run-a"] : colours.trail;
      behind.look({ colour, width: 1.8 });
      ahead.look({ colour, width: 1.3, alpha: 0.6 });
    }
    this.points?.look({ colour: colours.edge, rim: colours.edge, width: 7 });
    this.arms?.look({ colour: colours.faint, width: 2 });
    const [seam, seen] = this.arrows.seen;
    this.arrows.hidden[0].look({ colour: colours.force, width: 2.8, alpha: 0.5 });
    seam.look({ colour: colours.seam, width: 2.8, seam: 1.1 });
    seen.look({ colour: colours.force, width: 2.8 });
    const ring = { colour: colours.sky, rim: colours.force, width: 8 };
    this.contacts.hidden.look({ ...ring, alpha: 0.3 });
    this.contacts.seen.look(ring);
    this.joints.axes.look({ colour: colours.edge, width: 2.4 });
    this.joints.anchors.look({ colour: colours.sky, rim: colours.edge, width: 9 });
    this.frames.forEach((lines, axis) => lines.look({ colour: FRAME_COLOURS[axis], width: 2.2 }));
    this.isStale = false;
  }

  // Paints the state at `time`, with mean forces since `before`. The mean makes an impact of one
  // step visible in any frame. `detail` is one of DETAILS.
  paint(camera, time, before, show, detail) {
    put(this.remark, this.remarks(time, show));
    const [width, height] = this.size;
    if (!hasGraphics || width === 0 || height === 0) return;
    if (!this.renderer) this.prepare();
    if (this.isStale) this.recolour(show);
    this.resize(width, height, detail);
    this.aim(camera, time, show, width, height);
    const forces = { hidden: [], seen: [] };
    const touched = { hidden: [], seen: [] };
    const occluders = new Occluders();
    const eye = this.eye.position.toArray();
    const framed = FRAME_COLOURS.map(() => []);
    const drawn = [];
    const cloud = { dots: [], arms: [] };
    const tied = { anchors: [], axes: [] };
    for (const actor of this.actors) {
      const { run } = actor;
      const frame = run.frame(time);
      const poses = run.bodies.map((_, body) => {
        const place = local(run.position(frame, body));
        const attitude = run.attitude(frame, body);
        return isFinitePoint(place) && isFinitePoint(attitude) ? { place, attitude } : null;
      });
      actor.bodies.place(poses);
      poses.forEach((pose, body) => {
        if (pose === null) return;
        drawn.push({ ...pose, reach: run.reaches[body] });
        occluders.add(run.bodies[body].pieces, pose);
        if (run.bodies[body].pieces.length === 0) addCloud(cloud, run.bodies[body].points, pose);
        if (show.frames) addFrame(framed, pose, ARM * run.reaches[body]);
        const joints = show.joints ? run.data.joints.filter((joint) => joint.body === body) : [];
        addJoints(tied, joints, pose, JOINT_ARM * run.reaches[body]);
      });
      this.placeFixed(actor, show, occluders);
      const [behind, ahead] = [[], []];
      if (show.trail) {
        for (const body of show.chosen) {
          const here = local(run.position(frame, body));
          splitTrail(trailOf(run, body, BASE), frame, here, behind, ahead);
        }
      }
      actor.behind.set(behind);
      actor.ahead.set(ahead);
    }
    if (show.forces || show.contacts) {
      for (const { run } of this.actors) {
        const frame = run.frame(time);
        const since = Math.min(run.frame(before), frame - 1);
        for (const one of shownForces(run, frame, since, show)) {
          const at = local(one.point);
          const isHidden = occluders.hides(eye, at, run.reaches[one.body]);
          const among = isHidden ? "hidden" : "seen";
          touched[among].push(...at);
          if (show.forces) addArrows(run, one, at, forces[among]);
        }
      }
    }
    this.points?.set(cloud.dots);
    this.arms?.set(cloud.arms);
    for (const among of ["hidden", "seen"]) {
      for (const overlay of this.arrows[among]) overlay.set(forces[among]);
      this.contacts[among].set(show.contacts ? touched[among] : []);
    }
    this.frames.forEach((lines, axis) => lines.set(framed[axis]));
    this.joints.anchors.set(tied.anchors);
    this.joints.axes.set(tied.axes);
    this.castShadows(drawn);
    const isAbove = this.floor?.look(eye) ?? true;
    this.sun.castShadow = isAbove && detail.shadows;
    this.renderer.render(this.scene, this.eye);
    this.compass.turn(camera);
    this.write(time, show);
  }

  resize(width, height, { share }) {
    const ratio = share * Math.min(MOST_PIXELS, window.devicePixelRatio || 1);
    if (this.drawnSize === `${width} ${height} ${ratio}`) return;
    this.drawnSize = `${width} ${height} ${ratio}`;
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(width, height, false);
    for (const { bodies, fixed, faded } of this.actors) {
      for (const { material } of [bodies, fixed, faded]) material.userData.ratio.value = ratio;
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

  placeFixed({ run, fixed, faded }, show, occluders) {
    const still = { place: local([0, 0, 0]), attitude: [1, 0, 0, 0] };
    const poses = (wanted) =>
      run.data.fixed.map(({ name }) => ((show.fixed.get(name) ?? "shown") === wanted ? still : null));
    const shown = poses("shown");
    shown.forEach((pose, i) => pose && occluders.add(run.data.fixed[i].pieces, pose));
    fixed.place(shown);
    faded.place(poses("faded"));
  }

  // Fits the shadow map to a ball around all bodies. Its position and size change in steps, which
  // prevents flicker.
  castShadows(drawn) {
    if (drawn.length === 0) return;
    const middle = times(drawn.map(({ place }) => place).reduce(add), 1 / drawn.length);
    const reach = largest(drawn.map(({ place, reach }) => length(subtract(place, middle)) + reach));
    const size = 1.2 ** Math.ceil(Math.log(Math.max(reach, 1e-9)) / Math.log(1.2));
    const texel = (2 * size) / SHADOW_PIXELS;
    const across = unit(cross(LIGHT, [0, 1, 0]));
    const axes = [across, cross(LIGHT, across), LIGHT];
    const snapped = axes.map((axis, k) =>
      times(axis, k < 2 ? Math.round(dot(axis, middle) / texel) * texel : dot(axis, middle)),
    );
    const target = snapped.reduce(add);
    const height = this.floor ? Math.abs(this.floor.ground.height(add(target, BASE))) : 0;
    this.sun.target.position.set(...target);
    this.sun.position.set(...add(target, times(LIGHT, 2 * size)));
    const { shadow } = this.sun;
    Object.assign(shadow.camera, { left: -size, right: size, bottom: -size, top: size });
    Object.assign(shadow.camera, { near: 0.5 * size, far: 4 * size + 3 * height });
    shadow.camera.updateProjectionMatrix();
    shadow.normalBias = 1.5 * texel;
    shadow.bias = -(2 * texel) / shadow.camera.far;
  }

  // Writes names at the chosen bodies, or at all.
  write(time, show) {
    const [run] = this.members;
    const shown = !isCrowd
      ? []
      : show.names
        ? run.bodies.map((_, body) => body).slice(0, MOST_NAMES)
        : show.chosen;
    while (this.names.children.length < shown.length) this.names.append(element("span"));
    while (this.names.children.length > shown.length) this.names.lastChild.remove();
    const [width, height] = this.size;
    shown.forEach((body, i) => {
      const label = this.names.children[i];
      const place = local(run.position(run.frame(time), body));
      const spot = new THREE.Vector3(...place).project(this.eye);
      label.hidden = !isFinitePoint(place) || Math.abs(spot.z) > 1;
      put(label, run.bodies[body].name);
      label.classList.toggle("chosen", show.chosen.includes(body));
      // Above the body in the picture.
      const top = new THREE.Vector3(...add(place, times(this.upward, run.reaches[body]))).project(this.eye);
      const [x, y] = [0.5 * (1 + spot.x) * width, 0.5 * (1 - top.y) * height];
      label.style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px) translate(-50%, -100%)`;
    });
  }

  // Index of the body at a picture position; −1 if there is none.
  bodyAt([x, y]) {
    if (!this.renderer) return -1;
    const [width, height] = this.size;
    const ray = new THREE.Raycaster();
    ray.setFromCamera({ x: (2 * x) / width - 1, y: 1 - (2 * y) / height }, this.eye);
    const hits = this.actors.flatMap(({ bodies, fixed }) => {
      const still = fixed.hit(ray);
      return [bodies.hit(ray), still && { ...still, thing: -1 }];
    });
    const found = hits.filter((hit) => hit !== null);
    return found.sort((a, b) => a.distance - b.distance)[0]?.thing ?? -1;
  }
}

// Centre of the chosen bodies of some runs.
function middleOf(members, time, chosen) {
  const all = members.flatMap((run) =>
    chosen.map((body) => run.position(run.frame(time), body)).filter(isFinitePoint),
  );
  return times(all.reduce(add, [0, 0, 0]), 1 / all.length);
}

// Largest distance of the scene from a point.
const inScene = [BASE].concat(places, feet);
const bounds = [0, 1, 2].map((axis) => extremes(inScene.map((point) => point[axis])));
const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((i) => bounds.map((ends, axis) => ends[(i >> axis) & 1]));
const farthest = (from) => largest(corners.map((corner) => length(subtract(corner, from))));
