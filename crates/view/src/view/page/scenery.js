// Compass, and the overlays of bodies: frames, joints, lines from joint to joint, and points.

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

// Adds the lines from joint to joint of a body.
function addBones(lines, bones, { place, attitude }) {
  for (const { from, to } of bones) {
    for (const end of [from, to]) lines.push(...add(place, rotate(attitude, end)));
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

// True if the direction of gravity needs an arrow: the ground is inclined, or gravity is not along −z.
const hasGravityArrow = (() => {
  const { gravity, ground } = runs[0].data;
  const isUsual = gravity[0] === 0 && gravity[1] === 0 && gravity[2] <= 0;
  return length(gravity) > 0 && (!isUsual || (ground !== null && ground.normal[2] < 0.9999));
})();

// World axes in the lower left corner of a view, and the direction of gravity.
class Compass {
  constructor() {
    this.picture = svg("svg", { class: "compass", viewBox: "-38 -38 76 76", "aria-hidden": "true" });
    const ways = { x: [1, 0, 0], y: [0, 1, 0], z: [0, 0, 1] };
    if (hasGravityArrow) ways.g = unit(runs[0].data.gravity);
    this.arms = Object.entries(ways).map(([name, way]) => {
      const arm = { way, line: svg("path", {}), text: svg("text", {}) };
      arm.text.textContent = name;
      const group = svg("g", { class: name });
      group.append(arm.line, arm.text);
      this.picture.append(group);
      return arm;
    });
  }

  turn(camera) {
    const axes = axesOf(camera);
    for (const { way, line, text } of this.arms) {
      const [x, y, depth] = axes.map((axis) => dot(axis, way));
      // The arrow of gravity has a head, and is never faint.
      const isGravity = way === this.arms[3]?.way;
      const tip = `L${20 * x} ${-20 * y}`;
      const head = `m${-4 * x - 3 * y} ${4 * y - 3 * x}${tip}l${-4 * x + 3 * y} ${4 * y + 3 * x}`;
      line.setAttribute("d", `M0 0${tip}${isGravity ? head : ""}`);
      text.setAttribute("x", 29 * x);
      text.setAttribute("y", -29 * y);
      for (const part of [line, text]) part.setAttribute("opacity", depth > 0.3 && !isGravity ? 0.6 : 1);
    }
  }
}

// Embedded picture of the first frame of a run.
function stillOf(run) {
  const still = document.getElementById(`still-${run.index}`).cloneNode();
  still.removeAttribute("id");
  still.classList.add("shown");
  return still;
}
