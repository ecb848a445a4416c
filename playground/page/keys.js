// Actions of buttons and keys.

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

function toggled(what) {
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
