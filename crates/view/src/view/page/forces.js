// Contact forces and friction cones.

// Relative length of an arrow from which it is opaque. Smaller forces are fainter.
const OPAQUE = 0.3;
const FAINTEST = 0.2;
// Opacity of the forces on bodies that are not chosen, if others are.
const NOT_CHOSEN = 0.3;
// Real time for which a force that has ended fades during playback (s).
const FADING = 0.25;
// Height of a friction cone over the longest arrow, and largest slope of its side.
const CONE_HEIGHT = 0.35;
const STEEPEST = 2;
const CONE_SIDES = 32;
// Smallest cosine between the normals of contacts of one face.
const SAME_FACE = 0.9;
// Smallest length of the longest arrow (pixels), and its largest growth for that in a crowd.
const READABLE = 60;
const CROWD = 12;
const GROWTH_IN_CROWD = 1.4;
// Arc of a moment: largest radius over the longest arrow, angle, number of lines, and size of the head over
// the radius.
const ARC_SIZE = 0.6;
const ARC = 1.5 * Math.PI;
const ARC_LINES = 24;
const ARC_HEAD = 0.3;
// Rows of the scale of forces, over the reference force. Narrow pictures leave out the last.
const SCALE_ROWS = [10, 1, 0.1];

// The `forces` of a frame that are shown.
function shownForces(run, forces, show) {
  const { weight } = run.data.arrows;
  return forces.filter(({ body, partner, point, force }) => {
    const isChosen = show.chosen.includes(body) || show.chosen.includes(partner);
    const size = length(force);
    return (!show.only || isChosen) && size > 0 && size >= show.least * weight && isFinitePoint(point);
  });
}

// One resultant for each face: the sum of the forces between two bodies whose normals agree, at their
// mean point weighted by the forces.
function resultants(found) {
  const faces = new Map();
  for (const one of found) {
    const pair = `${one.body} ${one.partner}`;
    if (!faces.has(pair)) faces.set(pair, []);
    const known = faces.get(pair);
    const face = known.find(({ normal }) => dot(normal, one.normal) > SAME_FACE);
    const weight = length(one.force);
    if (face) {
      const total = face.weight + weight;
      face.point = between(face.point, one.point, weight / total);
      face.force = add(face.force, one.force);
      if (one.moment) face.moment = add(face.moment, one.moment);
      face.weight = total;
    } else known.push({ ...one, site: `${pair} ${known.length}`, weight });
  }
  return [...faces.values()].flat();
}

// Length of the longest arrow (m) if a metre has `pixels` in the middle of the picture. Arrows of
// small bodies are longer than the bodies. In a crowd they are limited, because they would overlap.
function longestArrow({ data, bodies }, pixels) {
  const { longest } = data.arrows;
  const readable = READABLE / pixels;
  return Math.max(longest, bodies.length > CROWD ? Math.min(readable, GROWTH_IN_CROWD * longest) : readable);
}

// Adds the arrows of a contact or a joint. A contact between bodies has one for each of them, a joint
// only for its first body. If bodies are `chosen`, the forces on the others are faint.
function addArrows(run, { body, partner, force, isOfJoint }, at, share, chosen, arrows) {
  const arrow = run.arrow(force);
  const strength = share * Math.min(1, Math.max(FAINTEST, length(arrow) / run.longest / OPAQUE));
  const alpha = (on) => (chosen.length === 0 || chosen.includes(on) ? strength : NOT_CHOSEN * strength);
  arrows.push(...at, ...arrow, alpha(body), 0, 0);
  if (partner >= 0 && !isOfJoint) arrows.push(...at, ...times(arrow, -1), alpha(partner), 0, 0);
}

// Two unit vectors that make a right-handed frame with a unit vector `axis`.
function across(axis) {
  const sizes = axis.map(Math.abs);
  const least = sizes.indexOf(smallest(sizes));
  const u = unit(cross(axis, [0, 1, 2].map((k) => (k === least ? 1 : 0))));
  return [u, cross(axis, u)];
}

// Adds the lines of an arc with a head around the axis of the moment on a body. Its radius grows like the
// length of an arrow.
function addArc(run, { body, moment }, at, lines) {
  const size = moment ? length(moment) : 0;
  if (!(size > 0)) return;
  const root = Math.sqrt(size / (run.data.arrows.weight * run.reaches[body]));
  const radius = (ARC_SIZE * run.longest * root) / (1 + root);
  const [u, v] = across(times(moment, 1 / size));
  const spot = (turn, share) =>
    add(at, add(times(u, share * radius * Math.cos(turn)), times(v, share * radius * Math.sin(turn))));
  const turns = Array.from({ length: ARC_LINES + 1 }, (_, k) => (ARC * k) / ARC_LINES);
  for (let k = 0; k < ARC_LINES; k += 1) lines.push(...spot(turns[k], 1), ...spot(turns[k + 1], 1));
  for (const side of [-ARC_HEAD, ARC_HEAD]) lines.push(...spot(ARC, 1), ...spot(ARC - 1.4 * ARC_HEAD, 1 + side));
}

// Forces that end during playback. They fade out, so that short contacts are visible.
class FadingForces {
  constructor() {
    this.known = new Map();
  }

  // Forces `found` at real time `now` with the share 1, and those that have ended with less.
  update(found, now) {
    for (const one of found) this.known.set(one.site, { one, seen: now });
    const all = [];
    for (const [site, { one, seen }] of this.known) {
      const share = 1 - (now - seen) / FADING;
      if (share > 0) all.push({ ...one, share });
      else this.known.delete(site);
    }
    return all;
  }

  clear() {
    this.known.clear();
  }
}

// Friction cones with their apex at the contacts.
class Cones {
  constructor() {
    const rim = (k) => {
      const turn = (2 * Math.PI * k) / CONE_SIDES;
      return [Math.cos(turn), Math.sin(turn), 1];
    };
    const corners = [];
    for (let k = 0; k < CONE_SIDES; k += 1) corners.push([0, 0, 0], rim(k), rim(k + 1));
    this.geometry = new THREE.BufferGeometry();
    this.geometry.setAttribute("position", new THREE.Float32BufferAttribute(corners.flat(), 3));
    this.material = new THREE.MeshBasicMaterial({
      transparent: true,
      opacity: 0.16,
      depthWrite: false,
      side: THREE.DoubleSide,
    });
    this.group = new THREE.Group();
    this.room = 0;
  }

  recolour() {
    this.material.color.set(colours.force);
  }

  // Shows cones, each with apex, unit axis, height and slope of the side.
  set(cones) {
    if (cones.length > this.room) {
      this.mesh?.dispose();
      this.group.clear();
      this.room = 2 * cones.length;
      this.mesh = new THREE.InstancedMesh(this.geometry, this.material, this.room);
      this.mesh.frustumCulled = false;
      this.mesh.renderOrder = 8;
      this.group.add(this.mesh);
    }
    if (!this.mesh) return;
    const matrix = new THREE.Matrix4();
    cones.forEach(({ at, axis, height, slope }, i) => {
      const [u, v] = across(axis).map((side) => times(side, height * slope));
      const w = times(axis, height);
      matrix.set(u[0], v[0], w[0], at[0], u[1], v[1], w[1], at[1], u[2], v[2], w[2], at[2], 0, 0, 0, 1);
      this.mesh.setMatrixAt(i, matrix);
    });
    this.mesh.count = cones.length;
    this.mesh.instanceMatrix.needsUpdate = true;
  }
}

// Friction cone of a contact, on the side of its body. Flat cones are cut to the steepest slope.
function coneOf(run, { normal, friction }, at) {
  const height = CONE_HEIGHT * run.data.arrows.longest;
  const slope = Math.min(STEEPEST, Math.max(0.02, friction));
  return { at, axis: normal, height, slope };
}

// Scale of forces in the lower right corner of a view: arrows with their forces.
class ForceScale {
  constructor() {
    this.picture = svg("svg", { class: "force-scale", "aria-hidden": "true" });
    this.rows = SCALE_ROWS.map((_, i) => {
      const y = -11 - 16 * i;
      const [shaft, head] = ["shaft", "head"].map((name) => svg("path", { class: name }));
      const text = svg("text", { y });
      this.picture.append(shaft, head, text);
      return { y, shaft, head, text };
    });
    this.law = svg("text", { class: "law", x: 8 });
    this.law.textContent = "length not linear";
    this.picture.append(this.law);
  }

  // Shows arrows as long as those in the middle of a picture of a `width`, where a metre has
  // `pixels`.
  show(run, pixels, width, isShown) {
    const forces = SCALE_ROWS.map((share) => roundLength(share * run.data.arrows.weight));
    const sizes = forces.map((force) => pixels * length(run.arrow([force, 0, 0])));
    const longest = largest(sizes);
    this.picture.style.display = isShown && longest <= WIDEST_SCALE * width ? "" : "none";
    const [wide, high] = [Math.max(longest + SCALE_TEXT, NARROWEST_SCALE), scaleHeight(width)];
    this.law.setAttribute("y", 9 - high);
    Object.assign(this.picture.style, { width: `${wide}px`, height: `${high}px` });
    this.picture.setAttribute("viewBox", `0 ${-high} ${wide} ${high}`);
    this.rows.forEach(({ y, shaft, head, text }, i) => {
      for (const part of [shaft, head, text]) part.style.display = i < scaleRows(width) ? "" : "none";
      const tip = 8 + sizes[i];
      const neck = tip - Math.min(11, 0.6 * sizes[i]);
      const half = 0.42 * (tip - neck);
      shaft.setAttribute("d", `M8 ${y}H${neck}`);
      head.setAttribute("d", `M${tip} ${y}L${neck} ${y - half}V${y + half}Z`);
      text.setAttribute("x", longest + 16);
      put(text, forceText(forces[i]));
    });
  }
}

// Formats a round force.
function forceText(force) {
  const [factor, name] = [[1e-6, "MN"], [1e-3, "kN"], [1, "N"]].find((unit) => force * unit[0] >= 1) ?? [1e3, "mN"];
  const value = Number((force * factor).toPrecision(2));
  return `${value >= 1e-3 && value < 1e5 ? value : number(value, 1)} ${name}`;
}
