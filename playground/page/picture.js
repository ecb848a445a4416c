// Picture and numbers of the present moment.

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

// Longest time for which a window waits while others run the same scene faster (s).
const LONGEST_LEAD = 0.1;

// Takes steps. The simulation does not catch up with a clock that it cannot follow. Steps that other
// windows took count too.
async function advance(steps) {
  if (steps < 1) return;
  isAdvancing = true;
  const scene = opened;
  const from = head.index;
  const { done, took } = await asked({ do: "advance", steps, contacts: wantsContacts(), target });
  if (scene !== opened) return;
  isAdvancing = false;
  const taken = Math.max(steps, head.index - from);
  owed = done === steps ? Math.max(-LONGEST_LEAD, owed - taken * look.timeStep) : 0;
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
