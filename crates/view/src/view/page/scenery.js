// Floor and compass, and the overlays of bodies: forces, frames, joints and contact points.

// Ground with grid and shadows.
class Floor {
  constructor(ground) {
    this.ground = ground;
    const outline = ground.outline.map(local);
    const geometry = new THREE.BufferGeometry();
    const normals = outline.flatMap(() => ground.normal);
    const places = new THREE.Float32BufferAttribute(outline.flat(), 3);
    geometry.setAttribute("position", places);
    geometry.setAttribute("normal", new THREE.Float32BufferAttribute(normals, 3));
    // The axes of the ground may be left-handed.
    const [a, b, , d] = outline;
    const isTurned = dot(cross(subtract(b, a), subtract(d, a)), ground.normal) < 0;
    geometry.setIndex(isTurned ? [0, 2, 1, 0, 3, 2] : [0, 1, 2, 0, 2, 3]);
    const back = { polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 2 };
    this.plane = new THREE.Mesh(
      geometry,
      new THREE.MeshBasicMaterial({ side: THREE.DoubleSide, transparent: true, ...back }),
    );
    this.shade = new THREE.Mesh(geometry, new THREE.ShadowMaterial(back));
    this.shade.material.depthWrite = false;
    this.shade.receiveShadow = true;
    this.lines = new Lines();
    this.lines.set(ground.grid.flatMap(([from, to]) => [...local(from), ...local(to)]));
    this.rim = new Lines();
    this.rim.set(outline.flatMap((from, i) => [...from, ...outline[(i + 1) % 4]]));
    this.parts = [this.plane, this.shade, this.lines, this.rim];
    this.parts.forEach((part, i) => (part.renderOrder = i - 10));
  }

  recolour() {
    this.plane.material.color.set(colours.ground);
    this.shade.material.color.set(colours.shadow);
    this.shade.material.opacity = colours.isDark ? 0.55 : 0.34;
    this.lines.look({ colour: colours.grid, width: 1 });
    this.rim.look({ colour: colours.grid, width: 1.6 });
  }

  // Makes the ground transparent from below. Returns true if the eye is above it.
  look(eye) {
    const isAbove = this.ground.height(add(eye, BASE)) > 0;
    const { material } = this.plane;
    material.opacity = isAbove ? 1 : 0.6;
    material.depthWrite = isAbove;
    this.shade.visible = isAbove;
    // Seen from below, the scene is drawn before the ground.
    this.parts.forEach((part, i) => (part.renderOrder = isAbove ? i - 10 : i + 5));
    return isAbove;
  }
}

// Contacts of a frame whose forces are shown.
function shownForces(run, frame, since, show) {
  const { weight } = run.data.arrows;
  return run.forces(frame, since).filter(({ body, partner, point, force }) => {
    const isChosen = show.chosen.includes(body) || show.chosen.includes(partner);
    const size = length(force);
    return (!show.only || isChosen) && size > 0 && size >= show.least * weight && isFinitePoint(point);
  });
}

// Adds the arrows of a contact. A contact between bodies has one for each of them.
function addArrows(run, { partner, force }, at, arrows) {
  const arrow = run.arrow(force);
  arrows.push(...at, ...arrow);
  if (partner >= 0) arrows.push(...at, ...times(arrow, -1));
}

// Adds the joints of a body: anchors, and axes to both sides.
function addJoints({ anchors, axes }, joints, { place, attitude }, arm) {
  for (const { anchor, axis } of joints) {
    const at = add(place, rotate(attitude, anchor));
    anchors.push(...at);
    if (axis === null) continue;
    const way = times(rotate(attitude, axis), arm);
    axes.push(...subtract(at, way), ...add(at, way));
  }
}

// Adds the three axes of a body's frame.
function addFrame(framed, { place, attitude }, arm) {
  framed.forEach((numbers, axis) => {
    const way = rotate(attitude, [0, 1, 2].map((k) => (k === axis ? arm : 0)));
    numbers.push(...place, ...add(place, way));
  });
}

// Adds a body of points, with lines from the centre of mass to them.
function addCloud({ dots, arms }, points, { place, attitude }) {
  for (const point of points) {
    const at = add(place, rotate(attitude, point));
    dots.push(...at);
    arms.push(...place, ...at);
  }
}

// World axes in the lower left corner of a view.
class Compass {
  constructor() {
    const svg = (name, attributes) => {
      const made = document.createElementNS("http://www.w3.org/2000/svg", name);
      for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
      return made;
    };
    this.picture = svg("svg", { class: "compass", viewBox: "-38 -38 76 76", "aria-hidden": "true" });
    this.arms = ["x", "y", "z"].map((name) => {
      const arm = { line: svg("line", {}), text: svg("text", {}) };
      arm.text.textContent = name;
      this.picture.append(arm.line, arm.text);
      return arm;
    });
  }

  turn(camera) {
    const [right, up, forward] = axesOf(camera);
    this.arms.forEach(({ line, text }, k) => {
      line.setAttribute("x2", 20 * right[k]);
      line.setAttribute("y2", -20 * up[k]);
      text.setAttribute("x", 29 * right[k]);
      text.setAttribute("y", -29 * up[k]);
      for (const part of [line, text]) part.setAttribute("opacity", forward[k] > 0.3 ? 0.6 : 1);
    });
  }
}

// Embedded picture of the first frame of a run.
function stillOf(run) {
  const still = document.getElementById(`still-${run.index}`).cloneNode();
  still.removeAttribute("id");
  still.classList.add("shown");
  return still;
}
