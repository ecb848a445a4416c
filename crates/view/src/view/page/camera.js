// Camera: position, projection and user control.

// Half the shorter side of the picture over its distance, a field of view of 28°.
const HALF_VIEW = 0.249;
// Usable fraction of the half picture.
const FILL = 0.93;
// Near plane over the distance of the target.
const NEAR = 0.02;

// Largest share of the scale of forces in the picture's width, room beside its longest arrow, and
// width of a picture with three rows instead of two (pixels).
const WIDEST_SCALE = 0.4;
const SCALE_TEXT = 72;
// Smallest width of the scale, which holds its heading (pixels).
const NARROWEST_SCALE = 100;
const ALL_ROWS = 500;
const scaleRows = (width) => (width < ALL_ROWS ? 2 : 3);
const scaleHeight = (width) => 19 + 16 * scaleRows(width);
// Largest size of the scale with its gap to the rim.
const scaleRoom = (width) => [WIDEST_SCALE * width + SCALE_TEXT + 8, 8 + scaleHeight(width)];

const radians = (degrees) => (degrees * Math.PI) / 180;

// Rotation from the world to the axes right, up, forward.
function axesOf({ azimuth, elevation }) {
  const [sinA, cosA] = [Math.sin(radians(azimuth)), Math.cos(radians(azimuth))];
  const [sinE, cosE] = [Math.sin(radians(elevation)), Math.cos(radians(elevation))];
  return [
    [-sinA, cosA, 0],
    [-cosA * sinE, -sinA * sinE, cosE],
    [-cosA * cosE, -sinA * cosE, -sinE],
  ];
}

// Nearest eye, in camera axes, that has the points `seen` in the picture and above its lowest `foot` pixels. A
// point (x, y, z) is visible from e if x − e_x is between −a (z − e_z) and b (z − e_z), and likewise for y.
function eyeOf(seen, width, height, unit, foot) {
  const above = [width, height].map((size) => (unit * size * FILL) / 2);
  const below = [above[0], Math.min(above[1], unit * (height / 2 - foot))];
  const [near, far] = extremes(seen.map((p) => p[2]));
  const low = above.map((b, k) => largest(seen.map((p) => p[k] - b * p[2])));
  const high = below.map((a, k) => smallest(seen.map((p) => p[k] + a * p[2])));
  const depths = above.map((b, k) => (high[k] - low[k]) / (b + below[k]));
  const depth = Math.min(near - 0.05 * (far - near), smallest(depths));
  const place = (k) => (low[k] + high[k] + (above[k] - below[k]) * depth) / 2;
  return [place(0), place(1), depth];
}

class Camera {
  // `view` is the first direction.
  constructor(view) {
    this.view = view;
    this.reset();
  }

  reset() {
    Object.assign(this, this.view);
    Object.assign(this, { target: [0, 0, 0], distance: 10 });
    // True to show everything, and key of the view that is fitted.
    Object.assign(this, { isFitted: true, fittedTo: null });
  }

  // Moves as near as possible with all `points` in a picture of `width` by `height`, and with none of
  // them behind the scale of forces.
  fit(points, width, height) {
    const axes = axesOf(this);
    const short = Math.min(width, height);
    const seen = points.filter(isFinitePoint).map((point) => axes.map((axis) => dot(axis, point)));
    if (seen.length === 0 || short <= 0) return;
    // Slope of a ray for each pixel from the middle of the picture.
    const unit = (2 * HALF_VIEW) / short;
    const [wide, high] = scaleRoom(width);
    const isBehind = ([x, y, z], eye) =>
      x - eye[0] > unit * (width / 2 - wide) * (z - eye[2]) && y - eye[1] < unit * (high - height / 2) * (z - eye[2]);
    let eye = eyeOf(seen, width, height, unit, 0);
    if (seen.some((point) => isBehind(point, eye))) eye = eyeOf(seen, width, height, unit, high);
    // The target is the centre of the visible points.
    const [near, far] = extremes(seen.map((p) => p[2]));
    this.distance = Math.max((near + far) / 2 - eye[2], 1e-6);
    const middle = [eye[0], eye[1], eye[2] + this.distance];
    this.target = axes.reduce((sum, axis, k) => add(sum, times(axis, middle[k])), [0, 0, 0]);
  }

  orbit(right, up) {
    this.isFitted = false;
    this.azimuth = (this.azimuth - right) % 360;
    this.elevation = Math.min(89.9, Math.max(-60, this.elevation + up));
  }

  zoom(factor) {
    this.isFitted = false;
    this.distance = Math.min(1e12, Math.max(1e-6, this.distance * factor));
  }

  // Moves by fractions of the shorter side of the picture.
  pan(right, up) {
    this.isFitted = false;
    const size = 2 * HALF_VIEW * this.distance;
    const [x, y] = axesOf(this);
    this.target = add(this.target, add(times(x, -right * size), times(y, up * size)));
  }

  // Position with the target moved by `shift`.
  eye(shift) {
    return subtract(add(this.target, shift), times(axesOf(this)[2], this.distance));
  }
}

// Maximum pointer movement of a click (pixels).
const STILL = 4;

// Moves the `camera` by drag, wheel and pinch on `canvas`. A click, with or without shift, selects
// a position.
function steer(canvas, camera, moved, clicked) {
  const fingers = new Map();
  let start = null;
  const spread = () => {
    const [a, b] = [...fingers.values()];
    return Math.hypot(a.x - b.x, a.y - b.y);
  };
  const middle = () => {
    const all = [...fingers.values()];
    return [0, 1].map((k) => all.reduce((sum, f) => sum + (k ? f.y : f.x), 0) / all.length);
  };
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    start = fingers.size === 0 ? [event.clientX, event.clientY] : null;
    fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!fingers.has(event.pointerId)) return;
    if (start && Math.hypot(event.clientX - start[0], event.clientY - start[1]) > STILL) {
      start = null;
    }
    const [oldX, oldY] = middle();
    const oldSpread = fingers.size === 2 ? spread() : 0;
    fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    const [x, y] = middle();
    const short = Math.min(canvas.clientWidth, canvas.clientHeight);
    if (fingers.size === 2) {
      camera.zoom(oldSpread / Math.max(1, spread()));
      camera.pan((x - oldX) / short, (y - oldY) / short);
    } else if (event.shiftKey) {
      camera.pan((x - oldX) / short, (y - oldY) / short);
    } else {
      camera.orbit(0.4 * (x - oldX), 0.4 * (y - oldY));
    }
    moved();
  });
  canvas.addEventListener("pointerup", (event) => {
    const { left, top } = canvas.getBoundingClientRect();
    if (start) clicked([event.clientX - left, event.clientY - top], event.shiftKey);
    start = null;
  });
  for (const end of ["pointerup", "pointercancel"]) {
    canvas.addEventListener(end, (event) => fingers.delete(event.pointerId));
  }
  canvas.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      const lines = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 16 : 1;
      camera.zoom(Math.exp(0.0015 * Math.max(-400, Math.min(400, lines * event.deltaY))));
      moved();
    },
    { passive: false },
  );
}
