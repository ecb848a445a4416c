// Colours of the style sheet. Those of the scene come from `palette.rs`.

// Colours by name, read again when the mode changes.
const colours = {};
function readColours() {
  const style = getComputedStyle(document.documentElement);
  const names = [
    "ink faint sky ground grid shadow shadow-depth trail force joint-force seam joint chosen still card line accent",
    "plot-grid run-a run-b run-a-other run-b-other retried fallback substepped wild failed",
  ];
  for (const name of names.join(" ").split(" ")) {
    colours[name] = style.getPropertyValue(`--${name}`).trim();
  }
  colours.isDark = matchMedia("(prefers-color-scheme: dark)").matches;
}
readColours();

// Colour of a body. Two runs differ by colour.
const hueOf = (run, body) => (isPair ? colours[run.index ? "run-b" : "run-a"] : run.bodies[body].colour);
