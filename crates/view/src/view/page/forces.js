// Contact forces and friction cones.

// Relative length of an arrow from which it is opaque. Smaller forces are fainter.
const OPAQUE = 0.3;
const FAINTEST = 0.2;
// Real time for which a force that has ended fades during playback (s).
const FADING = 0.25;
// Height of a friction cone over the longest arrow, and largest slope of its side.
const CONE_HEIGHT = 0.35;
const STEEPEST = 2;
const CONE_SIDES = 32;

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
function addArrows(run, { partner, force }, at, share, arrows) {
  const arrow = run.arrow(force);
  const size = length(arrow) / run.data.arrows.longest;
  const look = [share * Math.min(1, Math.max(FAINTEST, size / OPAQUE)), 0, 0];
  arrows.push(...at, ...arrow, ...look);
  if (partner >= 0) arrows.push(...at, ...times(arrow, -1), ...look);
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
      const least = axis.map(Math.abs).indexOf(smallest(axis.map(Math.abs)));
      const u = times(unit(cross(axis, [0, 1, 2].map((k) => (k === least ? 1 : 0)))), height * slope);
      const v = cross(axis, u);
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
