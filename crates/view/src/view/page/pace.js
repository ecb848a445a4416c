// How finely the motion is painted while it plays: as finely as the machine can in time. What stands still is painted in full.

// The share of the pixels' number along each side, and whether there are shadows.
const DETAILS = [
  { share: 1, shadows: true },
  { share: 0.7, shadows: true },
  { share: 0.5, shadows: true },
  { share: 0.5, shadows: false },
];
const FULL = DETAILS[0];
// A frame that takes longer is seen as a jerk, ms; after so many more of them than of others it is painted less finely.
const SLOW = 34;
const PATIENCE = 6;

class Pace {
  constructor() {
    this.level = 0;
    this.slow = 0;
  }

  get detail() {
    return DETAILS[this.level];
  }

  // After a frame that took so many milliseconds. What was too fine once stays so: a picture that changes is worse.
  after(milliseconds) {
    this.slow = Math.max(0, this.slow + (milliseconds > SLOW ? 1 : -1));
    if (this.slow < PATIENCE) return;
    this.level = Math.min(this.level + 1, DETAILS.length - 1);
    this.slow = 0;
  }
}
