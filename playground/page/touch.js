// Bodies under the pointer: touch, pull and throw.

// The body in the hand: pointer, grabbed point and its time, and whether it has moved.
let drag = null;
// Longest time for which a body that was let go is still pulled (s).
const LONGEST_FLICK = 0.2;

// Ray through a point of the picture, in the world.
function rayAt([x, y]) {
  const { stage, base } = drawing;
  const [width, height] = stage.size;
  const caster = new THREE.Raycaster();
  caster.setFromCamera({ x: (2 * x) / width - 1, y: 1 - (2 * y) / height }, stage.eye);
  return {
    origin: add(caster.ray.origin.toArray(), base),
    direction: caster.ray.direction.toArray(),
  };
}

// Point on a ray in the plane through `point` that faces the camera.
function onPlane({ origin, direction }, point) {
  const forward = axesOf(camera)[2];
  const along = dot(forward, direction);
  return along > 1e-6 ? add(origin, times(direction, dot(forward, subtract(point, origin)) / along)) : point;
}

function placeIn(canvas, event) {
  const { left, top } = canvas.getBoundingClientRect();
  return [event.clientX - left, event.clientY - top];
}

async function grab(event) {
  const { canvas } = drawing.stage;
  const at = placeIn(canvas, event);
  if (drag?.held >= 0) drop();
  if (drag !== null || event.button !== 0 || event.shiftKey || event.target !== canvas) return;
  if (drawing.stage.bodyAt(at) < 0) return;
  // The camera does not move with the body.
  event.stopPropagation();
  canvas.setPointerCapture(event.pointerId);
  canvas.focus({ preventScroll: true });
  canvas.classList.add("holding");
  const mine = { pointer: event.pointerId, from: at, at, point: null, hasMoved: false };
  Object.assign(mine, { began: performance.now(), time: 0, held: -1 });
  drag = mine;
  const answer = await asked({ do: "grab", ...rayAt(at) });
  if (answer.body == null || drag !== mine) {
    if (drag === mine) drop();
    else if (answer.body != null) await asked({ do: "release" });
    return;
  }
  [mine.point, mine.time] = [answer.point, head.time];
  touch(answer.body);
  follow(mine);
  settle();
}

// Sets the target of the pull.
function follow(mine) {
  if (mine.point !== null) target = onPlane(rayAt(mine.at), mine.point);
  if (mine.hasMoved && mine.point !== null && !isPlaying) play(true);
}

function move(event) {
  const { canvas } = drawing.stage;
  if (drag === null) {
    if (event.pointerType === "mouse" && event.buttons === 0 && event.target === canvas) {
      canvas.classList.toggle("over", drawing.stage.bodyAt(placeIn(canvas, event)) >= 0);
    }
    return;
  }
  if (event.pointerId !== drag.pointer || drag.held >= 0) return;
  event.stopPropagation();
  drag.at = placeIn(canvas, event);
  drag.hasMoved ||= Math.hypot(drag.at[0] - drag.from[0], drag.at[1] - drag.from[1]) > STILL;
  follow(drag);
}

function letGo(event) {
  if (drag === null || event.pointerId !== drag.pointer) return;
  event.stopPropagation();
  drag.held = (performance.now() - drag.began) / 1000;
  settle();
}

// Lets a body go after its pointer did. The simulation may be behind: it gets the time of the pull,
// so that a quick throw is not lost between two pictures.
function settle() {
  if (drag === null || drag.held < 0) return;
  const isPulled = drag.point !== null && head.time >= drag.time + Math.min(LONGEST_FLICK, drag.held * speed);
  if (isPulled || (drag.point !== null && !isPlaying)) drop();
}

// Lets the body in the hand go.
function drop() {
  if (drag === null) return;
  const isHeld = drag.point !== null;
  drag = null;
  target = null;
  drawing?.stage.canvas.classList.remove("holding");
  if (isHeld) asked({ do: "release" });
}

// Lifts the touched body while a key or a button is held.
let isLifting = false;
async function lift(wanted) {
  if (wanted === isLifting || (wanted && drag !== null)) return;
  isLifting = wanted;
  if (!wanted) {
    target = null;
    await asked({ do: "release" });
    return;
  }
  const { run } = drawing;
  const above = times(UP, 3 * run.reaches[touched]);
  const wantedPlace = add(run.position(0, touched), above);
  const answer = await asked({ do: "hold", body: touched });
  if (answer.error || !isLifting) return;
  target = wantedPlace;
  if (!isPlaying) play(true);
}
