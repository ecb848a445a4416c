// State of the playground, and the answers of its program.

const $ = (id) => document.getElementById(id);
const SPEEDS = [0.02, 0.05, 0.1, 0.25, 0.5, 1, 2];
// Largest number of steps of one picture.
const MOST_STEPS = 2000;
// Time after which a step is slow, and after which another scene ends it (ms).
const SLOW_STEP = 500;

// True if a server computes.
const isLive = $("program").dataset.live !== "";
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
  if (answer.scene !== undefined && answer.scene !== look?.scene) await attach();
  return answer;
}

// The program ended by itself.
function stopped(why) {
  play(false);
  isAttached = false;
  const remedy = isLive ? "Reload the page to connect again." : "Choose a scene to start it again.";
  alarm(`The program stopped (${why}). ${remedy}`);
  program.restart();
  opened += 1;
  return { error: why };
}

// Largest message (characters).
const LONGEST_ALARM = 500;

// Shows a failure.
function alarm(text) {
  // The program reads the text as a file of this name.
  const whole = text.replace(/^scenarios\/scene\.toml: /, "");
  const plain = whole.length > LONGEST_ALARM ? `${whole.slice(0, LONGEST_ALARM)} …` : whole;
  const sentence = /[.!?]$/.test(plain) ? plain : `${plain}.`;
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

// Shows the scene that is open in the server. Another window may have changed it.
async function attach() {
  drop();
  await asked({ do: "look" });
}

// Time between two looks of a window that does not run (ms).
const LOOK_AGAIN = 50;
let isAttached = false;

// Follows the run that other windows move.
async function followOthers() {
  if (!isAttached) return;
  if (!isPlaying && !document.hidden) await asked({ do: "step", count: 0, contacts: wantsContacts() });
  setTimeout(followOthers, LOOK_AGAIN);
}

// Takes the description of a scene: `request` made it.
function describe(answer, request) {
  const before = look;
  look = answer;
  const values = valuesOf(answer);
  for (const slider of sliders) slider.set(values[slider.kind.name]);
  const kind = Object.keys(request.change ?? { scene: 1 })[0];
  const isNew = request.do === "open" || answer.name !== before?.name;
  if (isNew) strip.clear();
  touched = Math.min(touched, answer.masses.length - 1);
  const names = answer.film.bodies.map(({ name }) => name);
  const isOther = String(names) !== String(drawing?.run.bodies.map(({ name }) => name));
  if (isNew || isOther || request.do === "look" || kind === "add" || kind === "remove") draw(answer.film, isNew);
  $("body").replaceChildren(...names.map((name, body) => element("option", { value: String(body) }, name)));
  $("remove").disabled = names.length < 2;
  if (kind !== "mass") bodyMass = answer.masses[touched];
  touch(touched);
  const notes = answer.notes.map((note) => `${note}.`);
  if (answer.parts > 0) {
    notes.push(`The record has ${answer.parts + 1} parts: a change of the scene begins a new one. All are kept.`);
  }
  put($("notes"), notes.join(" "));
}

// Takes the numbers of a moment.
function accept(numbers) {
  lastAnswer = performance.now();
  const before = head;
  head = headOf(numbers);
  const isSame = head.index === before?.index && head.grabbed === before.grabbed && numbers.length === shownNumbers;
  shownNumbers = numbers.length;
  if (drawing && head.bodies === drawing.run.bodies.length) drawing.run.show(numbers);
  const status = statuses[head.status];
  const isBad = status === "failed" || status === "wild";
  if (isSame) return;
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
let shownNumbers = 0;
