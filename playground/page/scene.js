// Drawing of one scene. The scripts of the stage are evaluated anew for each, with its run.

const LABEL =
  "Motion; drag a body to pull it, drag elsewhere to orbit, wheel or pinch to zoom; keys w a s d and z x do the same";

function drawingOf(film, former) {
  const run = new LiveRun(film);
  const runs = [run];
  const isCrowd = run.bodies.length > 1;
  // Forces are those of the last step and do not fade.
  const isPlaying = false;
  const tracked = () => [];
  // STAGE
  const stage = new Stage(runs, LABEL, former);
  // OVERLAYS
  return {
    run,
    stage,
    base: BASE,
    overlays: null,
    newOverlays: () => new LiveOverlays(stage, run),
    free: () => freeStage(stage),
    // Points that a fitted view shows: bodies and fixed objects, and their feet on the ground.
    extent: () => {
      const now = visited(run);
      const [ground] = grounds;
      const foot = (point) => subtract(point, times(ground.normal, ground.height(point)));
      return ground === null ? now : now.concat(now.map(foot));
    },
    middle: () => middleOf(runs, 0, []),
  };
}
