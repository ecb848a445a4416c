// Speed and toggles. A page has the globals `SPEEDS`, `speed` and `show`, and the function
// `toggled` for all that a toggle changes beside them.

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
  toggled(what);
}
