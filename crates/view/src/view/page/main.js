// State of the page, and the buttons, keys and plots that change it.

const $ = (id) => document.getElementById(id);
const SPEEDS = [0.05, 0.1, 0.25, 0.5, 1, 2, 4];
// Half width of the view over the size of the group that the camera follows.
const AROUND = 3.2;
// Smallest magnification for which the view leaves out what stands still.
const NEARER = 1.6;

// Number of decimals of the time display, from the smallest step of all runs.
const clockDecimals = largest(runs.map((run) => stepDecimals(run.step)));
const clock = (t) => fixed(t, clockDecimals);

let time = 0;
let speed = 1;
let isPlaying = false;
const pace = new Pace();
let lastTick = 0;
// Time shown in the views.
let painted = 0;
const show = {
  forces: true,
  trail: true,
  follow: followedReach > 0,
  overlay: false,
  names: false,
  frames: false,
  contacts: false,
  // True for a force at each point instead of one resultant a face.
  points: false,
  // True for the size of each force at its arrow.
  values: false,
  cones: false,
  joints: true,
  // True for the pieces that touch instead of the looks of bodies.
  collision: false,
  anchor: [0, 0, 0],
  // Smallest force shown, relative to the weight, and true to show only those of chosen bodies.
  least: 0,
  only: false,
  // Display state of fixed objects by name: shown, faded or hidden.
  fixed: new Map(),
  // Chosen bodies, with trail and plots. The state panel shows the last one.
  chosen: [],
  // Bodies with an outline: without a choice the one in the panels, which a slide does not show.
  get marked() {
    return isCrowd && !isSlide() ? plotted() : this.chosen;
  },
  // True if a selection extends the list.
  several: false,
};
// The first direction is that of the animation.
const camera = new Camera(runs[0].data.view);
const TOGGLES = [
  ...["forces", "trail", "follow", "overlay", "names", "frames", "collision", "contacts", "points", "values", "cones"],
  ...["joints", "only", "several"],
];
// Body whose plots and state are shown: without a choice, the first that moves.
const firstMoving = Math.min(runs[0].data.first, bodyCount - 1);
const lastChosen = () => show.chosen.at(-1) ?? firstMoving;
// Bodies with plots, and those with trails. A single body needs no choice.
const plotted = () => (show.chosen.length > 0 ? show.chosen : [firstMoving]);
const tracked = () => (isCrowd ? show.chosen : [0]);

const LABEL = hasGraphics
  ? "Motion; drag to orbit, wheel or pinch to zoom, keys w a s d and z x do the same"
  : "The first moment of the motion";
const stages = isPair
  ? [
      ...runs.map((run) => new Stage([run], `${run.name}: ${LABEL}`)),
      new Stage(runs, `Both runs: ${LABEL}`),
    ]
  : [new Stage(runs, LABEL)];
const isShown = (stage) => !isPair || stage.members.length > 1 === show.overlay;

let isDue = false;
function repaint() {
  if (isDue) return;
  isDue = true;
  requestAnimationFrame(paint);
}

function paint() {
  isDue = false;
  const shown = stages.filter(isShown);
  // If the path is long, the view shows the followed bodies and their surroundings.
  const isNear = followedReach > 0 && show.follow;
  const fit = `${shown[0].size} ${isNear}`;
  if (camera.isFitted && camera.fittedTo !== fit) {
    const middle = middleOf(runs, time, show.chosen);
    if (isNear) camera.fit(around(middle), ...shown[0].size);
    else fitMotion(...shown[0].size);
    show.anchor = isNear ? middle : camera.target;
    camera.fittedTo = fit;
  }
  const [before, detail] = isPlaying ? [painted, pace.detail] : [time, FULL];
  for (const stage of shown) stage.paint(camera, time, before, show, detail);
  painted = time;
  for (const plot of plots) plot.move(time);
  showState(state, time, lastChosen());
  $("scrub").value = time;
  $("scrub").setAttribute("aria-valuetext", `${clock(time)} seconds`);
  put($("clock"), `${clock(time)} / ${clock(duration)} s`);
}

// Shows everything, or only what moves if that is much smaller.
function fitMotion(width, height) {
  camera.fit(places.concat(feet), width, height);
  const whole = camera.distance;
  camera.fit(moving, width, height);
  if (camera.distance * NEARER > whole || moving.length === 0) camera.fit(places.concat(feet), width, height);
}

// Corners of a box around the followed bodies.
function around(middle) {
  const reach = AROUND * followedReach;
  const ends = [-reach, reach];
  return ends.flatMap((x) => ends.flatMap((y) => [-0.3 * reach, 0.5 * reach].map((z) => add(middle, [x, y, z]))));
}

function setTime(wanted) {
  time = Math.min(duration, Math.max(0, wanted));
  linkLater();
  repaint();
}

// Advances the time during playback, by at most 0.1 s of real time per frame.
function advance(now) {
  if (!isPlaying) return;
  setTime(time + Math.min(0.1, (now - lastTick) / 1000) * speed);
  pace.after(now - lastTick);
  lastTick = now;
  if (time >= duration && isSlide()) setTime(0);
  if (time >= duration) play(false);
  else requestAnimationFrame(advance);
}

function play(wanted) {
  isPlaying = wanted && duration > 0;
  $("play").classList.toggle("playing", isPlaying);
  $("play").setAttribute("aria-label", isPlaying ? "Pause" : "Play");
  // The paused picture has full detail.
  repaint();
  if (!isPlaying) return;
  if (time >= duration) setTime(0);
  lastTick = performance.now();
  requestAnimationFrame(advance);
}

// Steps by frames of all runs.
function stepBy(frames) {
  play(false);
  let wanted = time;
  for (let k = 0; k < Math.abs(frames); k += 1) wanted = neighbour(wanted, Math.sign(frames));
  setTime(wanted);
}

function jumpToMark(direction) {
  const room = 1e-6 * runs[0].step;
  const ahead = markTimes.filter((t) => direction * (t - time) > room);
  if (ahead.length > 0) {
    play(false);
    setTime(direction > 0 ? ahead[0] : ahead.at(-1));
  }
}

function toggled(what) {
  // The current target stays fixed relative to the bodies.
  if (what === "follow") show.anchor = camera.target;
  arrange();
}

function restyle() {
  for (const stage of stages) stage.isStale = true;
  repaint();
}

// Selects a body for plots, state and trail. If `adds`, the body is added to the selection, or
// removed if it is already selected. A place without a body ends the selection.
function choose(body, adds = show.several) {
  if (body >= bodyCount || (body < 0 && (adds || show.chosen.length === 0))) return;
  if (body < 0) return select([]);
  const others = adds ? show.chosen.filter((other) => other !== body) : [];
  const isTaken = adds && others.length < show.chosen.length && others.length > 0;
  select(isTaken ? others : [...others, body]);
}

function select(bodies) {
  show.chosen = bodies;
  showBody(lastChosen());
  for (const { sheet, card } of sheets) if (sheet.of_body) fillSheet(sheet, card);
  restyle();
}

// Replaces the plots of a sheet. Open plots stay open.
function fillSheet(sheet, card) {
  const before = [...card.querySelectorAll("details")];
  const wasOpen = new Map(before.map((box) => [box.id, box.open]));
  for (const plot of plots.filter(({ box }) => before.includes(box))) {
    plot.chart?.destroy();
    plots.splice(plots.indexOf(plot), 1);
  }
  before.forEach((box) => box.remove());
  const data = sheet.of_body ? joined(sheet, plotted()) : sheet.plots;
  // Open plots come first. The order is kept otherwise.
  const ordered = [...data].sort((a, b) => Number(b.open) - Number(a.open));
  const made = ordered.map((one) => new Plot(one, setTime));
  card.append(...made.map((plot) => plot.box));
  for (const { box } of made) if (wasOpen.has(box.id)) box.open = wasOpen.get(box.id);
  const names = plotted().map((body) => runs[0].bodies[body].name).join(", ");
  card.querySelector("h2").textContent = sheet.of_body ? `${sheet.name}: ${names}` : sheet.name;
}

// Hides everything but title, view and playback, or shows it again. A slide plays in a loop, if the
// reader does not prefer less motion.
const isSlide = () => document.body.classList.contains("wide");
function widen() {
  document.body.classList.toggle("wide");
  $("wide").setAttribute("aria-pressed", String(isSlide()));
  redraw();
  play(isSlide() && !matchMedia("(prefers-reduced-motion: reduce)").matches);
}

function resetView() {
  camera.reset();
  repaint();
}

// Shows the active views.
function arrange() {
  $("stages").classList.toggle("two", isPair && !show.overlay);
  for (const stage of stages) stage.figure.hidden = !isShown(stage);
  repaint();
}

function redraw() {
  strip.paint();
  for (const plot of plots) plot.draw();
  repaint();
}

// Assembly of the page.
fillFacts((wanted) => {
  play(false);
  setTime(wanted);
});
const state = fillState();
const strip = new Strip();
$("stages").append(...stages.map((stage) => stage.figure));
for (const stage of stages.filter(() => hasGraphics)) {
  const pick = (place, adds) => isCrowd && choose(stage.bodyAt(place), adds || show.several);
  steer(stage.canvas, camera, repaint, pick);
}
fillBodies(choose);
showBody(firstMoving);
const sheets = page.sheets.map((sheet) => {
  const card = element("section", { class: "card sheet" }, element("h2"));
  $("sheets").append(card);
  fillSheet(sheet, card);
  return { sheet, card };
});
for (const value of SPEEDS)
  $("speed").append(element("option", { value: String(value) }, `${value}×`));
let group = $("keys-time");
for (const { name, words } of KEYS.filter((binding) => binding.name)) {
  // Keys from the forces on change the view.
  if (name === "f") group = $("keys-view");
  group.append(element("dt", {}, name), element("dd", {}, words));
}
setSpeed(1);
$("scrub").max = duration || 1;
$("scrub").disabled = duration === 0;
$("play").disabled = duration === 0;
$("overlay").hidden = !isPair;
$("jumps").hidden = markTimes.length === 0;

$("scrub").addEventListener("input", () => setTime(Number($("scrub").value)));
$("play").addEventListener("click", () => play(!isPlaying));
$("speed").addEventListener("change", () => setSpeed(Number($("speed").value)));
for (const what of TOGGLES) {
  $(what).setAttribute("aria-pressed", String(show[what]));
  $(what).addEventListener("click", () => toggle(what));
}
for (const id of ["names", "only", "several"]) $(id).hidden = !isCrowd;
$("joints").hidden = !hasJoints;
$("collision").hidden = runs.every((run) => !run.hasCollision);
$("least").addEventListener("change", () => {
  show.least = Number($("least").value);
  repaint();
});
$("save").addEventListener("click", savePicture);
$("takeover").hidden = isPair || runs[0].data.takeover === null;
$("takeover").addEventListener("click", takeOver);
fillFixed((name, state) => {
  show.fixed.set(name, state);
  repaint();
});
if (!hasGraphics) {
  for (const part of document.querySelectorAll("#looks button, #more button, #more select, #reset")) {
    part.disabled = true;
  }
}
$("reset").addEventListener("click", resetView);
$("wide").addEventListener("click", widen);
$("next").addEventListener("click", () => jumpToMark(1));
$("previous").addEventListener("click", () => jumpToMark(-1));
$("help-open").addEventListener("click", () => $("help").showModal());
document.addEventListener("keydown", onKey);
// Any other interaction closes the menu.
document.addEventListener("pointerdown", (event) => {
  if (!event.target.closest("#more")) $("more").open = false;
});
// After a click with a pointer the keyboard focus returns to the page.
document.addEventListener("click", (event) => {
  if (event.detail > 0 && event.target.closest("button")) event.target.closest("button").blur();
});
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
  readColours();
  for (const plot of plots) plot.fillLegend();
  restyle();
  redraw();
});
addEventListener("hashchange", readLink);
arrange();
readLink();
// Drawing changes the height of plots. Only a new width requires redrawing. It happens in the next
// frame, since a resize within the observer causes a console error.
let width = 0;
new ResizeObserver(([{ contentRect }]) => {
  if (contentRect.width === width) return;
  width = contentRect.width;
  requestAnimationFrame(redraw);
}).observe($("sheets"));
// The picture of a new size is drawn in the same frame. A later one would first stretch the old picture.
const resized = new ResizeObserver(() => stages.some((stage) => isShown(stage) && !stage.isFitting) && paint());
for (const stage of stages) resized.observe(stage.figure);
