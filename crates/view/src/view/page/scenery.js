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
