// Colours of the page, in light and dark mode, and of the bodies.

// Colours of the style sheet, read again when the mode changes.
const colours = {};
function readColours() {
  const style = getComputedStyle(document.documentElement);
  for (const name of [
    "ink",
    "faint",
    "sky",
    "ground",
    "grid",
    "shadow",
    "trail",
    "force",
    "seam",
    "edge",
    "chosen",
    "plot-grid",
    "run-a",
    "run-b",
    "run-a-other",
    "run-b-other",
    "retried",
    "fallback",
    "substepped",
    "wild",
    "failed",
  ]) {
    colours[name] = style.getPropertyValue(`--${name}`).trim();
  }
  colours.isDark = matchMedia("(prefers-color-scheme: dark)").matches;
}
readColours();

// Hues of two runs, or of several bodies. The last is that of fixed objects.
const HUES = ["#2f7fc4", "#d98a1f", "#2a9d74", "#b5519b", "#c9504a", "#9c972c", "#8b95a3"];
const STILL_HUE = HUES.length - 1;

// Colour of a body: its own, or a hue by index.
function hueOf(run, body) {
  if (isPair) return HUES[run.index];
  return run.bodies[body].colour ?? HUES[body % STILL_HUE];
}
