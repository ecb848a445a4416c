// Sharing: link to the current time, and picture of the view.

// The address contains the time: `#t=` and seconds. `#slide` shows the page as a slide. The time is
// updated after a pause, since browsers limit the rate of updates.
let linking = 0;
// An embedded page, as in a notebook, has no address of its own.
const hasAddress = document.baseURI.split("#")[0] === location.href.split("#")[0];
function linkLater() {
  if (!hasAddress) return;
  clearTimeout(linking);
  linking = setTimeout(() => {
    if (isPlaying) linkLater();
    else if (!isSlide()) history.replaceState(null, "", `#t=${Number(time.toFixed(9))}`);
  }, 400);
}

function readLink() {
  if (location.hash === "#slide" && !isSlide()) widen();
  const wanted = Number(/^#t=([-+.\deE]+)$/.exec(location.hash)?.[1] ?? NaN);
  if (Number.isFinite(wanted)) setTime(wanted);
}

// Shows the command that starts a live run from the moment shown.
function takeOver() {
  const [run] = runs;
  const { command, first, every } = run.data.takeover;
  put($("takeover-note").querySelector("code"), `${command} ${first + run.row(run.frame(time)) * every}`);
  $("takeover-note").hidden = false;
}

// Saves the views side by side as one picture, with the time.
function savePicture() {
  const shown = stages.filter(isShown);
  // Full detail, also during playback. Only a choice is outlined.
  for (const stage of shown) stage.paint(camera, time, time, { ...show, marked: show.chosen }, FULL);
  const room = Math.round(34 * devicePixelRatio);
  const made = document.createElement("canvas");
  made.width = shown.reduce((sum, { canvas }) => sum + canvas.width, 0);
  made.height = shown[0].canvas.height + room;
  const context = made.getContext("2d");
  context.fillStyle = colours.sky;
  context.fillRect(0, 0, made.width, made.height);
  Object.assign(context, { fillStyle: colours.ink, textBaseline: "middle" });
  context.font = `${Math.round(0.42 * room)}px system-ui, sans-serif`;
  let left = 0;
  for (const { canvas, members } of shown) {
    context.drawImage(canvas, left, room);
    const name = isPair ? `${members.map((run) => run.name).join(" and ")}, ` : "";
    context.fillText(`${name}t = ${clock(time)} s`, left + 0.4 * room, room / 2);
    left += canvas.width;
  }
  repaint();
  const link = element("a", { download: `tumble-${clock(time)}s.png` });
  made.toBlob((blob) => {
    link.href = URL.createObjectURL(blob);
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  });
}
