// State of the playground, and what its buttons and keys do.

const $ = (id) => document.getElementById(id);
const SPEEDS = [0.02, 0.05, 0.1, 0.25, 0.5, 1, 2];
// Largest number of steps of one picture.
const MOST_STEPS = 2000;
// Time after which a step is slow, and after which another scene ends it (ms).
const SLOW_STEP = 500;

const isPair = false;
// The program of the page, scenes and names of statuses.
let program = null;
let scenes = [];
let statuses = [];
// Last description of the scene, its drawing, and the head of the present moment.
let look = null;
let drawing = null;
let head = null;
let camera = null;
// Scenes opened so far: answers for an earlier one are dropped.
let opened = 0;
let isPlaying = false;
let speed = 1;
// Time that the simulation is behind (s).
let owed = 0;
let lastTick = 0;
let isAdvancing = false;
// Target of the pull (m, world), and body that was touched last.
let target = null;
let touched = 0;
// Mean time of a step (ms).
let cost = NaN;
const pace = new Pace();
const show = {
  forces: true, trail: false, follow: false, overlay: false, names: false, frames: false, contacts: false,
  cones: false, joints: false, anchor: [0, 0, 0], least: 0, only: false, fixed: new Map(), chosen: [], several: false,
  slip: false,
};
const TOGGLES = ["forces", "cones", "slip", "contacts", "follow"];
const wantsContacts = () => show.forces || show.cones || show.slip || show.contacts;
const clock = (t) => fixed(t, 3);

// Asks the program. A failure is shown, and the answer has the field `error`.
async function asked(request) {
  const scene = opened;
  const answer = await program.ask(request);
  if (scene !== opened) return { error: "another scene" };
  if (answer.trap) return stopped(answer.trap);
  if (answer.error) {
    play(false);
    alarm(answer.error);
  }
  if (answer.film) describe(answer, request);
  if (answer.numbers?.length > 0) accept(answer.numbers);
  return answer;
}

// The program ended by itself.
function stopped(why) {
  play(false);
  alarm(`The program stopped (${why}). Choose a scene to start it again.`);
  program.restart();
  opened += 1;
  return { error: why };
}

// Shows a failure.
function alarm(text) {
  const sentence = /[.!?]$/.test(text) ? text : `${text}.`;
  put($("alert").querySelector("span"), sentence);
  $("alert").hidden = false;
}

// Opens the scene of a text. Returns true if it can be run.
async function open(text) {
  drop();
  play(false);
  opened += 1;
  // A program that does not answer is ended.
  if (program.isBusy && performance.now() - lastAnswer > SLOW_STEP) program.restart();
  $("alert").hidden = true;
  [owed, cost, touched] = [0, NaN, 0];
  isAdvancing = false;
  strip.clear();
  const answer = await asked({ do: "open", text });
  if (answer.error) return false;
  show.chosen = [];
  return true;
}
let lastAnswer = 0;

// Takes the description of a scene: `request` made it.
function describe(answer, request) {
  look = answer;
  const values = valuesOf(answer);
  for (const slider of sliders) slider.set(values[slider.kind.name]);
  const kind = Object.keys(request.change ?? { scene: 1 })[0];
  const isNew = request.do === "open";
  touched = Math.min(touched, answer.masses.length - 1);
  const names = answer.film.bodies.map(({ name }) => name);
  const isOther = String(names) !== String(drawing?.run.bodies.map(({ name }) => name));
  if (isNew || isOther || kind === "add" || kind === "remove") draw(answer.film, isNew);
  $("body").replaceChildren(...names.map((name, body) => element("option", { value: String(body) }, name)));
  $("remove").disabled = names.length < 2;
  if (kind !== "mass") bodyMass = answer.masses[touched];
  touch(touched);
  put($("notes"), answer.notes.map((note) => `${note}.`).join(" "));
}

// Makes the drawing of a film. `isNew` starts from the first view.
function draw(film, isNew) {
  const former = drawing?.stage;
  if (!hasGraphics) {
    put($("wait"), "This browser has no WebGL, so there is no picture. The numbers are live.");
    drawing = null;
    return;
  }
  // A stage that was never painted still has the renderer of the one before.
  const { canvas, renderer = former?.former?.renderer } = former ?? {};
  if (former?.renderer) drawing.free();
  drawing = drawingOf(film, former ? { canvas, renderer } : null);
  const { stage, run } = drawing;
  $("stages").replaceChildren(stage.figure);
  if (camera === null) {
    camera = new Camera(film.view);
    steer(stage.canvas, camera, repaint, () => {});
    listen();
  }
  if (isNew) {
    camera.view = film.view;
    camera.reset();
    show.follow = run.bodies.length === 1;
    for (const what of TOGGLES) $(what).setAttribute("aria-pressed", String(show[what]));
  }
}

// Pointers on the stages. The camera has those that do not touch a body.
function listen() {
  const options = { capture: true };
  $("stages").addEventListener("pointerdown", (event) => grab(event), options);
  $("stages").addEventListener("pointermove", (event) => drawing && move(event), options);
  for (const end of ["pointerup", "pointercancel"]) $("stages").addEventListener(end, letGo, options);
}

// Takes the numbers of a moment.
function accept(numbers) {
  lastAnswer = performance.now();
  const before = head;
  head = headOf(numbers);
  if (drawing && head.bodies === drawing.run.bodies.length) drawing.run.show(numbers);
  const status = statuses[head.status];
  const isBad = status === "failed" || status === "wild";
  strip.add(head, isBad ? colours[status] : undefined);
  if (head.failed > (before?.failed ?? 0) && !isAnnounced) {
    isAnnounced = true;
    put($("say"), `Step ${head.index - 1} was not solved. Residual ${number(head.residual, 2)} metres per second.`);
  }
  if (head.failed === 0) isAnnounced = false;
  settle();
  repaint();
}
let isAnnounced = false;

let isDue = false;
function repaint() {
  if (isDue) return;
  isDue = true;
  requestAnimationFrame(tick);
}

function tick(now) {
  isDue = false;
  if (isPlaying) {
    const elapsed = now - lastTick;
    lastTick = now;
    pace.after(elapsed);
    owed += Math.min(0.1, elapsed / 1000) * speed;
    if (!isAdvancing) advance(Math.min(MOST_STEPS, Math.floor(owed / look.timeStep + 1e-9)));
    repaint();
  }
  paint();
}

// Takes steps. The simulation does not catch up with a clock that it cannot follow.
async function advance(steps) {
  if (steps < 1) return;
  isAdvancing = true;
  const scene = opened;
  const { done, took } = await asked({ do: "advance", steps, contacts: wantsContacts(), target });
  if (scene !== opened) return;
  isAdvancing = false;
  owed = done === steps ? owed - steps * look.timeStep : 0;
  if (done > 0) cost = Number.isNaN(cost) ? took / done : 0.9 * cost + (0.1 * took) / done;
}

function paint() {
  write();
  strip.paint();
  if (!drawing) return;
  const { stage, run } = drawing;
  const fit = String(stage.size);
  if (camera.isFitted && camera.fittedTo !== fit) {
    camera.fit(drawing.extent(), ...stage.size);
    show.anchor = drawing.middle();
    camera.fittedTo = fit;
  }
  if (stage.size[0] === 0 || stage.size[1] === 0) return;
  if (!stage.renderer) stage.prepare();
  drawing.overlays ??= drawing.newOverlays();
  if (stage.isStale) drawing.overlays.recolour();
  drawing.overlays.set(run.numbers ? head : null, show.slip);
  stage.paint(camera, head?.time ?? 0, 0, show, isPlaying ? pace.detail : FULL);
}

// Writes the state of the last step.
function write() {
  if (head === null) return;
  const status = statuses[head.status];
  const isSlow = isAdvancing && performance.now() - lastAnswer > SLOW_STEP;
  put($("index"), status === "end" ? "" : count(head.index - 1));
  put($("status"), isSlow ? "computing …" : status === "end" ? NOTHING : words(status));
  $("status").className = `status-${status}`;
  put($("residual"), `${number(head.residual, 2)} m/s`);
  const failed = head.failed + head.wild;
  put($("failed"), failed === 0 ? "none" : `${count(failed)}, first k = ${count(Math.max(0, head.first))}`);
  $("failed").classList.toggle("some", failed > 0);
  put($("kinetic"), `${number(head.kinetic, 3)} J`);
  put($("total"), `${number(head.total, 5)} J`);
  put($("cost"), Number.isNaN(cost) ? NOTHING : `${number(cost, 2)} ms`);
  put($("clock"), `t = ${clock(head.time)} s`);
}

// Status in words: what is solved, and how.
function words(status) {
  const known = { free: "free flight", converged: "solved", retried: "solved, retried", failed: "not solved" };
  return known[status] ?? status;
}

function play(wanted) {
  if (wanted && head === null) return;
  isPlaying = wanted;
  $("play").classList.toggle("playing", isPlaying);
  $("play").setAttribute("aria-label", isPlaying ? "Pause" : "Run");
  owed = 0;
  lastTick = performance.now();
  settle();
  repaint();
}

function stepOnce() {
  play(false);
  if (!isAdvancing && head !== null) advance(1);
}

function stepBack() {
  play(false);
  drop();
  if (head !== null) asked({ do: "back", contacts: wantsContacts() });
}

async function restart() {
  play(false);
  drop();
  if (head === null) return;
  strip.clear();
  await asked({ do: "restart" });
}

function setSpeed(wanted) {
  speed = wanted;
  $("speed").value = String(wanted);
}

function changeSpeed(places) {
  const place = SPEEDS.indexOf(speed) + places;
  setSpeed(SPEEDS[Math.min(SPEEDS.length - 1, Math.max(0, place))]);
}

function toggle(what) {
  show[what] = !show[what];
  $(what).setAttribute("aria-pressed", String(show[what]));
  if (what === "follow" && drawing) show.anchor = drawing.middle();
  repaint();
}

// Touches a body: its mass and its removal are at hand.
function touch(body) {
  if (body !== touched) bodyMass = look.masses[body];
  touched = body;
  $("body").value = String(body);
  massSlider.set(look.masses[body]);
  show.chosen = look.masses.length > 1 ? [body] : [];
  if (drawing) drawing.stage.isStale = true;
  repaint();
}

// Asks for changes one after the other. Of those that wait, the last counts.
let nextChange = null;
let isChanging = false;
async function change(wanted) {
  nextChange = wanted;
  if (isChanging || head === null) return;
  isChanging = true;
  while (nextChange !== null) {
    const one = nextChange;
    nextChange = null;
    drop();
    $("alert").hidden = true;
    await asked({ do: "change", change: one });
  }
  isChanging = false;
}

const KEYS = [
  { keys: [" "], name: "space", words: "run, pause", act: () => play(!isPlaying) },
  { keys: ["ArrowRight"], name: "→", words: "one step", act: stepOnce },
  { keys: ["ArrowLeft"], name: "←", words: "one step back", act: stepBack },
  { keys: ["Home"], name: "home", words: "restart", act: restart },
  { keys: ["+", "="], name: "+", words: "faster", act: () => changeSpeed(1) },
  { keys: ["-", "_"], name: "−", words: "slower", act: () => changeSpeed(-1) },
  { keys: ["n"], name: "n", words: "next body", act: () => touchBy(1) },
  { keys: ["p"], name: "p", words: "previous body", act: () => touchBy(-1) },
  { keys: ["u"], name: "u", words: "lift the body while held", act: () => lift(true) },
  { keys: ["Delete"], name: "delete", words: "remove the body", act: () => change({ remove: touched }) },
  { keys: ["f"], name: "f", words: "contact forces", act: () => toggle("forces") },
  { keys: ["k"], name: "k", words: "friction cones", act: () => toggle("cones") },
  { keys: ["l"], name: "l", words: "slip", act: () => toggle("slip") },
  { keys: ["m"], name: "m", words: "places of the contacts", act: () => toggle("contacts") },
  { keys: ["c"], name: "c", words: "follow the bodies", act: () => toggle("follow") },
  { keys: ["r"], name: "r", words: "reset the view", act: resetView },
  { keys: ["a"], name: "a d w s", words: "orbit", act: () => camera?.orbit(12, 0) },
  { keys: ["d"], act: () => camera?.orbit(-12, 0) },
  { keys: ["w"], act: () => camera?.orbit(0, 8) },
  { keys: ["s"], act: () => camera?.orbit(0, -8) },
  { keys: ["z"], name: "z x", words: "zoom", act: () => camera?.zoom(1 / 1.2) },
  { keys: ["x"], act: () => camera?.zoom(1.2) },
  { keys: ["?"], name: "?", words: "this help", act: () => $("help").showModal() },
];

function touchBy(places) {
  if (look === null) return;
  const { length: bodies } = look.masses;
  touch((touched + places + bodies) % bodies);
  put($("say"), `Touched: ${look.film.bodies[touched].name}`);
}

function resetView() {
  camera?.reset();
  repaint();
}

function onKey(event) {
  if (event.ctrlKey || event.metaKey || event.altKey || document.querySelector("dialog[open]")) return;
  const { tagName, type } = event.target;
  if (["SELECT", "TEXTAREA"].includes(tagName) || (tagName === "INPUT" && type !== "range")) return;
  // Sliders and buttons have keys of their own.
  if (type === "range" && (event.key.startsWith("Arrow") || event.key === "Home")) return;
  if (event.key === " " && ["BUTTON", "SUMMARY"].includes(tagName)) return;
  const pressed = event.key.length === 1 ? event.key.toLowerCase() : event.key;
  const binding = KEYS.find(({ keys }) => keys.includes(pressed));
  if (!binding) return;
  event.preventDefault();
  if (event.repeat && ["u", "Delete", " "].includes(pressed)) return;
  binding.act();
  repaint();
}

// Opens the scene of the address, or else the first.
async function openAddress() {
  let text = null;
  try {
    text = await textOf(location.hash);
  } catch (error) {
    await open(scenes[0].text);
    alarm(error.message);
    return;
  }
  $("scene").value = text === null ? "0" : "";
  const isOpen = await open(text ?? scenes[0].text);
  if (isOpen || text === null) return;
  // The failure stays in sight.
  const failure = $("alert").querySelector("span").textContent;
  $("scene").value = "0";
  await open(scenes[0].text);
  alarm(failure);
}

const strip = new StateStrip();
const sliders = SLIDERS.map((kind) => new Slider(kind, change));
const massSlider = new Slider(MASS, change);
$("sliders").append(...sliders.map(({ label }) => label));
$("mass-place").append(massSlider.label);
for (const value of SPEEDS) $("speed").append(element("option", { value: String(value) }, `${value}×`));
let keyList = $("keys-run");
for (const { name, words: text } of KEYS.filter((binding) => binding.name)) {
  // Keys from the forces on change the view.
  if (name === "f") keyList = $("keys-view");
  keyList.append(element("dt", {}, name), element("dd", {}, text));
}
setSpeed(1);

$("play").addEventListener("click", () => play(!isPlaying));
$("step").addEventListener("click", stepOnce);
$("back").addEventListener("click", stepBack);
$("restart").addEventListener("click", restart);
$("speed").addEventListener("change", () => setSpeed(Number($("speed").value)));
for (const what of TOGGLES) $(what).addEventListener("click", () => toggle(what));
$("reset").addEventListener("click", resetView);
$("scene").addEventListener("change", () => {
  history.replaceState(null, "", location.pathname + location.search);
  open(scenes[Number($("scene").value)].text);
});
$("body").addEventListener("change", () => touch(Number($("body").value)));
$("remove").addEventListener("click", () => change({ remove: touched }));
for (const button of document.querySelectorAll("[data-add]")) {
  button.addEventListener("click", () => change({ add: button.dataset.add }));
}
for (const begin of ["pointerdown", "keydown"]) {
  $("lift").addEventListener(begin, (event) => (begin === "pointerdown" || event.key === " ") && lift(true));
}
for (const end of ["pointerup", "pointerleave", "keyup", "blur"]) $("lift").addEventListener(end, () => lift(false));
document.addEventListener("keyup", ({ key }) => key.toLowerCase() === "u" && lift(false));
$("run-text").addEventListener("click", () => {
  $("scene").value = "";
  open($("text").value);
});
const readText = async () => {
  $("text").value = (await presentText()) ?? "";
};
$("read-text").addEventListener("click", readText);
$("source").addEventListener("toggle", () => $("source").open && readText());
$("share").addEventListener("click", openSharing);
$("copy").addEventListener("click", copyLink);
$("download").addEventListener("click", download);
$("alert").querySelector("button").addEventListener("click", () => ($("alert").hidden = true));
$("help-open").addEventListener("click", () => $("help").showModal());
document.addEventListener("keydown", onKey);
document.addEventListener("visibilitychange", () => {
  if (!document.hidden) return;
  drop();
  lift(false);
  lastTick = performance.now();
});
// After a click with a pointer the keyboard focus returns to the page.
document.addEventListener("click", (event) => {
  if (event.detail > 0 && event.target.closest("button")) event.target.closest("button").blur();
});
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
  readColours();
  if (drawing) drawing.stage.isStale = true;
  repaint();
});
addEventListener("hashchange", openAddress);
new ResizeObserver(repaint).observe($("stages"));

// Requests from the console of the browser or a test.
globalThis.playground = { ask: asked };

(async () => {
  try {
    const module = await WebAssembly.compile(await unpacked($("program").textContent));
    program = new Program(module);
    const answer = await program.ask({ do: "scenes" });
    if (answer.trap) throw new Error(answer.trap);
    ({ scenes, statuses } = answer);
  } catch (error) {
    put($("wait"), `The program does not start here: ${error.message}. A recent browser with WebAssembly is needed.`);
    return;
  }
  scenes.forEach(({ title }, i) => $("scene").append(element("option", { value: String(i) }, title)));
  await openAddress();
})();
