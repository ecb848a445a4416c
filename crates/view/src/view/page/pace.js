// Level of detail during playback, adapted to the speed of the machine. Paused pictures have full
// detail.

// Resolution relative to full size along each side, and flags for shadows and ambient occlusion.
const DETAILS = [
  { share: 1, shadows: true, ambience: true },
  { share: 0.7, shadows: true, ambience: true },
  { share: 0.7, shadows: true, ambience: false },
  { share: 0.5, shadows: true, ambience: false },
  { share: 0.5, shadows: false, ambience: false },
];
const FULL = DETAILS[0];
// Duration of a slow frame (ms), and number of excess slow frames that reduces the detail. Very slow
// frames count several times.
const SLOW = 34;
const PATIENCE = 6;
const MOST_COUNTED = 3;

class Pace {
  constructor() {
    this.level = 0;
    this.slow = 0;
  }

  get detail() {
    return DETAILS[this.level];
  }

  // Records a frame of this duration. The detail never increases again, since changes are
  // distracting.
  after(milliseconds) {
    const count = Math.min(MOST_COUNTED, Math.floor(milliseconds / SLOW));
    this.slow = Math.max(0, this.slow + (count > 0 ? count : -1));
    if (this.slow < PATIENCE) return;
    this.level = Math.min(this.level + 1, DETAILS.length - 1);
    this.slow = 0;
  }
}
