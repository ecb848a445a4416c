// Keyboard commands.

// Number of rows per step with shift.
const LARGE = 20;
const KEYS = [
  { keys: [" "], name: "space", words: "play, pause", act: () => play(!isPlaying) },
  {
    keys: ["ArrowRight"],
    name: "→",
    words: "next row",
    act: (event) => stepBy(event.shiftKey ? LARGE : 1),
  },
  {
    keys: ["ArrowLeft"],
    name: "←",
    words: "previous row",
    act: (event) => stepBy(event.shiftKey ? -LARGE : -1),
  },
  { keys: [], name: "shift + ← →", words: `${LARGE} rows` },
  { keys: ["Home"], name: "home", words: "start", act: () => setTime(0) },
  { keys: ["End"], name: "end", words: "end", act: () => setTime(duration) },
  { keys: ["+", "="], name: "+", words: "faster", act: () => changeSpeed(1) },
  { keys: ["-", "_"], name: "−", words: "slower", act: () => changeSpeed(-1) },
  { keys: ["n"], name: "n", words: "next marked step", act: () => jumpToMark(1) },
  { keys: ["p"], name: "p", words: "previous marked step", act: () => jumpToMark(-1) },
  { keys: ["f"], name: "f", words: "contact forces", act: () => toggle("forces") },
  { keys: ["t"], name: "t", words: "trail", act: () => toggle("trail") },
  { keys: ["c"], name: "c", words: "follow the body", act: () => toggle("follow") },
  { keys: ["b"], name: "b", words: "frames of the bodies", act: () => toggle("frames") },
  { keys: ["e"], name: "e", words: "forces at points or of faces", act: () => toggle("points") },
  { keys: ["h"], name: "h", words: "sizes of forces", act: () => toggle("values") },
  { keys: ["m"], name: "m", words: "places of the contacts", act: () => toggle("contacts") },
  { keys: ["k"], name: "k", words: "friction cones", act: () => toggle("cones") },
  ...(hasJoints
    ? [{ keys: ["j"], name: "j", words: "anchors, axes and forces of joints (violet)", act: () => toggle("joints") }]
    : []),
  ...(runs.some((run) => run.hasCollision)
    ? [{ keys: ["g"], name: "g", words: "collision pieces", act: () => toggle("collision") }]
    : []),
  ...(isPair
    ? [{ keys: ["o"], name: "o", words: "overlay both bodies", act: () => toggle("overlay") }]
    : []),
  { keys: ["r"], name: "r", words: "reset the view", act: resetView },
  { keys: ["a"], act: () => camera.orbit(12, 0), name: "a d w s", words: "orbit" },
  { keys: ["d"], act: () => camera.orbit(-12, 0) },
  { keys: ["w"], act: () => camera.orbit(0, 8) },
  { keys: ["s"], act: () => camera.orbit(0, -8) },
  { keys: ["z"], act: () => camera.zoom(1 / 1.2), name: "z x", words: "zoom" },
  { keys: ["x"], act: () => camera.zoom(1.2) },
  { keys: ["i"], name: "i", words: "save as PNG", act: () => hasGraphics && savePicture() },
  { keys: ["v"], name: "v", words: "only the view, played in a loop, as on a slide", act: widen },
  { keys: ["Escape"], name: "esc", words: "end the selection", act: leave },
  { keys: ["?"], name: "?", words: "this help", act: () => $("help").showModal() },
];

// Closes the menu, or else ends the selection.
function leave() {
  if ($("more").open) $("more").open = false;
  else if (show.chosen.length > 0) select([]);
}

function onKey(event) {
  if (event.ctrlKey || event.metaKey || event.altKey || $("help").open) return;
  const { tagName } = event.target;
  // A focused button handles the space bar, and a list its own keys.
  if (tagName === "SELECT" || (event.key === " " && ["BUTTON", "SUMMARY"].includes(tagName)))
    return;
  const pressed = event.key.length === 1 ? event.key.toLowerCase() : event.key;
  const binding = KEYS.find(({ keys }) => keys.includes(pressed));
  if (!binding) return;
  event.preventDefault();
  binding.act(event);
  repaint();
}
