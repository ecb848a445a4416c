// Assembly of the page.

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
if (!isLive) addEventListener("hashchange", openAddress);
new ResizeObserver(repaint).observe($("stages"));

// Requests from the console of the browser or a test.
globalThis.playground = { ask: asked };

document.body.classList.toggle("live", isLive);

// Place of the page's program.
async function sourceOf({ dataset, textContent }) {
  if (dataset.live) return { address: `ws://${location.host}${location.pathname}${dataset.live}` };
  return { module: await WebAssembly.compile(await unpacked(textContent)) };
}

(async () => {
  try {
    program = new Program(await sourceOf($("program")));
    const answer = await program.ask({ do: "scenes" });
    if (answer.trap) throw new Error(answer.trap);
    ({ scenes, statuses } = answer);
  } catch (error) {
    put($("wait"), `The program does not start here: ${error.message}. A recent browser${isLive ? "" : " with WebAssembly"} is needed.`);
    return;
  }
  scenes.forEach(({ title }, i) => $("scene").append(element("option", { value: String(i) }, title)));
  if (!isLive) return openAddress();
  await attach();
  isAttached = true;
  followOthers();
})();
