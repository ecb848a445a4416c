// Trails of the centres of mass.

// Number of segments of a trail, and dash length of its future part in segments.
const PIECES = 1200;
const DASH = 3;

const trails = runs.map(() => new Map());

// Frames along the path, and positions there relative to `base`.
function trailOf(run, body, base) {
  const known = trails[run.index];
  if (!known.has(body)) {
    const frames = run.way(body, PIECES);
    const places = frames.map((frame) => subtract(run.position(frame, body), base));
    known.set(body, { frames, places });
  }
  return known.get(body);
}

// Adds the segments of a trail to the past part `behind` and the future part `ahead`.
function splitTrail({ frames, places }, frame, here, behind, ahead) {
  for (let k = 0; k + 1 < frames.length; k += 1) {
    const [from, to] = [places[k], places[k + 1]];
    if (!isFinitePoint(from) || !isFinitePoint(to)) continue;
    if (frames[k + 1] <= frame) {
      behind.push(...from, ...to);
    } else if (frames[k] < frame && isFinitePoint(here)) {
      behind.push(...from, ...here);
      ahead.push(...here, ...to);
    } else if (Math.floor(k / DASH) % 2 === 0) {
      ahead.push(...from, ...to);
    }
  }
}
